"""Quantities of a full-FE run, named and defined as the solver's, from mean forces of steps and gaps at their ends."""

from dataclasses import dataclass

import numpy as np

from gudgeon.modaldb.records.types import Json
from gudgeon.pipeline.nodal.problem import NodalLoad, PointContact
from gudgeon.solver.results.contact_events import (
    Quantity,
    deflection,
    departure,
    impact_quantities,
    merged,
    named,
    rebound,
    smoothed_peak,
)


@dataclass(frozen=True)
class History:
    """Forces and gaps of contact points. s: steps, c: points."""

    times: np.ndarray
    """Start and ends of the steps [s], (s + 1,)."""
    forces: np.ndarray
    """Mean over each step [N], (s, c)."""
    gaps: np.ndarray
    """At the start and the ends of the steps [m], (s + 1, c)."""
    rates: np.ndarray
    """Of the gaps at the start [m/s], (c,)."""

    def of(self, rows: slice) -> "History":
        """Return the history of some points."""
        return History(self.times, self.forces[:, rows], self.gaps[:, rows], self.rates[rows])


def resolved(times: np.ndarray) -> float:
    """Return the shortest period that the steps resolve throughout the run [s].

    The midpoint rule lags by ω³h²T/12 in phase after a time T; a period with a lag above one radian is not resolved.
    """
    step, duration = float(times[1] - times[0]), float(times[-1] - times[0])
    return 2 * np.pi * (step**2 * duration / 12) ** (1 / 3)


def located(history: History, rigid: bool) -> np.ndarray:
    """Return the impacts of a contact as in `Trajectory.impacts`, (b, 7), by the gap of its nearest point.

    With a law an impact begins and ends where the gap, linear in the step, passes zero. A rigid contact closes where
    the gap, extrapolated from the step before, passes zero, and ends with its last step under force.
    """
    times, force, gap = history.times, history.forces.sum(axis=1), history.gaps.min(axis=1)
    h, pressed = float(times[1] - times[0]), np.concatenate([[0], force > 0, [0]]).astype(np.int8)
    firsts, ends = np.flatnonzero(np.diff(pressed) == 1), np.flatnonzero(np.diff(pressed) == -1)
    # Closing speed in each step; before the first step the speed at the start.
    speeds = np.concatenate([[-history.rates.min()], -np.diff(gap) / h, [0.0]])
    impacts = np.zeros((len(firsts), 7))
    for impact, first, end in zip(impacts, firsts, ends, strict=True):
        last = end - 1
        closing = speeds[first] if rigid else speeds[first + 1]
        opening = -speeds[end + 1] if rigid else -speeds[end]
        most = first + int(force[first:end].argmax())
        late = gap[first] / closing if gap[first] > 0 and closing > 0 else 0.0
        over = gap[end] / opening if not rigid and gap[last] < 0 < gap[end] and opening > 0 else 0.0
        impact[:] = (
            times[first] + min(late, h), times[end] - over, h * force[first:end].sum(), force[most],
            0.5 * (times[most] + times[most + 1]), max(closing, 0.0), max(opening, 0.0),
        )  # fmt: skip
    return impacts


def contact_quantities(
    history: History,
    contact: PointContact,
    motions: tuple[np.ndarray, np.ndarray | None],
    elastic: bool,
    alone: bool,
) -> dict[str, Quantity]:
    """Return impulse, impacts, peak force and rebound of a contact.

    Args:
        motions: Of the centres of its body and of the other, see `NodalBody.centre_motion`; None of a rigid obstacle.
        elastic: Whether any body is elastic.
        alone: Whether nothing else acts on the bodies.
    """
    step = float(history.times[1] - history.times[0])
    forces = history.forces @ contact.directions
    impulse = step * forces.sum(axis=0)
    size = float(np.linalg.norm(impulse))
    values: dict[str, Quantity] = {"impulse": (size, "N s")}
    if size == 0:
        return values
    along = impulse / size
    rigid = contact.law is None
    # A law limits the bandwidth of its force; a rigid contact opens and closes faster than steps resolve.
    resolution = resolved(history.times) if rigid else 2 * step
    impacts = located(history, rigid)
    if elastic:
        values |= impact_quantities(merged(impacts, resolution)) | smoothed_peak(forces @ along, step, resolution)
    else:
        values |= impact_quantities(impacts)
    own, other = (None if motion is None else motion[[2, 0], :3] for motion in motions)
    assert own is not None
    return values | rebound(along, own, other, alone)


def resultant_quantities(times: np.ndarray, forces: np.ndarray) -> dict[str, Quantity]:
    """Return impulse, peak force, start and duration of a contact from its resultant, where gaps are not recorded.

    Args:
        times: Ends of the steps [s], (s,); the first begins at 0.
        forces: Mean over each step [N], (s, 3).
    """
    step, impulse = float(times[0]), float(times[0]) * forces.sum(axis=0)
    size = float(np.linalg.norm(impulse))
    pressed = np.flatnonzero(np.abs(forces).sum(axis=1))
    if not len(pressed) or size == 0:
        return {"impulse": (size, "N s")}
    return {
        "impulse": (size, "N s"),
        "force_peak": (float((forces @ impulse).max()) / size, "N"),
        "start": (float(times[pressed[0]]) - step, "s"),
        "duration": (float(times[pressed[-1]] - times[pressed[0]]) + step, "s"),
    }


def energy_drift(energies: np.ndarray, exchanged: float) -> float:
    """Return the largest error of T + U + V + D − W over the energy that contacts exchange [J]; 0 where they do not.

    Args:
        energies: Kinetic T, strain U, contact V, dissipated D and work given W at the start and the ends of the steps
            [J], (s + 1, 5).
    """
    balance = energies[:, :4].sum(axis=1) - energies[:, 4]
    return float(np.abs(balance - balance[0]).max()) / exchanged if exchanged else 0.0


def body_quantities(name: str, motion: np.ndarray) -> Json:
    """Return final velocity and displacement of a body from its `NodalBody.centre_motion`."""
    return named(name, departure(*motion))


def force_quantities(load: NodalLoad, times: np.ndarray, moved: np.ndarray) -> Json:
    """Return the deflection under a moving force from displacements conjugate to its parts [m], (t, k), over times."""
    return named(load.travels, deflection(times, load.amounts(times), moved))
