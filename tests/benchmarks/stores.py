"""Lists and puts of a large database: `python -m tests.benchmarks.stores [--records 10000]`, about a minute.

Prints the seconds of a list, with and without a filter, and of a put beside ten records and beside all.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median

from gudgeon.modaldb.format.hdf5 import record_bytes
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


def clocks() -> tuple[float, float]:
    """Return wall clock and CPU time [s], that of ended children included; other work changes the latter least."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return time.perf_counter(), sum(one.ru_utime + one.ru_stime for one in used)


Times = tuple[float, float]


def seconds(call: Callable[[], object], times: int = 5) -> Times:
    """Return the shortest wall and CPU time of a call."""
    found = []
    for _ in range(times):
        begun = clocks()
        call()
        found.append([now - then for now, then in zip(clocks(), begun, strict=True)])
    return min(one[0] for one in found), min(one[1] for one in found)


def put_seconds(stores: Sequence[FolderStore]) -> list[Times]:
    """Return the median times of a put of a new record to each store; they take turns, under the same load."""
    found: list[list[list[float]]] = [[] for _ in stores]
    for number in range(PUTS):
        for times, store in zip(found, stores, strict=True):
            begun, cpu = time.perf_counter(), time.process_time()
            store.put(content_key(inputs_of(10**6 + number)), "mesh", mesh(), inputs_of(10**6 + number))
            times.append([time.perf_counter() - begun, time.process_time() - cpu])
    return [(median(one[0] for one in times), median(one[1] for one in times)) for times in found]


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
    for name, (wall, cpu) in rows.items():
        print(f"{name:32} {wall:8.4f} s, {cpu:7.4f} s of CPU time")


if __name__ == "__main__":
    main()
