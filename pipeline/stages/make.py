"""Runs the stages of a scene of any kind; a record that is in the database is not computed again.

`keep` is the gate through which every product enters the database: no NaN and no infinity leaves a stage.
"""

import logging
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gudgeon.modaldb.keys import content_key, file_digest
from gudgeon.modaldb.stores.base import Store
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.files import write_sealed
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.base import SceneJob
from gudgeon.pipeline.stages.folder import PICTURES, claim, held, remove_pictures
from gudgeon.pipeline.stages.keys.products import Product, combined
from gudgeon.pipeline.stages.run_report import Progress, RunReport, StageReport
from gudgeon.pipeline.stages.status import fresh_pictures, remember
from gudgeon.solver.errors import SceneError
from gudgeon.solver.result import Result

log = logging.getLogger(__name__)

UNKNOWN = ("impacts", "discretisation_errors", "probes", "potentials")
"""Fields in which NaN stands for what is unknown, by docs/format.md."""


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
    wanted = _wanted(job, until)
    waits = partial(tell, f"waiting for another run in {job.out}", 0.0)
    with held(job.out, waits):
        claim(job)
    stages = make_stages(job, until, tell, tasks)
    with held(job.out, waits):
        claim(job)
        report, pictures, notes = finish(until), [], []
        if report.result is not None:
            removed = remove_pictures(job.out, content_key(job.pictures()))
            if removed and "plot" not in wanted:
                notes = [f"pictures of an earlier result were removed: {', '.join(removed)}"]
        if "plot" in wanted and report.result != Result.DIVERGED.name:
            stages["plot"], pictures, notes = plot_stage(job, draw, tell)
        remember(job, wanted)
    return replace(report, stages=stages, pictures=pictures, notes=[*notes, *report.notes])


def make_stages(job: SceneJob, until: str, tell: Progress, tasks: Tasks) -> dict[str, StageReport]:
    """Compute the records of a scene that are missing, up to and including the stage `until`; write nothing else.

    Raises:
        InputError, StageError: see `run_stages`.
    """
    return {stage: make_stage(job, stage, tasks, tell) for stage in _wanted(job, until) if stage != "plot"}


def _wanted(job: SceneJob, until: str) -> tuple[str, ...]:
    if until not in job.stages:
        raise InputError(f"{job.path}: no stage '{until}'; its stages are {', '.join(job.stages)}")
    return job.stages[: job.stages.index(until) + 1]


def make_stage(job: SceneJob, stage: str, tasks: Tasks, tell: Progress) -> StageReport:
    """Compute the records of a stage that are not in the database."""
    start, ran, keys, names, cpu = time.perf_counter(), False, [], {}, 0.0
    scene = scene_name(job)
    for product, make in tasks(stage):
        keys.append(product.key)
        names[product.name] = product.key
        if job.store.has(product.key):
            job.store.note(product.key, scene, product.name)
            log.info("%s of '%s': fresh, record %s", stage, product.name, product.key[:12])
            continue
        tell(stage, 0.0)
        before = time.process_time()
        with named(job.path, InputError, StageError, SceneError):
            record = make()
        taken = time.process_time() - before
        cpu += taken
        log.info("%s of '%s': computed in %.2f s of CPU time, record %s", stage, product.name, taken, product.key[:12])
        keep(job.store, product, record)
        job.store.note(product.key, scene, product.name)
        ran = True
    tell(stage, 1.0)
    return StageReport("ran" if ran else "fresh", time.perf_counter() - start, combined(keys), names, cpu)


def plot_stage(job: SceneJob, draw: Draw, tell: Progress) -> tuple[StageReport, list[str], list[str]]:
    """Draw a job's pictures unless fresh ones are in its folder; return the stage's report, the files and the notes."""
    start, key = time.perf_counter(), content_key(job.pictures())
    if (pictures := fresh_pictures(job, key)) is not None:
        return StageReport("fresh", time.perf_counter() - start, key), pictures, []
    drawn, notes = draw()
    digests = {path.name: file_digest(path) for path in drawn}
    write_sealed(job.out / PICTURES, {"key": key, "files": digests, "complete": not notes})
    tell("plot", 1.0)
    return StageReport("ran", time.perf_counter() - start, key), [str(path) for path in drawn], notes


def scene_name(job: SceneJob) -> str:
    """Return folder and file of a scene, such as `piston/stroke`; of `scene.toml` the folder alone."""
    folder = job.path.resolve().parent.name
    return folder if job.path.name == "scene.toml" else f"{folder}/{job.path.stem}"


def keep(store: Store, product: Product, record: Any) -> None:
    """Write a record of a stage into the database; see `check_finite`."""
    check_finite(product, record)
    store.put(product.key, product.kind, record, product.inputs)


def check_finite(product: Product, record: Any) -> None:
    """Raise StageError where a number of a record is not finite."""
    if (field := next(not_finite(record), None)) is not None:
        raise StageError(
            f"{product.stage} of '{product.name}': {field} is not finite; numbers of the scene are too large, too"
            " small or too different in size for its model"
        )


def not_finite(value: Any, where: str = "") -> Iterator[str]:
    """Yield the fields of a record that hold a NaN or an infinity, as paths such as `contacts/wall/force`."""
    if isinstance(value, float | complex | np.number):
        if not (math.isfinite(value.real) and math.isfinite(value.imag)):
            yield where
    elif isinstance(value, np.ndarray):
        wrong = np.isinf if where.partition("/")[0] in UNKNOWN else _unsound
        if value.dtype.kind in "fc" and not _squares_finite(value) and wrong(value).any():
            yield where
    elif is_dataclass(value):
        for one in fields(value):
            yield from not_finite(getattr(value, one.name), f"{where}/{one.name}".lstrip("/"))
    elif isinstance(value, Mapping):
        for name, one in value.items():
            yield from not_finite(one, f"{where}/{name}".lstrip("/"))
    elif isinstance(value, list | tuple):
        for number, one in enumerate(value):
            yield from not_finite(one, f"{where}/{number}".lstrip("/"))


def _squares_finite(values: np.ndarray) -> bool:
    """Whether all numbers are finite, several times cheaper than a look at each; False where one's square is not."""
    if values.dtype.kind == "c":
        return False
    flat = values.reshape(-1)
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.isfinite(np.dot(flat, flat)))


def _unsound(values: np.ndarray) -> np.ndarray:
    return ~np.isfinite(values)
