"""Lists and puts of a large database: `python -m tests.benchmarks.stores [--records 10000]`, about a minute.

Prints the seconds of a list, with and without a filter, and of a put beside ten records and beside all.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median

from gudgeon.modaldb.hdf5 import record_bytes
from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.stores.folder import FolderStore, open_folder
from gudgeon.modaldb.stores.query import Query, condition
from tests.modaldb.samples import INPUTS, mesh

PUTS = 50


def inputs_of(number: int) -> dict:
    return INPUTS | {"number": number}


def fill(store: FolderStore, first: int, end: int) -> None:
    """Write records without flushing each to the disk."""
    for number in range(first, end):
        path = store.path(content_key(inputs_of(number)))
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"".join(record_bytes("mesh", mesh(), inputs_of(number))))


def seconds(call: Callable[[], object], times: int = 5) -> float:
    """Return the shortest time of a call."""
    found = []
    for _ in range(times):
        begun = time.perf_counter()
        call()
        found.append(time.perf_counter() - begun)
    return min(found)


def put_seconds(stores: Sequence[FolderStore]) -> list[float]:
    """Return the median time of a put of a new record to each store; they take turns, under the same load."""
    found: list[list[float]] = [[] for _ in stores]
    for number in range(PUTS):
        for times, store in zip(found, stores, strict=True):
            begun = time.perf_counter()
            store.put(content_key(inputs_of(10**6 + number)), "mesh", mesh(), inputs_of(10**6 + number))
            times.append(time.perf_counter() - begun)
    return [median(times) for times in found]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=10_000)
    count = parser.parse_args().records
    with tempfile.TemporaryDirectory() as folder:
        store = open_folder(Path(folder) / "db")
        few = open_folder(Path(folder) / "few")
        fill(few, 0, 10)
        fill(store, 0, count)
        first = seconds(store.find, 1)
        filtered = Query(where=(condition(f"number>={count - 10}"),))
        rows = {
            "first list, all records read": first,
            "list of all": seconds(store.find),
            "list with a filter": seconds(lambda: store.find(filtered)),
            "`gudgeon db ls` with a filter": seconds(
                lambda: subprocess.run(
                    [Path(sys.executable).with_name("gudgeon"), "db", "ls", "--db", str(store.root), "--where",
                     f"number>={count - 10}"], check=True, capture_output=True)),
            "import of gudgeon.modaldb": seconds(
                lambda: subprocess.run([sys.executable, "-c", "import gudgeon.modaldb"], check=True)),
        }  # fmt: skip
        puts = put_seconds((few, store))
        rows |= {"put beside 10 records": puts[0], f"put beside {count} records": puts[1]}
    for name, value in rows.items():
        print(f"{name:32} {value:8.4f} s")


if __name__ == "__main__":
    main()
