"""What a study of piston profiles costs beside its computations: `python -m docs.tools.study_costs [--designs 200]`.

Designs of a Latin hypercube run on two processes; the table printed has CPU seconds for each design and their ratios,
which do not depend on what else the machine does, and the share of time in which workers computed.
"""

import argparse
import json
import os
import tempfile
import time
from itertools import pairwise
from pathlib import Path
from statistics import median

import threadpoolctl

from gudgeon.pipeline.kinds import open_job
from gudgeon.pipeline.stages.run import solve_records
from gudgeon.pipeline.studies.designs import Sampling
from gudgeon.pipeline.studies.executors import ONE_THREAD
from gudgeon.pipeline.studies.study import Asked, run_study
from gudgeon.pipeline.studies.task import Row, Task, solve_design

SCENE, BASE = "data/piston/stroke.toml", "component.piston.change"
VARY = (f"{BASE}.profile.scale=0.9:1.1", f"{BASE}.profile.offset=-4e-6:2e-6")
JOBS, RECOMPUTED = 2, 3
LOGS = "GUDGEON_STUDY_LOGS"
"""Variable that names the folder of the workers' logs."""


def logged(task: Task) -> Row:
    """Solve a design and write when it began and ended, and its CPU seconds, to a file of this process."""
    begin = time.monotonic()
    row = solve_design(task)
    with Path(os.environ[LOGS], f"{os.getpid()}.jsonl").open("a") as file:
        file.write(json.dumps([begin, time.monotonic(), *row.cpu, row.result]) + "\n")
    return row


def costs_of(update: str, places: dict[str, Path]) -> list[dict[str, float]]:
    """Return the CPU seconds of each stage of designs, without loading modules.

    Args:
        update: `reuse` keeps their modes, `recompute` computes them again.
    """
    found = []
    for number in range(RECOMPUTED + 1):
        change = {f"{BASE}.update": update, f"{BASE}.profile.offset": -1e-6 - 1e-7 * number}
        report = solve_records(open_job(SCENE, set=change, **places), "solve")
        found.append({name: stage.cpu for name, stage in report.stages.items()})
    return found[1:]


def typical(rows: list[dict[str, float]], *stages: str) -> float:
    """Return the median of the sum of some stages [s]."""
    return median(sum(row[stage] for stage in stages) for row in rows)


def study_figures(places: dict[str, Path], count: int) -> None:
    """Run the study and print its figures."""
    job = open_job(SCENE, set={f"{BASE}.update": "reuse"}, **places)
    solve_records(job, "modes")
    logs = Path(os.environ[LOGS])
    asked = Asked(VARY, sampling=Sampling("latin", count), jobs=JOBS)
    begin, cpu = time.monotonic(), time.process_time()
    report = run_study(job, asked, lambda stage, share: None, logged)
    cpu = time.process_time() - cpu
    workers = {path.stem: [json.loads(line) for line in path.read_text().splitlines()] for path in logs.iterdir()}
    rows = [row for found in workers.values() for row in found if row[2] > 0]
    end = max(row[1] for row in rows)
    busy = sum(row[1] - row[0] for found in workers.values() for row in found)
    later = [row for found in workers.values() for row in found[2:] if row[2] > 0]
    between = [b[0] - a[1] for found in workers.values() for a, b in pairwise(found[1:])]
    print(f"{report.counts}; processes: {len(workers)}")
    print(f"CPU of a design              {median(row[2] for row in later):8.4f} s")
    print(f"  beside computing           {median(row[2] - row[3] for row in later) * 1e3:8.1f} ms")
    print(f"between two designs          {median(between) * 1e3:8.1f} ms")
    print(f"CPU of the study's own process {cpu / len(rows) * 1e3:6.1f} ms a design, table and picture included")
    print(f"share of time in designs     {busy / JOBS / (end - begin):8.1%}, from the command's start")


def main() -> None:
    """Print all figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--designs", type=int, default=200)
    options = parser.parse_args()
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    threadpoolctl.threadpool_limits(1)
    with tempfile.TemporaryDirectory() as folder:
        logs = Path(folder, "logs")
        logs.mkdir()
        os.environ[LOGS] = str(logs)
        places = {"db": Path(folder, "db"), "out": Path(folder, "out")}
        study_figures(places, options.designs)
        kept, again = costs_of("reuse", places), costs_of("recompute", places)
        for name, rows in (("modes kept", kept), ("modes computed", again)):
            parts = ", ".join(f"{stage} {typical(rows, stage):.3f}" for stage in rows[0])
            print(f"{name:15} {parts} s CPU")
        change = typical(again, "mesh", "modes", "morph") / typical(kept, "morph")
        whole = typical(again, *again[0]) / typical(kept, *kept[0])
        print(f"computing modes costs {change:.1f} times the change of the design, and {whole:.1f} times all of it")


if __name__ == "__main__":
    main()
