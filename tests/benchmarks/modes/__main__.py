"""Command line of the benchmark: runs contestants one at a time, keeps every run, writes the table.

A second call replaces the runs of the contestants that it names and keeps the others, so that one of them can be
measured anew. Exit 1 where one failed or its frequencies are not the others'.
"""

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tests.benchmarks.modes import picture, table
from tests.benchmarks.modes.runner import (
    CONTESTANTS,
    FLOOR,
    ROOT,
    STATICS,
    Contestant,
    FailedError,
    NotInstalledError,
    run,
)

SIZES = {"27k": 6.0e-3, "109k": 3.4e-3, "318k": 2.25e-3, "700k": 1.695e-3, "1300k": 1.405e-3}
"""Edge length [m] by the dofs that it gives."""
MODES = 30
REPEAT_BELOW = 60.0
"""Wall seconds: what takes longer runs once."""


def main() -> int:
    """Run what the command line asks for."""
    asked = arguments()
    out: Path = asked.out
    (out / "meshes").mkdir(parents=True, exist_ok=True)
    results = read(out / "runs.json")
    for size in asked.sizes:
        results["dofs"][size] = prepared(mesh_path(out, size), SIZES[size])
    failed = 0
    chosen = list(pairings(asked))
    if not asked.table:
        again = {(size, name, threads) for size, name, threads in chosen}
        results["runs"] = [r for r in results["runs"] if (r["size"], r["contestant"], r["threads"]) not in again]
        failed = race(asked, chosen, results)
        for key, extra in (("floor", FLOOR), ("statics", STATICS)):
            if "gudgeon" in asked.contestants and not asked.bare:
                for size in asked.sizes:
                    failed += alone(asked, size, extra, results[key])
                    write(out / "runs.json", results)
    wrong = report(out, results)
    return int(bool(failed or wrong))


def report(out: Path, results: dict[str, Any]) -> list[str]:
    """Write the table as text, CSV and JSON, and as a picture, print it, and return what disagrees."""
    runs = results["runs"]
    rows = table.rows(runs)
    wrong = table.disagreements(rows)
    sections = [
        [table.text(rows)],
        [table.phases(runs)],
        table.floors(rows, results["floor"]),
        table.statics(results["statics"]),
        table.targets(rows),
        [f"{run['size']} {run['contestant']}, {run['threads']}: {run['failed']}" for run in runs if "failed" in run],
        wrong,
    ]
    text = "\n\n".join("\n".join(lines) for lines in sections if any(lines))
    (out / "modes.csv").write_text(table.to_csv(rows))
    (out / "modes.json").write_text(json.dumps([asdict(row) for row in rows], indent=1))
    (out / "modes.txt").write_text(text + "\n")
    picture.draw(rows, out / "modes.png")
    print(text)
    return wrong


def arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.modes", description=__doc__)
    parser.add_argument("--sizes", nargs="+", choices=SIZES, default=list(SIZES))
    parser.add_argument("--contestants", nargs="+", choices=CONTESTANTS, help="all that fit the size, if none is named")
    parser.add_argument("--threads", nargs="+", type=int, default=[1, 2], help="of those that have more than one")
    parser.add_argument("--repeats", type=int, default=3, help=f"of runs that take less than {REPEAT_BELOW:.0f} s")
    parser.add_argument("--timeout", type=float, default=1800.0, help="seconds after which a run is stopped")
    parser.add_argument("--peers-python", default=sys.executable, help="interpreter that has ngsolve and Exudyn")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "bench-peers")
    parser.add_argument("--bare", action="store_true", help="neither floor nor static shapes")
    parser.add_argument("--table", action="store_true", help="run nothing, write the table of what was kept")
    asked = parser.parse_args()
    asked.peers_python = os.path.abspath(asked.peers_python)
    asked.named = asked.contestants is not None
    asked.contestants = asked.contestants or list(CONTESTANTS)
    return asked


def pairings(asked: argparse.Namespace) -> Iterator[tuple[str, str, int]]:
    """Yield size, contestant and threads of all that is to run."""
    for size in asked.sizes:
        dofs = 1000 * int(size.removesuffix("k"))
        for name in asked.contestants:
            contestant = CONTESTANTS[name]
            if asked.named or dofs <= contestant.largest:
                for threads in asked.threads if contestant.threads else [1]:
                    yield size, name, threads


def race(asked: argparse.Namespace, chosen: list[tuple[str, str, int]], results: dict[str, Any]) -> int:
    """Run each once, then again, so that a change of the machine's load meets all alike; return how many failed."""
    done, failed = set(), 0
    for _ in range(asked.repeats):
        for key in [key for key in chosen if key not in done]:
            size, name, threads = key
            entry = {"size": size, "contestant": name, "threads": threads, "dofs": results["dofs"][size]}
            answer, said = attempt(asked, size, CONTESTANTS[name], threads)
            if answer is None:
                done.add(key)
                failed += said["failed"] is not None
            elif answer["process"]["wall"] > REPEAT_BELOW:
                done.add(key)
            results["runs"].append(entry | ({"answer": answer} if answer else {"failed": said["text"]}))
            write(asked.out / "runs.json", results)
            print(f"{size} {name}, {threads} thread(s): {said['text']}", file=sys.stderr, flush=True)
    return failed


def alone(asked: argparse.Namespace, size: str, extra: Contestant, into: dict[str, Any]) -> int:
    """Run floor or statics at a size; return 1 where it failed."""
    answer, said = attempt(asked, size, extra, 1)
    if answer is not None:
        into[size] = answer
    print(f"{size} {extra.module}: {said['text']}", file=sys.stderr, flush=True)
    return int(said["failed"] is not None)


def attempt(
    asked: argparse.Namespace, size: str, contestant: Contestant, threads: int
) -> tuple[dict[str, Any] | None, dict[str, Any]]:
    """Run a contestant; return its answer, or None, and what is to be said of it."""
    mesh = mesh_path(asked.out, size)
    try:
        answer = run(contestant, mesh, MODES, threads=threads, python=asked.peers_python, timeout=asked.timeout)
    except NotInstalledError as error:
        return None, {"failed": None, "text": f"skipped: {error}"}
    except FailedError as error:
        return None, {"failed": True, "text": f"failed: {error}"}
    used = answer["process"]
    text = f"{used['wall']:.1f} s wall, {used['cpu']:.1f} s CPU, {used['memory']:.0f} MiB, load {answer['load']:.1f}"
    return answer, {"failed": None, "text": text}


def mesh_path(out: Path, size: str) -> Path:
    """Return where a mesh lies."""
    return out.resolve() / "meshes" / f"{size}.npz"


def prepared(path: Path, size: float) -> int:
    """Make a mesh that is not there, in a process of its own, and return its dofs."""
    if not path.exists():
        subprocess.run([sys.executable, "-m", "tests.benchmarks.modes.mesh", path, str(size)], cwd=ROOT, check=True)
    count = "import sys, numpy; print(3 * len(numpy.load(sys.argv[1])['nodes']))"
    return int(subprocess.run([sys.executable, "-c", count, path], check=True, capture_output=True, text=True).stdout)


def read(path: Path) -> dict[str, Any]:
    """Return what earlier calls kept."""
    empty: dict[str, Any] = {"dofs": {}, "runs": [], "floor": {}, "statics": {}}
    return json.loads(path.read_text()) if path.exists() else empty


def write(path: Path, results: dict[str, Any]) -> None:
    """Keep all runs."""
    path.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    sys.exit(main())
