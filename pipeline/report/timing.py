"""Runs of a report and what they take: kept in the database, so that what is done is not done again. Starts the solver.

A timed run stands alone: no other run of the report goes beside it, libraries are loaded and loops compiled before, and
the least of its repeats counts. Runs that serve as references only are not timed and may go side by side.
"""

import contextlib
import hashlib
import math
import multiprocessing
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from gudgeon import modaldb, solver
from gudgeon.modaldb.records.report import MeasurementRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.linalg.counter import COUNTS
from gudgeon.pipeline.measuring.clock import Clock, Seconds
from gudgeon.pipeline.measuring.machine import machine
from gudgeon.pipeline.measuring.memory import peak_memory
from gudgeon.pipeline.report.document import StageSeconds
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.job import Job, variant
from gudgeon.pipeline.stages.products import STAGES, combined, measurement_product
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.compile import compile_system
from gudgeon.solver.system.system import System

WARM_UP = 5.0
"""CPU seconds of the run itself before it is timed: all that it needs is then loaded and compiled."""
LONG = 60.0
"""Seconds after which a run is repeated no more, though it is to run more often."""
Parts = dict[str, Seconds]


@dataclass(frozen=True)
class Timed:
    """A run with what it took."""

    trajectory: Trajectory
    coordinates: int
    cpu: float
    wall: float
    stages: dict[str, StageSeconds]
    peak_mib: float
    factorisations: int
    """Of the bases it stands on."""


@dataclass(frozen=True)
class Prepared:
    """What comes before the solver: mesh, modes, design."""

    stages: dict[str, StageSeconds]
    factorisations: int
    peak_mib: float


def compiled(job: Job) -> System:
    """Return a job's system; its records are made where they are missing.

    Raises:
        InputError, StageError, SceneError, SolverError: see `run_job` and `compile_system`.
    """
    with named(job.path, InputError, SceneError):
        run_job(job, "morph")
        morphs = {name: steps["morph"].key for name, steps in job.components().items()}
        return compile_system(job.store, job.scene, morphs)


def kept_trajectory(job: Job) -> Trajectory | None:
    """Return a job's run where it is in the database."""
    return job.store.get(job.trajectory().key, "trajectory") if _has(job) else None


def timed(job: Job, repeat: int, limit: float = math.inf) -> Timed:
    """Return a job's run and what it takes, read back where both are in the database.

    Args:
        repeat: Runs after one that loads and compiles, cut short where it is long; the least time counts.
        limit: CPU seconds after which a run is given up.

    Raises:
        StageError: it took longer than the limit.
    """
    product = job.trajectory()
    measured = measurement_product(job.name, product.key, _how(repeat))
    before = prepared(job)
    stages, factorisations = before.stages, before.factorisations
    if not (job.store.has(measured.key) and job.store.has(product.key)):
        trajectory, record = _measure(job, repeat, limit)
        job.store.put(product.key, product.kind, trajectory, product.inputs)
        job.store.put(measured.key, measured.kind, record, measured.inputs)
    trajectory, record = job.store.get(product.key, "trajectory"), job.store.get(measured.key, "measurement")
    least, first, again = (record.seconds[name] for name in ("integration", "cold", "warm"))
    stages["solve"] = StageSeconds(Seconds(**first), Seconds(**again))
    counts = trajectory.counts
    return Timed(
        trajectory, counts["coordinates"], least["cpu"], least["wall"], stages, record.peak_mib, factorisations
    )  # fmt: skip


def spread(
    job: Job, changes: Sequence[dict[str, Any]], jobs: int, limit: float, progress: Callable[[float], None]
) -> None:
    """Make the trajectories of some variants that are not timed, on several processes; what fails is left out.

    Args:
        changes: Of the scene, as nested tables.
        jobs: Processes.
        limit: CPU seconds after which a run is given up.
    """
    missing = [item for item in changes if not _has(variant(job, item))]
    if jobs < 2 or len(missing) < 2:
        for number, item in enumerate(missing):
            progress(number / len(missing))
            _make(job, item, limit)
        return
    with ProcessPoolExecutor(min(jobs, len(missing)), multiprocessing.get_context("spawn")) as pool:
        for number, _ in enumerate(pool.map(_make, [job] * len(missing), missing, [limit] * len(missing))):
            progress((number + 1) / len(missing))


def _has(job: Job) -> bool:
    return job.store.has(job.trajectory().key)


def _make(job: Job, changes: dict[str, Any], limit: float) -> None:
    changed = variant(job, changes)
    product = changed.trajectory()
    with contextlib.suppress(InputError, StageError, SceneError, SolverError):
        job.store.put(product.key, product.kind, simulate(compiled(changed), _guard(limit)), product.inputs)


def _measure(job: Job, repeat: int, limit: float) -> tuple[Trajectory, MeasurementRecord]:
    with contextlib.suppress(StageError):
        simulate(compiled(job), _guard(WARM_UP))
    begun, parts, trajectory = Clock(), [], None
    with peak_memory() as peak:
        for number in range(repeat):
            whole = Clock()
            system = compiled(job)
            integration = Clock()
            trajectory = simulate(system, _guard(limit))
            parts.append({"integration": integration.read(), "whole": whole.read()})
            if number and begun.read().wall > LONG:
                break
    assert trajectory is not None
    least = _least(parts)
    seconds = {"integration": least["integration"], "cold": parts[0]["whole"], "warm": least["whole"]}
    return trajectory, MeasurementRecord(_plain(seconds), peak.mib, {}, machine())


def _least(parts: Sequence[Parts]) -> Parts:
    """Return the least time of each part."""
    return {name: min((one[name] for one in parts), key=lambda taken: taken.cpu) for name in parts[0]}


def _plain(parts: Parts) -> dict[str, dict[str, float]]:
    return {name: asdict(taken) for name, taken in parts.items()}


def _guard(limit: float) -> Callable[[float], None]:
    """Return what ends a run after some CPU seconds."""
    clock = Clock()

    def watch(share: float) -> None:
        if clock.read().cpu > limit:
            raise StageError(f"given up at {share:.0%} after {limit:.0f} CPU s")

    return watch


def prepared(job: Job, repeat: int = 1) -> Prepared:
    """Return what mesh, modes and design take, read back where that is in the database; what they make is kept too.

    Args:
        repeat: Runs in an empty database; the least time of each stage counts.

    Raises:
        InputError, StageError: see `run_job`.
    """
    keys = [step.key for steps in job.components().values() for step in steps.values()]
    how = {"machine": machine()} | ({"repeat": repeat} if repeat > 1 else {})
    product = measurement_product(job.name, combined(sorted(set(keys))), how)
    if not job.store.has(product.key):
        job.store.put(product.key, product.kind, _prepare(job, repeat), product.inputs)
    found = job.store.get(product.key, "measurement")
    stages = {
        stage: StageSeconds(Seconds(**found.seconds[f"{stage} cold"]), Seconds(**found.seconds[f"{stage} warm"]))
        for stage in STAGES[:3]
    }
    return Prepared(stages, found.counts["factorisations"], found.peak_mib)


def _prepare(job: Job, repeat: int) -> MeasurementRecord:
    """Run the stages before the solver in empty databases, and again with all at hand."""
    found: list[Parts] = []
    counts = {}
    with peak_memory() as peak:
        for number in range(repeat):
            seconds: Parts = {}
            with tempfile.TemporaryDirectory() as folder:
                empty = replace(job, store=modaldb.open(Path(folder) / "db"), out=Path(folder) / "out")
                before = COUNTS.factorisations
                for state in ("cold", "warm"):
                    for stage in STAGES[:3]:
                        clock = Clock()
                        with named(job.path, InputError):
                            run_job(empty, stage)
                        seconds[f"{stage} {state}"] = clock.read()
                counts = {"factorisations": COUNTS.factorisations - before}
                if number == 0:
                    _keep(empty, job)
            found.append(seconds)
    return MeasurementRecord(_plain(_least(found)), peak.mib, counts, machine())


def _keep(made: Job, job: Job) -> None:
    """Put what was made for a measurement into the database too."""
    for steps in made.components().values():
        for step in steps.values():
            if not job.store.has(step.key):
                job.store.put(step.key, step.kind, made.store.get(step.key, step.kind), step.inputs)


def _how(repeat: int) -> dict[str, Any]:
    return {"machine": machine(), "code": _code(), "repeat": repeat}


@cache
def _code() -> str:
    """Return a digest of the code that is timed: what it takes may change where what it makes does not."""
    digest = hashlib.sha256()
    for path in sorted(Path(solver.__file__).parent.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()
