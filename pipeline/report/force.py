"""Comparison of force histories: error of the impulse, and of the force after the same Hann window on both sides."""

from dataclasses import dataclass

import numpy as np

from gudgeon.modaldb.records.nodal import NodalRecord
from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.measuring.force_window import hann_filter, resample_mean
from gudgeon.pipeline.stages.job import Job
from gudgeon.pipeline.stages.summary import reference_values
from gudgeon.solver.obstacles import obstacle_of

Ran = Trajectory | NodalRecord
GRID = 4000
"""Intervals of the common time grid on which forces are compared."""


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
        """Return the signed relative error of the impulse and the relative L2 error of the force.

        Args:
            times: Ends of the intervals [s], (s,); the first starts at 0.
            force: Mean resultants over each [N], (s, k).
        """
        size, ours = float(np.linalg.norm(self.force)), smooth(times, force, self.grid, self.window)
        apart = float(np.linalg.norm(ours - self.force))
        impulse = _impulse(times, force, self.grid)
        if size == 0 or self.impulse == 0:
            return impulse, apart
        return impulse / self.impulse - 1, apart / size


def contact_forces(run: Ran) -> dict[str, np.ndarray]:
    """Return the mean resultant of each contact of a run over each of its intervals [N], (s, 3)."""
    return run.forces if isinstance(run, NodalRecord) else {name: one.force for name, one in run.contacts.items()}


def smooth(times: np.ndarray, force: np.ndarray, grid: np.ndarray, window: float) -> np.ndarray:
    """Return interval means on `grid` after a zero-phase Hann window of full width `window` [s], (g, k)."""
    return hann_filter(grid[1:], resample_mean(np.concatenate([[0.0], times]), force, grid), window)


def history_reference(job: Job, times: np.ndarray, force: np.ndarray) -> ForceReference:
    """Return the forces of a run as a reference.

    Args:
        times: Ends of the intervals [s], (s,).
        force: Mean resultants over each [N], (s, k).
    """
    grid, window = np.linspace(0.0, end_of(job), GRID + 1), job.scene.report.window
    return ForceReference(grid, smooth(times, force, grid, window), _impulse(times, force, grid), window)


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
    return history_reference(job, times, np.outer([pulse["height"], 0.0], direction))


def end_of(job: Job) -> float:
    """Return the time up to which runs are compared [s]."""
    return job.scene.report.until or job.scene.run.duration


def _impulse(times: np.ndarray, force: np.ndarray, grid: np.ndarray) -> float:
    means = resample_mean(np.concatenate([[0.0], times]), force, grid)
    return float(np.linalg.norm(np.diff(grid) @ means))
