"""Runs the stages of a scene of any kind; a record that is in the database is not computed again."""

import logging
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import Any

from gudgeon.modaldb.keys import content_key, file_digest
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.files import write_sealed
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.base import PLOT, SceneJob, Stage
from gudgeon.pipeline.stages.folder import PICTURES, claim, held, remove_pictures
from gudgeon.pipeline.stages.keys.products import combined
from gudgeon.pipeline.stages.make import keep_for, scene_name
from gudgeon.pipeline.stages.run_report import Progress, RunReport, StageReport
from gudgeon.pipeline.stages.status import fresh_pictures, remember
from gudgeon.solver.errors import SceneError
from gudgeon.solver.result import Result

log = logging.getLogger(__name__)

SOLVE = "solve"
"""The stage of every kind whose record is the result of a run."""


class Stopped(Exception):
    """The user stopped a stage; the argument writes what it has done and returns the report."""


def run_job(job: Any, until: str = PLOT, progress: Progress | None = None) -> RunReport:
    """Compute the records of a job that are missing, up to and including the stage `until`, and write its results.

    Raises:
        InputError: there is no such stage, or the scene does not fit its mesh.
        StageError: a numerical routine failed.
    """
    with _prepared(job, until, progress) as (ready, tell):
        try:
            return _run(ready, until, tell)
        except Stopped as stopped:
            return stopped.args[0]()


def solve_records(job: Any, until: str, progress: Progress | None = None) -> RunReport:
    """Compute the records of a job that are missing, up to a stage before the pictures; write nothing else.

    Up to the stage `solve`, the report has the result, quantities and errors as `run_job` returns them.

    Raises:
        InputError, StageError: see `run_job`.
    """
    with _prepared(job, until, progress) as (ready, tell):
        stages = make_stages(ready, until, tell)
    solved = job.kind.solved if until == SOLVE else None
    return replace(RunReport(job.name, None) if solved is None else solved(job), stages=stages)


@contextmanager
def _prepared(job: SceneJob, until: str, progress: Progress | None) -> Iterator[tuple[SceneJob, Progress]]:
    """Give a job that is ready to run up to a stage, and a progress that may be called."""
    _wanted(job, until)
    tell = progress or (lambda stage, fraction: None)
    with job.kind.during(job, until, tell) as ready:
        yield ready, tell


def _run(job: SceneJob, until: str, tell: Progress) -> RunReport:
    stages_due = _wanted(job, until)
    waits = partial(tell, f"waiting for another run in {job.out}", 0.0)
    with held(job.out, waits):
        claim(job)
    stages = make_stages(job, until, tell)
    with held(job.out, waits):
        claim(job)
        report, pictures, notes = job.kind.results(job, until), list[str](), list[str]()
        if report.result is not None:
            removed = remove_pictures(job.out, content_key(job.pictures()))
            if removed and PLOT not in stages_due:
                notes = [f"pictures of an earlier result were removed: {', '.join(removed)}"]
        if PLOT in stages_due and report.result != Result.DIVERGED.name:
            stages[PLOT], pictures, notes = _plot_stage(job, tell)
        remember(job, stages_due)
    return replace(report, stages=stages, pictures=pictures, notes=[*notes, *report.notes])


def _wanted(job: SceneJob, until: str) -> Sequence[str]:
    if until not in job.stages:
        raise InputError(f"{job.path}: no stage '{until}'; its stages are {', '.join(job.stages)}")
    return job.stages[: job.stages.index(until) + 1]


def make_stages(job: SceneJob, until: str, tell: Progress) -> dict[str, StageReport]:
    """Compute the records of a job that are missing, up to and including a stage; see `run_job` for errors."""
    due = _wanted(job, until)
    return {stage.name: _make_stage(job, stage, tell) for stage in job.kind.stages if stage.name in due}


def _make_stage(job: SceneJob, stage: Stage, tell: Progress) -> StageReport:
    """Compute the records of a stage that are not in the database."""
    start, ran, keys, names, cpu = time.perf_counter(), False, [], {}, 0.0
    scene = scene_name(job)
    stage.check(job)
    # A component's mesh is its base mesh where nothing moves its nodes.
    products = {(product.name, product.key): product for product in job.products([stage.name]).values()}
    for product in products.values():
        keys.append(product.key)
        names[product.name] = product.key
        if job.store.has(product.key):
            job.store.note(product.key, scene, product.name)
            log.info("%s of '%s': fresh, record %s", stage.name, product.name, product.key[:12])
            continue
        tell(stage.name, 0.0)
        before = time.process_time()
        with named(job.path, InputError, StageError, SceneError):
            record = stage.make(job, product, tell)
        taken = time.process_time() - before
        cpu += taken
        text = "%s of '%s': computed in %.2f s of CPU time, record %s"
        log.info(text, stage.name, product.name, taken, product.key[:12])
        keep_for(job, product, record)
        ran = True
    tell(stage.name, 1.0)
    return StageReport("ran" if ran else "fresh", time.perf_counter() - start, combined(keys), names, cpu)


def _plot_stage(job: SceneJob, tell: Progress) -> tuple[StageReport, list[str], list[str]]:
    """Draw a job's pictures unless fresh ones are in its folder; return the stage's report, the files and the notes."""
    start, key = time.perf_counter(), content_key(job.pictures())
    if (pictures := fresh_pictures(job, key)) is not None:
        return StageReport("fresh", time.perf_counter() - start, key), pictures, []
    drawn, notes = job.kind.draw(job, tell)
    digests = {path.name: file_digest(path) for path in drawn}
    write_sealed(job.out / PICTURES, {"key": key, "files": digests, "complete": not notes})
    tell(PLOT, 1.0)
    return StageReport("ran", time.perf_counter() - start, key), [str(path) for path in drawn], notes
