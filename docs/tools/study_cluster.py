"""Where many workers saturate the scheduler of a study, or the database: `python -m docs.tools.study_cluster`.

Workers of a simulated cluster sleep in place of solving and put a record of a run of the piston's size into one
database: a folder, and a server of one. The scheduler is the real one; its steps and rows are those of a study. The
picture has designs per second over the time of a solve, the table printed the CPU time of the scheduler, of putting and
of the server, which do not depend on what else the machine does. `--db` takes any other location of a database.
"""

import argparse
import contextlib
import json
import os
import secrets
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

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
LONG, MOST, PUT = 5.0, 1500, 300
"""Time that a trial takes where nothing saturates [s], and largest number of its designs, without and with a put."""
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


class Figures(NamedTuple):
    """What a trial gives; CPU times are those of one design [s]."""

    rate: float
    """Designs per second."""
    scheduler: float
    putting: float
    """Of the worker."""
    server: float = 0.0


@contextlib.contextmanager
def served(folder: Path) -> Iterator[tuple[str, int]]:
    """Serve a database; yield its URL and the number of the server's process, and give workers its token."""
    own = {"GUDGEON_TOKEN": secrets.token_hex(16), "GUDGEON_CACHE": str(folder / "cache"), "GUDGEON_DB_WAIT": "120"}
    os.environ.update(own)
    command = [sys.executable, "-m", "gudgeon.pipeline", "serve", "--db", str(folder / "served"), "--port", "0",
               "--audit", str(folder / "audit")]  # fmt: skip
    child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert child.stdout is not None
        yield child.stdout.readline().split()[-1], child.pid
    finally:
        child.send_signal(signal.SIGINT)
        child.wait()


def cpu_of(process: int | None) -> float:
    """Return the CPU time of a process so far [s]."""
    if process is None:
        return 0.0
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def trial(
    source: Source, workers: Workers, count: int, work: Callable[[Task], Row], server: int | None = None
) -> Figures:
    """Run a number of designs; `server` is the process of the database."""
    served_before = cpu_of(server)
    begin, cpu = time.monotonic(), time.process_time()
    designs = [(1.0 + 1e-3 * number,) for number in range(count)]
    steps = planned(source, ("mesh", "modes", "morph", "solve"), [VELOCITY], designs)
    rows = [row for _, row in dispatched(steps, workers, work)]
    assert len(rows) == count
    cpu = (time.process_time() - cpu) / count
    rate, putting = count / (time.monotonic() - begin), sum(row.cpu[0] for row in rows) / count
    return Figures(rate, cpu, putting, (cpu_of(server) - served_before) / count)


def main() -> None:
    """Run the trials, print their figures and draw them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=32)
    parser.add_argument("--db", default="", help="location of a database in place of a folder and a server")
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
        with served(folder) as (url, server):
            pool = real.open()
            workers = Workers(lambda: pool, _leave, real.given_out)
            places = {"scheduler": ("", None), "folder": (str(folder / "db"), None), "server": (url, server)}
            if options.db:
                places = {"scheduler": ("", None), options.db: (options.db, None)}
            try:
                rows = {name: _trials(source, workers, options.workers, folder, place)
                        for name, place in places.items()}  # fmt: skip
            finally:
                real.close(pool)
    print(f"record of a run: {size / 1e6:.2f} MB; {options.workers} workers on {os.cpu_count()} cores")
    for place, found_rows in rows.items():
        for seconds, one in zip(TIMES, found_rows, strict=True):
            print(
                f"{place:10} solve {seconds:5.2f} s: {one.rate:7.1f} designs/s of {options.workers / seconds:7.1f}; CPU"
                f" a design: scheduler {one.scheduler * 1e3:.2f} ms, put {one.putting * 1e3:.1f} ms,"
                f" server {one.server * 1e3:.1f} ms"
            )
    _draw(options.picture, rows, options.workers)


def _trials(source: Source, workers: Workers, count: int, folder: Path, place: tuple[str, int | None]) -> list[Figures]:
    """Return the figures of each time of a solve; `place` is a database, if any, and the process of its server."""
    (folder / "place").write_text(place[0])
    (folder / "time").write_text("0.2")
    trial(source, workers, 4 * count, stub)  # Every process starts and loads.
    found = []
    for seconds in TIMES:
        (folder / "time").write_text(str(seconds))
        designs = int(min(max(2 * count, LONG * count / seconds), PUT if place[0] else MOST))
        found.append(trial(source, workers, designs, stub, place[1]))
    return found


def _leave(pool: Executor) -> None:
    """Keep the processes for the next trial."""


def _draw(path: Path, rows: dict[str, list[Figures]], workers: int) -> None:
    with style.styled():
        words = f"{workers} workers that sleep for the time of a solve"
        figure = style.new_figure("Study on a simulated cluster", words, height=900)
        (axes,) = style.rows(figure, [1.0], 0.0)
        times = np.array(TIMES)
        axes.loglog(times, workers / times, color=style.GREY, lw=1.2, ls="--", label="workers alone")
        names = {"scheduler": "scheduler, nothing is kept", "folder": "database in a folder", "server": "a server"}
        for colour, (name, found) in zip((style.BLUE, style.ORANGE, style.GREEN), rows.items(), strict=False):
            label = names.get(name, name)
            axes.loglog(times, [one.rate for one in found], "o-", color=colour, ms=4, lw=1.4, label=label)
        axes.set_xlabel("time of a solve [s]")
        axes.set_ylabel("designs per second")
        style.legend(axes)
        style.save(figure, path)


def _text(tables: dict[str, object]) -> str:
    return json.dumps({name: table for name, table in tables.items() if name not in ("report", "plot", "robustness")})


if __name__ == "__main__":
    main()
