"""Timed runs of a report, and its untimed reference runs; both are kept in the database and not repeated.

Timed runs are sequential, after a warm-up run that loads libraries; the least CPU time of the repeats counts. Reference
runs are not timed and may be parallel.
"""

import contextlib
import hashlib
import math
import multiprocessing
import tempfile
from collections.abc import Callable, Mapping, Sequence
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
from gudgeon.pipeline.process.clock import Clock, Seconds
from gudgeon.pipeline.process.machine import machine
from gudgeon.pipeline.process.memory import peak_memory
from gudgeon.pipeline.report.document import StageSeconds
from gudgeon.pipeline.scenes.reading import named
from gudgeon.pipeline.stages.bodies import system_of
from gudgeon.pipeline.stages.job import Job, variant
from gudgeon.pipeline.stages.keys.products import STAGES, combined, product
from gudgeon.pipeline.stages.make import keep_for
from gudgeon.pipeline.stages.run import run_job
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.simulate import simulate
from gudgeon.solver.system.system import System

WARM_UP = 5.0
"""CPU time of the warm-up run, which loads libraries [s]."""
LONG = 60.0
"""Wall time of the repeats after which a run is not repeated again [s]."""
Parts = dict[str, Seconds]


@dataclass(frozen=True)
class Timed:
    """A run, with the time and memory of its solution."""

    trajectory: Trajectory
    coordinates: int
    cpu: float
    wall: float
    stages: dict[str, StageSeconds]
    peak_mib: float
    factorisations: int
    """Of the bases of the run."""


@dataclass(frozen=True)
class Prepared:
    """Times, factorisations and memory of mesh, modes and design."""

    stages: dict[str, StageSeconds]
    factorisations: int
    peak_mib: float


def compiled(job: Job) -> System:
    """Return the compiled system of a job; missing records are computed.

    Raises:
        InputError, StageError, SceneError, SolverError: see `run_job` and `compile_system`.
    """
    with named(job.path, InputError, SceneError):
        run_job(job, "morph")
        return system_of(job)


def kept_trajectory(job: Job) -> Trajectory | None:
    """Return the run of a job if it is in the database."""
    key = job.trajectory().key
    return job.store.get(key, "trajectory") if job.store.has(key) else None


def timed(job: Job, repeat: int, limit: float = math.inf) -> Timed:
    """Return a job's run and its times, from the database if both are there.

    Args:
        repeat: Runs after the warm-up run; the least CPU time counts.
        limit: CPU time after which a run is stopped [s].

    Raises:
        StageError: the run exceeded the limit.
    """
    solved = job.trajectory()
    how = {"machine": machine(), "code": _code(), "repeat": repeat}
    measured = product("measurement", job.name, {"of": solved.key, "how": how})
    before = prepared(job)
    if not (job.store.has(measured.key) and job.store.has(solved.key)):
        trajectory, record = _measure(job, repeat, limit)
        keep_for(job, solved, trajectory)
        keep_for(job, measured, record)
    trajectory, record = job.store.get(solved.key, "trajectory"), job.store.get(measured.key, "measurement")
    fastest, cold, again = (record.seconds[name] for name in ("integration", "cold", "warm"))
    stages = before.stages | {"solve": StageSeconds(Seconds(**cold), Seconds(**again))}
    return Timed(
        trajectory, trajectory.counts["coordinates"], fastest["cpu"], fastest["wall"],
        stages=stages, peak_mib=record.peak_mib, factorisations=before.factorisations,
    )  # fmt: skip


def spread(
    job: Job, changes: Sequence[dict[str, Any]], jobs: int, limit: float, progress: Callable[[float], None]
) -> None:
    """Compute untimed runs of some variants, on several processes; runs that fail are omitted.

    Args:
        changes: Changes of the scene, as nested tables.
        jobs: Number of processes.
        limit: CPU time after which a run is stopped [s].
    """
    missing = [item for item in changes if not job.store.has(variant(job, item).trajectory().key)]
    if jobs < 2 or len(missing) < 2:
        for i, item in enumerate(missing):
            progress(i / len(missing))
            _make(job, item, limit)
        return
    with ProcessPoolExecutor(min(jobs, len(missing)), multiprocessing.get_context("spawn")) as pool:
        try:
            for i, _ in enumerate(pool.map(_make, [job] * len(missing), missing, [limit] * len(missing))):
                progress((i + 1) / len(missing))
        except KeyboardInterrupt:
            # Only Ctrl-C reaches them by itself, and the pool waits for their runs.
            for child in multiprocessing.active_children():
                child.terminate()
            raise


def made(job: Job, limit: float) -> Trajectory:
    """Return the untimed run of a job, from the database if it is there.

    Args:
        limit: CPU time after which it is stopped [s].

    Raises:
        StageError: the run exceeded the limit.
        InputError, SceneError, SolverError: see `compiled`.
    """
    solved = job.trajectory()
    if not job.store.has(solved.key):
        keep_for(job, solved, simulate(compiled(job), _guard(limit)))
    return job.store.get(solved.key, "trajectory")


def _make(job: Job, changes: dict[str, Any], limit: float) -> None:
    with contextlib.suppress(InputError, StageError, SceneError, SolverError):
        made(variant(job, changes), limit)


def _measure(job: Job, repeat: int, limit: float) -> tuple[Trajectory, MeasurementRecord]:
    with contextlib.suppress(StageError):
        simulate(compiled(job), _guard(WARM_UP))
    begun, seconds_of, trajectory = Clock(), [], None
    with peak_memory() as peak:
        for i in range(repeat):
            total = Clock()
            system = compiled(job)
            integration = Clock()
            trajectory = simulate(system, _guard(limit))
            seconds_of.append({"integration": integration.read(), "whole": total.read()})
            if i and begun.read().wall > LONG:
                break
    assert trajectory is not None
    fastest = _least(seconds_of)
    seconds = {"integration": fastest["integration"], "cold": seconds_of[0]["whole"], "warm": fastest["whole"]}
    return trajectory, MeasurementRecord(_plain(seconds), peak.mib, {}, machine())


def _least(clocked: Sequence[Parts]) -> Parts:
    """Return the time of each part in the run with its least CPU time."""
    return {name: min((seconds[name] for seconds in clocked), key=lambda taken: taken.cpu) for name in clocked[0]}


def _plain(seconds: Parts) -> dict[str, dict[str, float]]:
    return {name: asdict(taken) for name, taken in seconds.items()}


def _guard(limit: float) -> Callable[[float], None]:
    """Return the progress callback that stops a run after some CPU time [s]."""
    clock = Clock()

    def watch(fraction: float) -> None:
        if clock.read().cpu > limit:
            raise StageError(f"stopped at {fraction:.0%} of the duration: CPU time above the limit of {limit:.0f} s")

    return watch


def prepared(job: Job, repeat: int = 1) -> Prepared:
    """Return the times of mesh, modes and design, from the database if they are there; the records are stored as well.

    Args:
        repeat: Runs with an empty database; the least CPU time of each stage counts.

    Raises:
        InputError, StageError: see `run_job`.
    """
    keys = [step.key for steps in job.components().values() for step in steps.values()]
    how = {"repeat": repeat} if repeat > 1 else {}
    record = measurement(job, combined(sorted(set(keys))), how, lambda: _prepare(job, repeat))
    stages = {
        stage: StageSeconds(Seconds(**record.seconds[f"{stage} cold"]), Seconds(**record.seconds[f"{stage} warm"]))
        for stage in STAGES[:3]
    }
    return Prepared(stages, record.counts["factorisations"], record.peak_mib)


def measurement(
    job: Job, of: str, how: Mapping[str, Any], measure: Callable[[], MeasurementRecord]
) -> MeasurementRecord:
    """Return a measurement of this machine, from the database or made now.

    Args:
        of: Key of what is measured.
        how: What else the measurement depends on.
    """
    measured = product("measurement", job.name, {"of": of, "how": {"machine": machine(), **how}})
    if not job.store.has(measured.key):
        keep_for(job, measured, measure())
    return job.store.get(measured.key, "measurement")


def _prepare(job: Job, repeat: int) -> MeasurementRecord:
    """Run the stages before the solver with an empty database, and again with all records present."""
    measured: list[Parts] = []
    counts = {}
    with peak_memory() as peak:
        for i in range(repeat):
            seconds: Parts = {}
            with tempfile.TemporaryDirectory() as folder:
                empty = replace(job, store=modaldb.open(Path(folder) / "db"), out=Path(folder) / "out")
                before = COUNTS["factorisations"]
                for state in ("cold", "warm"):
                    for stage in STAGES[:3]:
                        clock = Clock()
                        with named(job.path, InputError):
                            run_job(empty, stage)
                        seconds[f"{stage} {state}"] = clock.read()
                counts = {"factorisations": COUNTS["factorisations"] - before}
                if i == 0:
                    _keep(empty, job)
            measured.append(seconds)
    return MeasurementRecord(_plain(_least(measured)), peak.mib, counts, machine())


def _keep(made: Job, job: Job) -> None:
    """Store the records of a measurement in the database of the job."""
    for steps in made.components().values():
        for step in steps.values():
            if not job.store.has(step.key):
                keep_for(job, step, made.store.get(step.key, step.kind))


@cache
def _code() -> str:
    """Return a digest of the solver's code: its times may change where its results do not."""
    digest = hashlib.sha256()
    for path in sorted(Path(solver.__file__).parent.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()
