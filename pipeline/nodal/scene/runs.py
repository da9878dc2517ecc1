"""Full-FE runs of a report, kept in the database with the least run time of a few repetitions."""

from collections.abc import Callable
from dataclasses import replace

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.nodal.problem import NodalProblem, PointProblem
from gudgeon.pipeline.nodal.scene.problem import nodal_problem
from gudgeon.pipeline.nodal.sliding.loop import simulate_nodal
from gudgeon.pipeline.process.clock import Clock, Seconds
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.keys.products import Product, nodal_product
from gudgeon.pipeline.stages.make import keep_for

REPEATS, SHORT = 3, 10.0
"""A run of `SHORT` [s] or less is repeated so often in all; the least time counts, as for reduced models."""


def nodal_runs(job: Job, progress: Callable[[str, float], None]) -> list[NodalRecord]:
    """Return the full-FE run of every step in `report.full_fe`, coarse to fine; finished runs are read back.

    Raises:
        InputError: see `nodal_problem`.
        StageError: see `simulate_nodal`.
    """
    if job.scene.report.full_fe is None:
        return []
    steps, duration = sorted(job.scene.report.full_fe.steps, reverse=True), job.scene.run.duration
    if steps[0] > duration:
        raise InputError(f"{job.path}: report.full_fe.steps: {steps[0]:g} s given, the run lasts {duration:g} s")
    problem, runs = None, []
    for i, step in enumerate(steps):
        product = _product(job, step)
        if not job.store.has(product.key):
            problem = problem or nodal_problem(job)
            stage = f"full FE {step * 1e6:g} µs ({i + 1} of {len(steps)})"
            record = _timed(problem, step, lambda fraction, stage=stage: progress(stage, fraction))
            keep_for(job, product, record)
        runs.append(job.store.get(product.key, "nodal"))
    return runs


def nodal_key(job: Job, step: float) -> str:
    """Return the key of the full-FE run of a step [s]."""
    return _product(job, step).key


def set_up_seconds(job: Job, step: float) -> tuple[Seconds, Seconds]:
    """Return the time from meshes to the problem, and that of a run of a single step [s]: factors and condensation.

    Raises:
        InputError, StageError: see `nodal_problem` and `simulate_nodal`.
    """
    clock = Clock()
    problem = nodal_problem(job)
    assembly = clock.read()
    run = simulate_nodal(replace(problem, duration=step), step)
    return assembly, Seconds(run.wall_seconds, run.cpu_seconds)


def _product(job: Job, step: float) -> Product:
    inputs = {name: (made["modes"].inputs, made["morph"].inputs) for name, made in job.components().items()}
    return nodal_product(job.name, job.dynamics(), inputs, step)


def _timed(problem: NodalProblem | PointProblem, step: float, progress: Callable[[float], None]) -> NodalRecord:
    record = simulate_nodal(problem, step, progress)
    if record.wall_seconds > SHORT:
        return record
    others = [simulate_nodal(problem, step) for _ in range(REPEATS - 1)]
    cpu, wall = (min(getattr(run, name) for run in (record, *others)) for name in ("cpu_seconds", "wall_seconds"))
    return replace(record, cpu_seconds=cpu, wall_seconds=wall)
