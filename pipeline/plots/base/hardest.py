"""The one moment that all pictures show of a contact: the sample of its largest mean force, the state at its end; and
the one size of its largest force, the quantity `force_peak`, as it is printed."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory

SAME = 1e-6
"""Difference of two times, in sample intervals, that is round-off."""


@dataclass(frozen=True)
class Hardest:
    """The largest force of some contacts."""

    contact: str
    frame: int
    """Number of the frame of that state."""
    time: float
    """[s]"""
    force: float
    """The quantity `force_peak` [N]; of a contact without it the force of the frame."""


def with_peaks(trajectory: Trajectory) -> Trajectory:
    """Return a trajectory whose frames include, in order of time, the states kept at the largest forces."""
    times, contacts = trajectory.peak_times, trajectory.contacts
    if times is None or trajectory.peak_frames is None or trajectory.peak_velocities is None or not len(times):
        return trajectory
    distances = np.abs(times[:, None] - trajectory.frame_times)
    new = np.flatnonzero(distances.min(axis=1, initial=np.inf) > SAME * trajectory.times[0])
    new = new[np.unique(times[new], return_index=True)[1]]
    order = np.argsort(np.append(trajectory.frame_times, times[new]), kind="stable")

    def joined(frames: np.ndarray, peaks: np.ndarray | None) -> np.ndarray:
        assert peaks is not None
        return np.concatenate([frames, peaks[new]])[order]

    return replace(
        trajectory,
        frame_times=joined(trajectory.frame_times, times),
        frames=joined(trajectory.frames, trajectory.peak_frames),
        velocities=joined(trajectory.velocities, trajectory.peak_velocities),
        contacts={
            name: replace(
                contact,
                multipliers=joined(contact.multipliers, contact.peak_multipliers),
                master=None if contact.master is None else joined(contact.master, contact.peak_master),
                friction=None if contact.friction is None else joined(contact.friction, contact.peak_friction),
            )
            for name, contact in contacts.items()
        },
    )


def hardest(trajectory: Trajectory, names: Iterable[str]) -> Hardest | None:
    """Return the largest force of some contacts; None if no frame shows any of them closed.

    Args:
        trajectory: With the peaks among its frames, see `with_peaks`.
    """
    strongest = [moment for name in names if (moment := _of_contact(trajectory, name)) is not None]
    return max(strongest, key=lambda moment: moment.force, default=None)


def _of_contact(trajectory: Trajectory, name: str) -> Hardest | None:
    contact = trajectory.contacts[name]
    if not contact.multipliers.any():
        return None
    if trajectory.peak_times is not None and name in trajectory.peaks:
        time = float(trajectory.peak_times[trajectory.peaks[name]])
        frame = int(np.abs(trajectory.frame_times - time).argmin())
        frame, time = _within_window(trajectory, name, frame, time)
        if contact.multipliers[frame].any():
            return Hardest(name, frame, time, peak_force(trajectory, name))
    # A record without kept states, or an impact within one sample.
    frame = int(contact.multipliers.sum(axis=1).argmax())
    force = float(contact.multipliers[frame].sum())
    if f"{name}.force_peak" in trajectory.quantities:
        force = peak_force(trajectory, name)
    return Hardest(name, frame, float(trajectory.frame_times[frame]), force)


def _within_window(trajectory: Trajectory, name: str, frame: int, time: float) -> tuple[int, float]:
    """Return a frame and its time [s], or the closed frame nearest to `peak_time` where it is out of its window: a
    single sample may reach highest elsewhere, as at a front."""
    quantities = trajectory.quantities
    when, window = (quantities.get(f"{name}.{key}") for key in ("peak_time", "force_window"))
    closed = np.flatnonzero(trajectory.contacts[name].multipliers.any(axis=1))
    if when is None or window is None or abs(time - when["value"]) <= window["value"]:
        return frame, time
    nearest = int(closed[np.abs(trajectory.frame_times[closed] - when["value"]).argmin()])
    return nearest, float(trajectory.frame_times[nearest])


def peak_force(trajectory: Trajectory, name: str) -> float:
    """Return the largest force of a contact [N]: `force_peak`, or without it the largest mean over a sample."""
    quantity = trajectory.quantities.get(f"{name}.force_peak")
    return quantity["value"] if quantity else float(np.linalg.norm(trajectory.contacts[name].force, axis=1).max())
