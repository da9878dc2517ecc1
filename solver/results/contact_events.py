"""Impacts, peaks, deflections and rebound velocities as quantities: pure functions of histories of any integrator."""

from collections.abc import Mapping

import numpy as np

from gudgeon.modaldb.records.types import Json

Quantity = tuple[float, str]
"""Value and unit."""

PER_IMPACT = (
    ("start", "s"), ("end", "s"), ("impulse", "N s"), ("force", "N"), ("force_time", "s"), ("closing", "m/s"),
    ("opening", "m/s"),
)  # fmt: skip
SHOWN = 10
"""Number of impacts that are quantities."""
NOTICED = 1e-12
"""Share of the largest component of a motion below which another is round-off."""


def named(owner: str, values: Mapping[str, Quantity]) -> Json:
    """Return the quantities of a contact, force or body in the form of a record, owner.key → {"value", "unit"}."""
    return {f"{owner}.{name}": {"value": value, "unit": unit} for name, (value, unit) in values.items()}


def impact_quantities(impacts: np.ndarray) -> dict[str, Quantity]:
    """Return the quantities of a contact from its impacts, (b, 7) as `Trajectory.impacts`; b is 1 at least."""
    first, highest = impacts[0], impacts[impacts[:, 3].argmax()]
    values = {
        "force_peak": (float(highest[3]), "N"),
        "impacts": (float(len(impacts)), "1"),
        "start": (float(first[0]), "s"),
        "end": (float(impacts[:, 1].max()), "s"),
        "duration": (float(impacts[:, 1].max() - first[0]), "s"),
        "first_duration": (float(first[1] - first[0]), "s"),
        "first_impulse": (float(first[2]), "N s"),
    }
    if highest[3] == 0:
        del values["force_peak"]
    else:
        values |= {"largest_force": (float(highest[3]), "N"), "peak_time": (float(highest[4]), "s")}
        values |= {"first_peak": (float(first[3]), "N")}
    for number, impact in enumerate(impacts[:SHOWN] if len(impacts) > 1 else [], 1):
        for place, (key, unit) in enumerate(PER_IMPACT):
            if (key.startswith("force") and impact[3] == 0) or np.isnan(impact[place]):
                continue
            values[f"impact{number}.{key}"] = (float(impact[place]), unit)
    return values


def sampled_impacts(force: np.ndarray, interval: float) -> np.ndarray:
    """Return the impacts in a history, to within an interval, (b, 7) as `Trajectory.impacts`, speeds unknown (NaN).

    Args:
        force: Mean force over each interval [N], (s,).
        interval: [s]
    """
    ends = np.flatnonzero(np.diff(np.concatenate([[False], force > 0, [False]])))
    impacts = np.full((len(ends) // 2, 7), np.nan)
    for impact, first, end in zip(impacts, ends[::2], ends[1::2], strict=True):
        highest = first + int(force[first:end].argmax())
        impulse = interval * force[first:end].sum()
        impact[:5] = first * interval, end * interval, impulse, force[highest], (highest + 0.5) * interval
    return impacts


def merged(impacts: np.ndarray, resolution: float) -> np.ndarray:
    """Return impacts, with those merged that are separated by less than the resolution of the model.

    Args:
        impacts: (b, 7), in order of time, see `Trajectory.impacts`.
        resolution: That of the system [s].
    """
    found: list[np.ndarray] = []
    for impact in impacts:
        if found and impact[0] - found[-1][1] < resolution:
            last = found[-1]
            last[1], last[6] = impact[1], impact[6]
            last[2] += impact[2]
            if impact[3] > last[3]:
                last[3:5] = impact[3:5]
        else:
            found.append(impact.copy())
    return np.array(found).reshape(-1, 7)


def smoothed_peak(history: np.ndarray, interval: float, resolution: float) -> dict[str, Quantity]:
    """Return the largest mean force over the time that a system resolves [N], and that time [s].

    A force over a shorter time contains the cut-off frequency and does not converge.

    Args:
        history: Mean force over each sample interval [N], (s,).
    """
    width = max(1, round(resolution / interval))
    if width > len(history):
        return {}
    mean = np.convolve(history, np.full(width, 1.0 / width), mode="valid")
    return {"force_peak": (float(mean.max()), "N"), "force_window": (width * interval, "s")}


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
    under = np.einsum("tk,tk->t", loads, moved) / size
    most = int(np.abs(under).argmax())
    return {
        "deflection_peak": (float(under[most]), "m"),
        "peak_time": (float(times[most]), "s"),
        "deflection_end": (float(under[-1]), "m"),
    }


def rebound(along: np.ndarray, own: np.ndarray, other: np.ndarray | None, alone: bool) -> dict[str, Quantity]:
    """Return the velocity of a body's centre after a contact, of the other body's, and the restitution.

    Args:
        along: Direction of the force on the body, (3,).
        own: Velocity of its centre before and after [m/s], (2, 3).
        other: The same of the other body.
        alone: Whether no other force acts on them, so that a restitution is defined.
    """
    before, after = own @ along
    values = {"rebound_velocity": (float(after), "m/s")}
    if other is not None:
        far = other @ along
        values["rebound_velocity_other"] = (float(far[1]), "m/s")
        before, after = before - far[0], after - far[1]
    if before < 0 and alone:
        values["restitution"] = (float(-after / before), "1")
    return values


def departure(after: np.ndarray, shift: np.ndarray, before: np.ndarray) -> dict[str, Quantity]:
    """Return velocity and shift of a body's centre at the end, along the axes along which it moves.

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
        names = (("spin", "rad/s"), ("turn", "rad")) if turns else (("velocity", "m/s"), ("shift", "m"))
        for (name, unit), motion in zip(names, (after, shift), strict=True):
            values[f"{name}_{letter}"] = (float(motion[axis]), unit)
    return values
