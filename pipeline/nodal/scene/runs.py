"""Runs of the full-FE run that a report names: kept in the database, with the least time of a few."""

from collections.abc import Callable
from dataclasses import replace

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.nodal import NodalProblem, PointProblem, simulate_nodal
from gudgeon.pipeline.nodal.scene.problem import nodal_problem
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.products import nodal_product

REPEATS, SHORT = 3, 10.0
"""A run that takes `SHORT` [s] or less runs so often; the least time counts, as it does for reduced models."""


def nodal_runs(job: Job, progress: Callable[[str, float], None]) -> list[NodalRecord]:
    """Run the full-FE run at every step the scene names, coarse to fine; finished ones are read back.

    Raises:
        InputError: see `nodal_problem`.
        StageError: see `simulate_nodal`.
    """
    if job.scene.report.full_fe is None:
        return []
    if max(job.scene.report.full_fe.steps) > job.scene.run.duration:
        most, duration = max(job.scene.report.full_fe.steps), job.scene.run.duration
        raise InputError(f"{job.path}: report.full_fe.steps: {most:g} s given, the run lasts {duration:g} s")
    parts = {name: (steps["modes"].inputs, steps["morph"].inputs) for name, steps in job.components().items()}
    problem, runs = None, []
    steps = sorted(job.scene.report.full_fe.steps, reverse=True)
    for number, step in enumerate(steps):
        product = nodal_product(job.name, job.dynamics(), parts, step)
        if not job.store.has(product.key):
            problem = problem or nodal_problem(job)
            stage = f"nodal {step * 1e6:g} µs ({number + 1} of {len(steps)})"
            record = _timed(problem, step, lambda share, stage=stage: progress(stage, share))
            job.store.put(product.key, "nodal", record, product.inputs)
        runs.append(job.store.get(product.key, "nodal"))
    return runs


def _timed(problem: NodalProblem | PointProblem, step: float, progress: Callable[[float], None]) -> NodalRecord:
    record = simulate_nodal(problem, step, progress)
    if record.wall_seconds > SHORT:
        return record
    others = [simulate_nodal(problem, step) for _ in range(REPEATS - 1)]
    cpu, wall = (min(getattr(run, name) for run in (record, *others)) for name in ("cpu_seconds", "wall_seconds"))
    return replace(record, cpu_seconds=cpu, wall_seconds=wall)
