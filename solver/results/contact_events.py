"""Impacts, peaks, deflections and rebound velocities as quantities: pure functions of histories of any integrator."""

from collections.abc import Mapping

import numpy as np

from gudgeon.modaldb.records.trajectory import (
    BEGINS,
    CLOSING,
    ENDS,
    IMPACT_COLUMNS,
    IMPULSE,
    OPENING,
    PEAK,
    PEAK_TIME,
    WINDOWED,
    WINDOWED_TIME,
)
from gudgeon.modaldb.records.types import Json
from gudgeon.solver.integrators.curves import windowed

Quantity = tuple[float, str]
"""Value and unit."""

PER_IMPACT = {
    "start": (BEGINS, "s"), "end": (ENDS, "s"), "impulse": (IMPULSE, "N s"), "force_peak": (WINDOWED, "N"),
    "force_peak_raw": (PEAK, "N"), "force_time": (WINDOWED_TIME, "s"),
    "approach_speed": (CLOSING, "m/s"), "separation_speed": (OPENING, "m/s"),
}  # fmt: skip
"""Column and unit of the quantities of an impact."""
SHOWN = 10
"""Number of impacts that are quantities."""
NOTICED = 1e-12
"""Share of the largest component of a motion below which another is round-off."""


def named(owner: str, values: Mapping[str, Quantity]) -> Json:
    """Return the quantities of a contact, force or body in the form of a record, owner.key → {"value", "unit"}."""
    return {f"{owner}.{name}": {"value": value, "unit": unit} for name, (value, unit) in values.items()}


def impact_quantities(impacts: np.ndarray, window: float) -> dict[str, Quantity]:
    """Return the quantities of a contact from its impacts, (b, 9) as `Trajectory.impacts`, and their window [s]."""
    values: dict[str, Quantity] = {"impacts": (float(len(impacts)), "1")}
    if not len(impacts):
        return values
    start, end = float(impacts[0, BEGINS]), float(impacts[:, ENDS].max())
    values |= {"start": (start, "s"), "end": (end, "s"), "duration": (end - start, "s")}
    highest = impacts[impacts[:, WINDOWED].argmax()]
    if highest[WINDOWED] > 0:
        values |= {"force_peak": (float(highest[WINDOWED]), "N"), "force_window": (window, "s")}
        values |= {"peak_time": (float(highest[WINDOWED_TIME]), "s")}
    if (raw := float(impacts[:, PEAK].max())) > 0:
        values["force_peak_raw"] = (raw, "N")
    for i, impact in enumerate(impacts[:SHOWN], 1):
        for name, (column, unit) in PER_IMPACT.items():
            without = WINDOWED if name in ("force_peak", "force_time") else PEAK if name == "force_peak_raw" else None
            if not np.isnan(impact[column]) and (without is None or impact[without] > 0):
                values[f"impact{i}.{name}"] = (float(impact[column]), unit)
    return values


def impacts_in(times: np.ndarray, forces: np.ndarray, separation: float, window: float) -> np.ndarray:
    """Return the impacts in a history of forces, (b, 9) as `Trajectory.impacts`, speeds unknown (NaN).

    Impacts begin and end with intervals. Those separated by less than a time are one.

    Args:
        times: Edges of equal intervals [s], (s + 1,).
        forces: Resultant over each interval [N], (s, 3).
        separation: That time [s].
        window: W [s].
    """
    step = float(times[1] - times[0])
    ends = np.flatnonzero(np.diff(np.concatenate([[False], forces.any(axis=1), [False]])))
    spans: list[list[int]] = []
    for start, end in zip(ends[::2].tolist(), ends[1::2].tolist(), strict=True):
        if spans and (start - spans[-1][1]) * step < separation:
            spans[-1][1] = end
        else:
            spans.append([start, end])
    impacts = np.full((len(spans), IMPACT_COLUMNS), np.nan)
    for impact, (start, end) in zip(impacts, spans, strict=True):
        edges, forces_in = times[start : end + 1], forces[start:end]
        impulse = np.concatenate([np.zeros((1, 3)), step * np.cumsum(forces_in, axis=0)])
        sizes = np.linalg.norm(forces_in, axis=1)
        highest = start + int(sizes.argmax())
        peak, when = float(sizes.max()), 0.5 * float(times[highest] + times[highest + 1])
        impact[[BEGINS, ENDS, IMPULSE]] = edges[0], edges[-1], np.linalg.norm(impulse[-1])
        impact[[PEAK, PEAK_TIME, WINDOWED, WINDOWED_TIME]] = peak, when, peak, when
        if window > 0:
            impact[[WINDOWED, WINDOWED_TIME]] = windowed(edges, impulse, window)
    return impacts


def deflection(times: np.ndarray, loads: np.ndarray, moved: np.ndarray) -> dict[str, Quantity]:
    """Return the displacement under a moving force, along it: the largest one, its time, and the last one.

    Args:
        times: [s], (t,)
        loads: Its parts on the functions of a traction space [N], (t, F); without a quantity where their sum is zero.
        moved: Displacements conjugate to them [m], (t, F).
    """
    # Splines add up to one, so that their forces add up to the total force.
    size = np.abs(loads.sum(axis=1))
    if not (size > 0).all():
        return {}
    deflections = np.einsum("tk,tk->t", loads, moved) / size
    peak = int(np.abs(deflections).argmax())
    return {
        "deflection_peak": (float(deflections[peak]), "m"),
        "peak_time": (float(times[peak]), "s"),
        "deflection_end": (float(deflections[-1]), "m"),
    }


def rebound(along: np.ndarray, v_body: np.ndarray | None, v_partner: np.ndarray | None) -> dict[str, Quantity]:
    """Return the velocity of a body's centre after a contact, and of the other body's.

    Args:
        along: Direction of the impulse on the body, (3,).
        v_body: Velocity of its centre at the end [m/s], (3,); None of a body that is held.
        v_partner: The same of the other body; None of an obstacle too.
    """
    speeds = {"rebound_velocity": v_body, "rebound_velocity_other": v_partner}
    return {name: (float(speed @ along), "m/s") for name, speed in speeds.items() if speed is not None}


def restitution(before: np.ndarray, after: np.ndarray, rubbed: np.ndarray | float = 0.0) -> dict[str, Quantity]:
    """Return Newton's restitution of the bodies that only one contact acts on, if they approach.

    The change of their velocities without that by friction is the impulse w of the normal forces on the rigid
    coordinates, so w·v is the normal velocity of the rigid-body motion at the contact points, weighted by their
    impulses; it is negative in approach.

    Args:
        before, after: Velocities of the mass-orthonormal rigid motions of both bodies [m kg^½/s], (r,).
        rubbed: Friction's impulse on the rigid coordinates [kg^½ m/s], (r,).
    """
    weights = after - before - rubbed
    approach = float(weights @ before)
    return {"restitution": (0.0 - float(weights @ after) / approach, "1")} if approach < 0 else {}


def departure(after: np.ndarray, shift: np.ndarray, before: np.ndarray) -> dict[str, Quantity]:
    """Return velocity and displacement of a body's centre at the end, along the axes along which it moves.

    Args:
        after: Velocity and angular velocity [m/s, rad/s], (6,).
        shift: Displacement and rotation since the start [m, rad], (6,).
        before: As `after`, at the start.
    """
    values: dict[str, Quantity] = {}
    sizes = np.abs([after, shift, before]).reshape(3, 2, 3)
    noticed = (sizes > NOTICED * sizes.max(axis=2, keepdims=True)).reshape(3, 6).any(axis=0)
    for axis in np.flatnonzero(noticed):
        turns, letter = axis >= 3, "xyz"[axis % 3]
        rates = ("angular_velocity", "rad/s") if turns else ("velocity", "m/s")
        changes = ("rotation", "rad") if turns else ("displacement", "m")
        for (name, unit), motion in ((rates, after), (changes, shift)):
            values[f"{name}_{letter}"] = (float(motion[axis]), unit)
    return values
