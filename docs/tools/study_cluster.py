"""Where many workers saturate the scheduler of a study, or the database: `python -m docs.tools.study_cluster`.

Workers of a simulated cluster sleep in place of solving and put a record of a run of the piston's size into one
database. The scheduler is the real one; its steps and rows are those of a study. The picture has designs per second
over the time of a solve, the table printed the CPU time of scheduler and of putting, which do not depend on what else
the machine does. `--db` takes any location of a database.
"""

import argparse
import json
import os
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from gudgeon import modaldb
from gudgeon.modaldb.keys import content_key
from gudgeon.pipeline.kinds import open_job, run
from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.studies.dispatch import dispatched
from gudgeon.pipeline.studies.executors import Workers, processes
from gudgeon.pipeline.studies.planning import planned
from gudgeon.pipeline.studies.task import Row, Source, Task, version_key

SCENE, VELOCITY = "data/rod-wall", "body.rod.velocity.0"
FRAMES = 1_150
"""Of the run whose record is put: with them it has the 2.3 MB of a stroke of the piston."""
TIMES = (3.0, 1.0, 0.3, 0.1, 0.03, 0.01)
"""Stubbed times of a solve [s]."""
LONG, MOST = 5.0, 1500
"""Time that a trial takes where nothing saturates [s], and largest number of its designs."""
PLACE, TIME, RECORD = "GUDGEON_CLUSTER_DB", "GUDGEON_CLUSTER_TIME", "GUDGEON_CLUSTER_RECORD"
"""Variables that tell workers the database, the file with the time of a solve, and key and database of the record."""


@cache
def template() -> tuple[Row, object]:
    """Return the row and the record that every design gives."""
    key, folder = os.environ[RECORD].split(" ", 1)
    record = modaldb.open(folder).get(key, "trajectory")
    return Row(1, record.result, key=key, quantities=record.quantities, errors=record.estimates), record


@cache
def store(location: str) -> object:
    return modaldb.open(location)


def stub(task: Task) -> Row:
    """Sleep as long as a solve takes and put its record; return its row with the CPU seconds of putting."""
    row, record = template()
    seconds = float(Path(os.environ[TIME]).read_text())
    time.sleep(seconds)
    begin = time.process_time()
    if location := Path(os.environ[PLACE]).read_text():
        inputs = {"stage": "solve", "design": task.design, "seconds": seconds, "changes": task.changes}
        store(location).put(content_key(inputs), "trajectory", record, inputs)  # type: ignore[attr-defined]
    return replace(row, design=task.design, cpu=(time.process_time() - begin, 0.0))


def trial(source: Source, workers: Workers, count: int, work: Callable[[Task], Row]) -> tuple[float, float, float]:
    """Return designs per second, and CPU time of the scheduler and of putting for each design [s]."""
    begin, cpu = time.monotonic(), time.process_time()
    designs = [(1.0 + 1e-3 * number,) for number in range(count)]
    steps = planned(source, ("mesh", "modes", "morph", "solve"), [VELOCITY], designs)
    rows = [row for _, row in dispatched(steps, workers, work)]
    assert len(rows) == count
    cpu = (time.process_time() - cpu) / count
    return count / (time.monotonic() - begin), cpu, sum(row.cpu[0] for row in rows) / count


def main() -> None:
    """Run the trials, print their figures and draw them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=32)
    parser.add_argument("--db", default="", help="location of the database (default: a folder on this machine)")
    parser.add_argument("--picture", type=Path, default=Path("docs/study-cluster.png"))
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        settings = {"run.samples": 4 * FRAMES, "run.frames": FRAMES}
        found = run(SCENE, set=settings, db=folder / "template", out=folder / "out", until="solve")
        key = found.stages["solve"].key
        size = modaldb.open(folder / "template").path(key).stat().st_size
        os.environ[RECORD] = f"{key} {folder / 'template'}"
        os.environ[PLACE], os.environ[TIME] = str(folder / "place"), str(folder / "time")
        job = open_job(SCENE, set=settings, db=folder / "template", out=folder / "out")
        source = Source(job.name, str(job.path.absolute()), _text(job.tables), str(folder / "template"), version_key())
        real = processes(options.workers)
        pool = real.open()
        workers = Workers(lambda: pool, _leave, real.given_out)
        try:
            rows = _trials(source, workers, options, folder)
        finally:
            real.close(pool)
    print(f"record of a run: {size / 1e6:.2f} MB; {options.workers} workers on {os.cpu_count()} cores")
    for place, found_rows in rows.items():
        for seconds, (rate, scheduler, putting) in zip(TIMES, found_rows, strict=True):
            print(
                f"{place:10} solve {seconds:5.2f} s: {rate:7.1f} designs/s of {options.workers / seconds:7.1f};"
                f" scheduler {scheduler * 1e3:.2f} ms, put {putting * 1e3:.1f} ms CPU a design"
            )
    _draw(options.picture, rows, options.workers)


def _trials(
    source: Source, workers: Workers, options: argparse.Namespace, folder: Path
) -> dict[str, list[tuple[float, float, float]]]:
    """Return the figures of each time of a solve, without and with a database."""
    found: dict[str, list[tuple[float, float, float]]] = {}
    places = {"scheduler": "", "database": options.db or str(folder / "db")}
    for name, location in places.items():
        (folder / "place").write_text(location)
        (folder / "time").write_text("0.2")
        trial(source, workers, 4 * options.workers, stub)  # Every process starts and loads.
        for seconds in TIMES:
            (folder / "time").write_text(str(seconds))
            count = int(min(max(2 * options.workers, LONG * options.workers / seconds), MOST))
            found.setdefault(name, []).append(trial(source, workers, count, stub))
    return found


def _leave(pool: Executor) -> None:
    """Keep the processes for the next trial."""


def _draw(path: Path, rows: dict[str, list[tuple[float, float, float]]], workers: int) -> None:
    with style.styled():
        words = f"{workers} workers that sleep for the time of a solve"
        figure = style.new_figure("Study on a simulated cluster", words, height=900)
        (axes,) = style.rows(figure, [1.0], 0.0)
        times = np.array(TIMES)
        axes.loglog(times, workers / times, color=style.GREY, lw=1.2, ls="--", label="workers alone")
        names = {"scheduler": "scheduler, nothing is kept", "database": "scheduler and database"}
        for colour, (name, found) in zip((style.BLUE, style.ORANGE), rows.items(), strict=True):
            axes.loglog(times, [one[0] for one in found], "o-", color=colour, ms=4, lw=1.4, label=names[name])
        axes.set_xlabel("time of a solve [s]")
        axes.set_ylabel("designs per second")
        style.legend(axes)
        style.save(figure, path)


def _text(tables: dict[str, object]) -> str:
    return json.dumps({name: table for name, table in tables.items() if name not in ("report", "plot", "robustness")})


if __name__ == "__main__":
    main()
