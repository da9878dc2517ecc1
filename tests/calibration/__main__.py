"""`python -m tests.calibration [--count N] [--seed S] [--only KIND …]`: stated and true errors of random scenes.

Writes a line a scene to `rows-I.jsonl` of a folder, `out/calibration`, from each of `--workers` processes, and
docs/calibration.md with its picture; `--page` writes the page of the lines that are there. A run that was ended goes on
where it was.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tests.calibration.case import Draw
from tests.calibration.judged import judged
from tests.calibration.kinds import KINDS, TURNS
from tests.calibration.page import read_rows, write_page

COUNT, SEED, WORKERS = 500, 1, 2


def schedule(names: list[str], count: int) -> list[tuple[str, int]]:
    """Return kind and number of each scene."""
    numbers: dict[str, int] = {}
    scenes = []
    for turn in range(count):
        kind = names[turn % len(names)]
        scenes.append((kind, numbers.get(kind, 0)))
        numbers[kind] = numbers.get(kind, 0) + 1
    return scenes


def entries(scenes: list[tuple[str, int]], seed: int, folder: Path) -> Iterator[dict[str, Any]]:
    """Yield the results of scenes."""
    for kind, number in scenes:
        yield judged(kind, number, KINDS[kind](Draw(seed, kind, number)), folder)


def work(given: argparse.Namespace, worker: int) -> None:
    """Run the scenes of one of the workers that have no line yet, and say what each states and what is true."""
    path = given.out / f"rows-{worker}.jsonl"
    lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    done = {(entry["kind"], entry["number"]) for entry in map(json.loads, lines)}
    scenes = [scene for scene in schedule(given.only, given.count)[worker :: given.workers] if scene not in done]
    with TemporaryDirectory() as folder, path.open("a", encoding="utf-8") as stream:
        for entry in entries(scenes, given.seed, Path(folder)):
            print(json.dumps(entry), file=stream, flush=True)
            print(entry["kind"], entry["number"], entry["cpu"], entry.get("failed", ""), file=sys.stderr)
            for row in entry.get("rows", ()):
                stated = "-" if row["stated"] is None else f"{row['stated']:.2e}"
                print(
                    f"    {row['figure']:22} {row['source']:6} stated {stated:9} true {row['true']:.2e}",
                    file=sys.stderr,
                )


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser("calibration")
    parser.add_argument("--count", type=int, default=COUNT, help=f"number of scenes (default {COUNT})")
    parser.add_argument("--seed", type=int, default=SEED, help="another seed draws other scenes; give it another --out")
    parser.add_argument("--only", nargs="*", default=TURNS, metavar="KIND", help="kinds of scenes; default: all")
    parser.add_argument("--out", type=Path, default=Path("out/calibration"), help="folder of the lines")
    parser.add_argument("--workers", type=int, default=WORKERS, help=f"processes (default {WORKERS})")
    parser.add_argument("--worker", type=int, help="run the share of this one alone")
    parser.add_argument("--page", action="store_true", help="write the page of the lines that are there")
    given = parser.parse_args(arguments)
    given.out.mkdir(parents=True, exist_ok=True)
    if given.worker is not None:
        work(given, given.worker)
        return 0
    if not given.page:
        command = [sys.executable, "-m", "tests.calibration", *arguments, "--worker"]
        processes = [subprocess.Popen([*command, str(worker)]) for worker in range(given.workers)]
        if any([process.wait() for process in processes]):
            return 1
    rows, failed, count = read_rows(sorted(given.out.glob("rows-*.jsonl")))
    write_page(rows, failed, count)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
