"""Quantities of a full-FE run, named and defined as the solver's, from mean forces of steps and gaps at their ends."""

from dataclasses import dataclass

import numpy as np

from gudgeon.modaldb.records.trajectory import BEGINS, CLOSING, ENDS, OPENING
from gudgeon.modaldb.records.types import Json
from gudgeon.pipeline.nodal.problem import NodalLoad, PointContact
from gudgeon.solver.contact.windows import impact_window
from gudgeon.solver.results.contact_events import (
    Quantity,
    deflection,
    departure,
    impact_quantities,
    impacts_in,
    named,
    rebound,
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


def windows_of(
    prescribed: float | None, times: np.ndarray, contact: PointContact | None, elastic: bool, forces: np.ndarray
) -> tuple[float, float]:
    """Return the time below which impacts are one, and the window of forces [s]: both `run.window` where it is given.

    By default the first is the shortest period that the run resolves. A law limits the bandwidth of its force: two
    steps resolve it. A rigid contact of elastic bodies opens and closes faster than steps resolve. Impacts of rigid
    bodies are told apart. The second follows the hardest impact.

    Args:
        contact: None of a sliding contact.
        elastic: Whether any body is elastic.
        forces: Resultant over each step [N], (s, 3).
    """
    if prescribed is not None:
        return prescribed, prescribed
    if not elastic:
        return 0.0, 0.0
    lawful = contact is not None and contact.law is not None
    separation = 2 * float(times[1] - times[0]) if lawful else resolved(times)
    return separation, impact_window(impacts_in(times, forces, separation, 0.0), separation)


def located(history: History, directions: np.ndarray, windows: tuple[float, float], *, rigid: bool) -> np.ndarray:
    """Return the impacts of a contact as in `Trajectory.impacts`, (b, 9), by the gap of its nearest point.

    With a law an impact begins and ends where the gap, linear in the step, passes zero. A rigid contact closes where
    the gap, extrapolated from the step before, passes zero, and ends with its last step under force.

    Args:
        directions: Of the force of each point, (c, 3).
        windows: As in `windows_of` [s].
        rigid: Whether the contact has no law.
    """
    times, gap = history.times, history.gaps.min(axis=1)
    impacts, h = impacts_in(times, history.forces @ directions, *windows), float(times[1] - times[0])
    # Closing speed in each step; before the first step the speed at the start.
    speeds = np.concatenate([[-history.rates.min()], -np.diff(gap) / h, [0.0]])
    for impact in impacts:
        start, end = (int(np.rint((time - times[0]) / h)) for time in impact[[BEGINS, ENDS]])
        closing = speeds[start] if rigid else speeds[start + 1]
        opening = -speeds[end + 1] if rigid else -speeds[end]
        late = gap[start] / closing if gap[start] > 0 and closing > 0 else 0.0
        overshoot = gap[end] / opening if not rigid and gap[end - 1] < 0 < gap[end] and opening > 0 else 0.0
        impact[[BEGINS, ENDS]] = times[start] + min(late, h), times[end] - overshoot
        impact[[CLOSING, OPENING]] = max(closing, 0.0), max(opening, 0.0)
    return impacts


def contact_quantities(
    history: History,
    contact: PointContact,
    motions: tuple[np.ndarray, np.ndarray | None],
    windows: tuple[float, float],
) -> dict[str, Quantity]:
    """Return impulse, impacts, peak force and rebound of a contact.

    Args:
        motions: Of the centres of its body and of the other, see `NodalBody.centre_motion`; None of a rigid obstacle.
            A body that meets itself does not rebound.
        windows: As in `windows_of` [s].
    """
    impulse = float(history.times[1] - history.times[0]) * (history.forces @ contact.directions).sum(axis=0)
    size = float(np.linalg.norm(impulse))
    values: dict[str, Quantity] = {"impulse": (size, "N s")}
    values |= impact_quantities(located(history, contact.directions, windows, rigid=contact.law is None), windows[1])
    if size == 0 or contact.other == contact.body:
        return values
    body_velocity, partner_velocity = (None if motion is None else motion[0, :3] for motion in motions)
    assert body_velocity is not None
    return values | rebound(impulse / size, body_velocity, partner_velocity)


def resultant_quantities(times: np.ndarray, forces: np.ndarray, windows: tuple[float, float]) -> dict[str, Quantity]:
    """Return impulse, impacts and peak force of a contact from its resultant, where gaps are not recorded.

    Args:
        times: Start and ends of the steps [s], (s + 1,).
        forces: Mean over each step [N], (s, 3).
        windows: As in `windows_of` [s].
    """
    impulse = float(times[1] - times[0]) * forces.sum(axis=0)
    return {"impulse": (float(np.linalg.norm(impulse)), "N s")} | impact_quantities(
        impacts_in(times, forces, *windows), windows[1]
    )


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
