"""Comparison of force histories: error of the impulse, and of the force after the same Hann window on both sides."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.plots.contact.force_window import hann_filter, resample_mean
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.summary import reference_values
from gudgeon.solver.obstacles import obstacle_of

Ran = Trajectory | NodalRecord
GRID = 8000
"""Intervals of the common time grid on which forces are compared."""
AGREE = 0.05
"""Relative difference of forces above which two runs no longer agree."""


@dataclass(frozen=True)
class ForceReference:
    """A reference force history on the common grid."""

    grid: np.ndarray
    """Edges of the intervals [s], (GRID + 1,)."""
    force: np.ndarray
    """Mean over each interval, windowed [N], (GRID, k)."""
    impulse: float
    """[N s]"""
    window: float
    """Full width of the Hann window [s]."""

    def errors(self, times: np.ndarray, force: np.ndarray) -> tuple[float, float]:
        """Return the signed error of the impulse and the L2 error of the force, absolute where their reference is 0.

        Args:
            times: Ends of the intervals [s], (s,); the first starts at 0.
            force: Mean resultants over each [N], (s, k).
        """
        size, ours = float(np.linalg.norm(self.force)), smooth(times, force, self.grid, self.window)
        deviation = float(np.linalg.norm(ours - self.force))
        impulse = _impulse(times, force, self.grid)
        return impulse / self.impulse - 1 if self.impulse else impulse, deviation / size if size else deviation


def contact_forces(run: Ran) -> dict[str, np.ndarray]:
    """Return the mean resultant of each contact of a run over each of its intervals [N], (s, 3)."""
    return (
        run.forces if isinstance(run, NodalRecord) else {name: contact.force for name, contact in run.contacts.items()}
    )


def smooth(times: np.ndarray, force: np.ndarray, grid: np.ndarray, window: float) -> np.ndarray:
    """Return interval means on `grid` after a zero-phase Hann window of full width `window` [s], (g, k)."""
    return hann_filter(grid[1:], resample_mean(np.concatenate([[0.0], times]), force, grid), window)


def history_reference(job: Job, times: np.ndarray, force: np.ndarray, until: float) -> ForceReference:
    """Return the forces of a run up to a time [s] as a reference.

    Args:
        times: Ends of the intervals [s], (s,).
        force: Mean resultants over each [N], (s, k).
    """
    grid, window = np.linspace(0.0, until, GRID + 1), job.scene.report.window
    return ForceReference(grid, smooth(times, force, grid, window), _impulse(times, force, grid), window)


def reproducible(job: Job, runs: Sequence[Ran]) -> float:
    """Return the time up to which the last two of some runs agree to 5 % in force, counted from the start [s]."""
    grid, window = np.linspace(0.0, job.scene.run.duration, GRID + 1), job.scene.report.window
    forces = [
        smooth(run.times, np.column_stack([contact_forces(run)[name] for name in job.scene.contact]), grid, window)
        for run in runs[-2:]
    ]
    difference = np.cumsum(((forces[0] - forces[1]) ** 2).sum(axis=1))
    size = np.cumsum((forces[1] ** 2).sum(axis=1))
    # Forces before the first contact are round-off.
    disagrees = (difference > AGREE**2 * size) & (size > 1e-2 * size[-1])
    return float(grid[1:][int(np.argmax(disagrees))] if disagrees.any() else grid[-1])


def pulse_reference(job: Job) -> ForceReference | None:
    """Return the rectangular pulse of `report.pulse`, or None if the scene has none.

    Raises:
        InputError: the reference file does not have its values, or the contact is not against an obstacle.
    """
    report = job.scene.report
    if report.pulse is None or report.reference is None:
        return None
    pulse = reference_values(report, job.folder, report.pulse.model_dump())
    name, contact = next(iter(job.scene.contact.items()))
    if contact.against.shape not in ("plane", "bore"):
        raise InputError(f"{job.path}: report.pulse: contact '{name}' is against another body; an obstacle is required")
    direction = obstacle_of(contact.against.model_dump()).direction(np.zeros((1, 3)))[0]
    times = np.array([pulse["duration"], max(end_of(job), pulse["duration"] * (1 + 1e-9))])
    return history_reference(job, times, np.outer([pulse["height"], 0.0], direction), end_of(job))


def end_of(job: Job) -> float:
    """Return the time up to which runs are compared [s]."""
    return job.scene.report.until or job.scene.run.duration


def _impulse(times: np.ndarray, force: np.ndarray, grid: np.ndarray) -> float:
    means = resample_mean(np.concatenate([[0.0], times]), force, grid)
    return float(np.linalg.norm(np.diff(grid) @ means))
