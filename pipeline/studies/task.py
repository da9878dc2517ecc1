"""One design of a study, computed by a process that stays: opened, solved and read within some ten milliseconds beside
what must be computed.

A task is text: scene, changes and where the database is. It carries no arrays, and what it computes goes into the
database under its keys, so that a task that is done twice, or on another machine, is found there.
"""

import json
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from gudgeon import modaldb
from gudgeon.modaldb.errors import ModalDBError, RecordNotWritten, StoreUnusable
from gudgeon.modaldb.keys import content_key
from gudgeon.pipeline.errors import InputError, PipelineError
from gudgeon.pipeline.kinds import job_at
from gudgeon.pipeline.scenes.reading import merged, nested
from gudgeon.pipeline.stages.base import SceneJob
from gudgeon.pipeline.stages.change import largest_changes
from gudgeon.pipeline.stages.keys.products import made_by
from gudgeon.pipeline.stages.run import SOLVE, solve_records
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.result import Result

REFUSED, FAILED, LOST, MISSING = "REFUSED", "FAILED", "LOST", "MISSING"
"""Results of designs without a run: the input is wrong, a stage failed, the worker ended, the study ended before."""
SHAPED = ("mesh", "modes", "morph", "solve", "cyclic", "wheel")
"""Stages that make records of scenes of any kind, with the last two those of wheels."""
ONE_AT_A_TIME = threading.Lock()
"""Held while a task is computed: an executor of threads takes turns, since the mesher has one state for a process."""


@dataclass(frozen=True)
class Source:
    """A scene that designs change, as text."""

    name: str
    path: str
    """Of the scene's file; its folder has the files that the scene names."""
    tables: str
    """The scene's tables, as JSON."""
    db: str
    made_by: str
    """Key of sources, schema and libraries: workers must have the same, or what they compute has other keys."""

    def job(self, changes: Sequence[tuple[str, Any]]) -> SceneJob:
        """Return the job of a design; raises InputError as `kinds.open_job` does."""
        tables, store = _resident(self)
        for path, value in changes:
            tables = merged(tables, nested(path.split("."), value))
        return job_at(self.name, Path(self.path), tables, store, Path())


@lru_cache(maxsize=4)
def _resident(source: Source) -> tuple[dict[str, Any], Any]:
    """Return the tables of a scene and its open database, once for a process."""
    return json.loads(source.tables), modaldb.open(source.db)


@cache
def version_key() -> str:
    """Return the key of the sources, the schema and the libraries that shape records."""
    return content_key({stage: made_by(stage) for stage in SHAPED})


@dataclass(frozen=True)
class Task:
    """What a worker does: the records of one design that are missing, up to and including a stage."""

    source: Source
    design: int
    changes: str
    """Pairs of path and value, as JSON."""
    stages: tuple[str, ...]
    """Of its kind of scene, up to the last one that is made."""


@dataclass(frozen=True)
class Row:
    """What a design gave."""

    design: int
    result: str
    """A name of `solver.Result`, `REFUSED`, `FAILED`, `LOST` or `MISSING`."""
    reason: str = ""
    key: str = ""
    """Of its run in the database."""
    fresh: bool = False
    """Whether its run was in the database."""
    quantities: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Name → value and unit."""
    errors: dict[str, float] = field(default_factory=dict)
    """Estimated relative errors by name, such as `step.impulse`, and changes that reused modes neglect."""
    energy_drift: float | None = None
    momentum_residual: float | None = None
    notes: tuple[str, ...] = ()
    cpu: tuple[float, float] = (0.0, 0.0)
    """CPU seconds of the task, and of its computations alone, without opening, reading and writing."""


def solve_design(task: Task) -> Row:
    """Compute what a design lacks and return its quantities, or why it has none.

    Raises:
        StoreUnusable, RecordNotWritten: nothing can be kept in the database.
    """
    with ONE_AT_A_TIME:
        return _solved(task)


def _solved(task: Task) -> Row:
    start, own_version = time.process_time(), version_key()
    if own_version != task.source.made_by:
        text = "this worker has other sources of gudgeon, or other versions of its libraries, than the study"
        return Row(task.design, LOST, text)
    try:
        job = task.source.job(json.loads(task.changes))
        report = solve_records(job, task.stages[-1])
    except (StoreUnusable, RecordNotWritten):
        raise
    except (InputError, SceneError) as error:
        return Row(task.design, REFUSED, _one_line(error, task))
    except (PipelineError, SolverError, ModalDBError) as error:
        return Row(task.design, FAILED, _one_line(error, task))
    except MemoryError:
        return Row(task.design, FAILED, "not enough memory")
    except Exception as error:
        # One design's fault in the program must not end the others.
        return Row(task.design, FAILED, f"unexpected: {type(error).__name__}: {_one_line(error, task)}")
    computing = sum(stage.cpu for stage in report.stages.values())
    if task.stages[-1] != SOLVE:
        return Row(task.design, Result.FINISHED.name)
    row = Row(
        task.design, report.result or "", report.reason or "", report.stages[SOLVE].key,
        fresh=report.stages[SOLVE].state == "fresh", quantities=report.quantities,
        errors=report.estimates | _changes(report.changes), energy_drift=report.energy_drift,
        momentum_residual=report.momentum_residual, notes=tuple(report.notes),
    )  # fmt: skip
    return replace(row, cpu=(time.process_time() - start, computing))


def _changes(changes: dict[str, dict[str, Any]]) -> dict[str, float]:
    """Return the largest estimated change of frequencies and of compliance of each component that reuses modes."""
    changes_of_modes = {}
    for name, entry in changes.items():
        for words, value in largest_changes(entry).items():
            changes_of_modes[f"reuse.{name}.{words.split()[0]}"] = abs(value)
    return changes_of_modes


def _one_line(error: Exception, task: Task) -> str:
    lines = [line.removeprefix(f"{task.source.path}: ") for line in str(error).splitlines()]
    return "; ".join(line for line in lines if line)
