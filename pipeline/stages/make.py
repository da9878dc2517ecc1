"""Runs the stages of a scene of any kind; a record that is in the database is not computed again."""

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from gudgeon.modaldb.keys import content_key, file_digest
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.files import write_text
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.base import SceneJob
from gudgeon.pipeline.stages.folder import PICTURES, claim, remove_pictures
from gudgeon.pipeline.stages.products import Product, combined
from gudgeon.pipeline.stages.run_report import Progress, RunReport, StageReport
from gudgeon.pipeline.stages.status import fresh_pictures, remember
from gudgeon.solver.errors import SceneError
from gudgeon.solver.result import Result


class Task(NamedTuple):
    """A record of a stage, and the function that computes it."""

    product: Product
    make: Callable[[], Any]


Tasks = Callable[[str], Sequence[Task]]
"""Returns the records of one of the stages that make records."""


Draw = Callable[[], tuple[list[Path], list[str]]]
"""Draws the pictures and returns them, with a note for each that could not be drawn."""


def run_stages(
    job: SceneJob, until: str, tell: Progress, tasks: Tasks, finish: Callable[[str], RunReport], draw: Draw
) -> RunReport:
    """Compute the records of a scene that are missing, up to and including the stage `until`.

    Args:
        finish: Writes the result files and returns the report up to that stage.
        draw: Draws the pictures; not called if the run diverged.

    Raises:
        InputError: there is no such stage, or the scene does not fit its mesh.
        StageError: a numerical routine failed.
    """
    if until not in job.stages:
        raise InputError(f"{job.path}: no stage '{until}'; its stages are {', '.join(job.stages)}")
    claim(job)
    wanted = job.stages[: job.stages.index(until) + 1]
    stages = {stage: make_stage(job, stage, tasks, tell) for stage in wanted if stage != "plot"}
    report, pictures, notes = finish(until), [], []
    if report.result is not None:
        remove_pictures(job.out, content_key(job.pictures()))
    if "plot" in wanted and report.result != Result.DIVERGED.name:
        stages["plot"], pictures, notes = plot_stage(job, draw, tell)
    remember(job, wanted)
    return replace(report, stages=stages, pictures=pictures, notes=[*notes, *report.notes])


def make_stage(job: SceneJob, stage: str, tasks: Tasks, tell: Progress) -> StageReport:
    """Compute the records of a stage that are not in the database."""
    start, ran, keys, names = time.perf_counter(), False, [], {}
    for product, make in tasks(stage):
        keys.append(product.key)
        names[product.name] = product.key
        if job.store.has(product.key):
            continue
        tell(stage, 0.0)
        with named(job.path, InputError, StageError, SceneError):
            record = make()
        job.store.put(product.key, product.kind, record, product.inputs)
        ran = True
    tell(stage, 1.0)
    return StageReport("ran" if ran else "fresh", time.perf_counter() - start, combined(keys), names)


def plot_stage(job: SceneJob, draw: Draw, tell: Progress) -> tuple[StageReport, list[str], list[str]]:
    """Draw a job's pictures unless fresh ones are in its folder; return the stage's report, the files and the notes."""
    start, key = time.perf_counter(), content_key(job.pictures())
    if (pictures := fresh_pictures(job, key)) is not None:
        return StageReport("fresh", time.perf_counter() - start, key), pictures, []
    drawn, notes = draw()
    digests = {path.name: file_digest(path) for path in drawn}
    noted = {"key": key, "files": digests, "complete": not notes}
    write_text(job.out / PICTURES, json.dumps(noted, indent=1))
    tell("plot", 1.0)
    return StageReport("ran", time.perf_counter() - start, key), [str(path) for path in drawn], notes
