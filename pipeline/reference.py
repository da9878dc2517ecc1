"""Where a report's truth comes from: the nodal synthesis on the same mesh, or an exact pulse."""

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from modaldb.schema import NodalRecord
from pipeline.errors import InputError
from pipeline.filters import hann_filter, resample_mean
from pipeline.nodal import simulate_nodal
from pipeline.nodal_scene import nodal_problem
from pipeline.products import find_file, nodal_product
from pipeline.stages import Job, obstacle_of

GRID = 4000
"""Intervals of the common time grid on which forces are compared."""


@dataclass(frozen=True)
class ForceReference:
    """A force history to compare with, on the common grid."""

    source: str
    grid: np.ndarray
    """Edges of the intervals [s], (GRID + 1,)."""
    force: np.ndarray
    """Mean over each interval, windowed [N], (GRID, 3)."""
    impulse: float
    """[N s]"""
    window: float

    def errors(self, times: np.ndarray, force: np.ndarray) -> tuple[float, float]:
        """Return the signed relative error of the impulse and the relative L2 error of the force.

        Args:
            times: Ends of the intervals [s], (s,); the first starts at 0.
            force: Mean resultant over each [N], (s, 3).
        """
        ours = smooth(times, force, self.grid, self.window)
        means = resample_mean(np.concatenate([[0.0], times]), force, self.grid)
        impulse = float(np.linalg.norm(np.diff(self.grid) @ means))
        return impulse / self.impulse - 1, float(np.linalg.norm(ours - self.force) / np.linalg.norm(self.force))


def smooth(times: np.ndarray, force: np.ndarray, grid: np.ndarray, window: float) -> np.ndarray:
    """Return interval means on `grid`, windowed by a zero-phase Hann window of full width `window` [s], (GRID, 3)."""
    means = resample_mean(np.concatenate([[0.0], times]), force, grid)
    return hann_filter(grid[1:], means, window) if window > 0 else means


def stacked(run: NodalRecord, contacts: Iterable[str]) -> np.ndarray:
    """Return the forces of some contacts of a nodal run side by side [N], (s, 3 k)."""
    return np.column_stack([run.forces[name] for name in contacts])


def reference_of(job: Job, nodal: list[NodalRecord]) -> ForceReference | None:
    """Return the reference force of a scene, or None where it names none."""
    report = job.scene.report
    grid = np.linspace(0.0, report.until or job.scene.run.duration, GRID + 1)
    if nodal:
        finest = nodal[-1]
        edges = np.concatenate([[0.0], finest.times])
        means = resample_mean(edges, stacked(finest, job.scene.contact), grid)
        impulse = float(np.linalg.norm(np.diff(grid) @ means))
        force = smooth(finest.times, stacked(finest, job.scene.contact), grid, report.window)
        return ForceReference(f"nodal synthesis at {finest.step * 1e6:g} µs", grid, force, impulse, report.window)
    if report.pulse is None or report.reference is None:
        return None
    path = find_file(report.reference, job.folder, f"{job.path}: report.reference")
    try:
        expected = json.loads(path.read_text())["expected"]
        height, duration = (float(expected[n]["value"]) for n in (report.pulse.height, report.pulse.duration))
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: not a reference file with the values of report.pulse ({error})") from error
    name, contact = next(iter(job.scene.contact.items()))
    if contact.against.shape not in ("plane", "bore"):
        raise InputError(f"{job.path}: report.pulse: contact '{name}' is against another body, it needs an obstacle")
    against = contact.against.model_dump()
    direction = obstacle_of(against).direction(np.zeros((1, 3)))[0]
    exact = np.outer(np.full(2, height) * [1, 0], direction)
    means = resample_mean(np.array([0.0, duration, max(grid[-1], duration * (1 + 1e-9))]), exact, grid)
    force = hann_filter(grid[1:], means, report.window) if report.window > 0 else means
    return ForceReference(path.name, grid, force, height * duration, report.window)


def nodal_runs(job: Job, progress: Callable[[str, float], None]) -> list[NodalRecord]:
    """Run the nodal synthesis at every step the scene names, coarse to fine; finished ones are read back.

    Raises:
        InputError: see `nodal_problem`.
    """
    if job.scene.report.nodal is None:
        return []
    parts = {name: (steps["modes"].inputs, steps["morph"].inputs) for name, steps in job.components().items()}
    problem, runs = None, []
    steps = sorted(job.scene.report.nodal.steps, reverse=True)
    for number, step in enumerate(steps):
        product = nodal_product(job.name, job.dynamics(), parts, step)
        if not job.store.has(product.key):
            problem = problem or nodal_problem(job)
            stage = f"nodal {step * 1e6:g} µs ({number + 1} of {len(steps)})"
            record = simulate_nodal(problem, step, lambda share, stage=stage: progress(stage, share))
            job.store.put(product.key, "nodal", record, product.inputs)
        runs.append(job.store.get(product.key, "nodal"))
    return runs
