"""What the modal basis of a run lacks, estimated from a run with half of each body's elastic coordinates.

Both runs take the same steps and start from the same state. With n and n/2 coordinates, an error c n^(-p) is the
difference of the two runs over 2^p - 1:

- impulses and rebound velocities: p = 1, the order at rigid contact of a rod (measured 0.9 to 1.1);
- forces averaged over the time that a model resolves: p = 1/2, that of a series of modes at a jump, where the
  overshoot does not decrease. A difference can be zero by chance, so that the larger one of two windows is taken, as
  many periods of the run with n/2 coordinates as run.window has of the run with n, and half as long again;
- contact by a penalty, without residual flexibility: the missing compliance makes it too stiff, and its error is
  irregular in n, so that the difference may be too small. Windowed forces of rods struck through springs change by 0.04
  to 0.2 of the share of the missing compliance, impulses and velocities by 0.01 to 0.2 of it: `STIFFENED` is the least
  estimate. What n coordinates lack is taken to be what the upper half of them adds, as in a series of 1/n^2;
- an impact that is shorter than the shortest kept period sees R, which has no mass, in place of waves. Where the upper
  half of the coordinates takes no part in the contact, as bending modes in an axial impact, the two runs agree and
  both are wrong; `UNRESOLVED` is the least estimate, over R's share of the compliance and, for a longer impact, the
  share of that period in its duration. Solids with 5 to 60 modes that strike a plane or each other have errors of 0.1
  to 0.5 of it in impulse.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gudgeon.modaldb.records.trajectory import BASIS_REASON, BEGINS, ENDS, IMPULSE, ONE_COORDINATE, Trajectory
from gudgeon.solver.errors import SceneError, SolverError
from gudgeon.solver.methods import METHODS
from gudgeon.solver.result import Result
from gudgeon.solver.system.nested import nested
from gudgeon.solver.system.system import System

REBOUND = ("rebound_velocity", "rebound_velocity_other")
WINDOWS = (1.0, 1.5)
"""Windows over which forces are compared, over that of the run in periods of the run with fewer coordinates."""
STIFFENED = {"basis.force": 0.3, "basis.impulse": 0.1, "basis.rebound": 0.1}
"""Least relative errors over the share of the compliance that a contact by a penalty lacks."""
UNRESOLVED = {"basis.force": 0.5, "basis.impulse": 0.3, "basis.rebound": 0.3}
"""Least relative errors over the share of the compliance that is without mass in an impact shorter than is resolved."""
RINGING = 0.1
"""Least error of windowed forces over the share by which the largest mean over a sample exceeds the windowed force.

At a wave front the share is 0.3 to 0.6, the error over one period 0.2 to 0.35 of it; it decreases with the number of
periods in the window; of a smooth force that is resolved, the share is below 0.05."""
FORCE_ORDER = 0.5
"""Order in the number of coordinates with which windowed forces converge where a force jumps."""


def with_basis_estimates(system: System, found: Trajectory, run: Callable[[System], Trajectory]) -> Trajectory:
    """Return a finished run with its estimated relative errors due to the modal basis.

    Args:
        system: The one that was run.
        found: Its trajectory.
        run: Integrates another system with the same steps.

    Returns:
        Its `estimates` with `basis.impulse`: the largest error of a contact's impulse, over its largest impulse up to
        any time; `basis.force`: of its largest windowed force, over that force; `basis.rebound`: of a rebound velocity,
        over the largest speed of a body at the start, where the contact has a restitution. Where the run with fewer
        coordinates cannot start, or fails, or where a body that touches has a single one, the first two are 1 and
        `counts` has the reason. Unchanged where nothing touches or no body has elastic coordinates.
    """
    if not any(np.any(contact.force) for contact in found.contacts.values()):
        return found
    if _has_one_coordinate(system, found):
        return _unknown(found, ONE_COORDINATE)
    try:
        if (fewer := nested(system)) is None:
            return found
        other = run(fewer)
    except (SceneError, SolverError) as error:
        return _unknown(found, str(error))
    if not Result[other.result].ok:
        return _unknown(found, other.counts.get("reason", Result[other.result].value))
    return replace(found, estimates=found.estimates | _estimates(system, fewer, found, other))


def _has_one_coordinate(system: System, found: Trajectory) -> bool:
    """Return whether a body that touched has a single elastic coordinate."""
    touching = [contact for contact in system.contacts if np.any(found.contacts[contact.name].force)]
    sides = [side for one in touching for side in (one, one.other, one.master) if side is not None]
    return any(len(system.bodies[side.body].modal.angular_frequencies) == 1 for side in sides)


def _unknown(found: Trajectory, reason: str) -> Trajectory:
    """Return a run with estimates of 1, and the reason."""
    errors = {"basis.impulse": 1.0, "basis.force": 1.0}
    return replace(found, estimates=found.estimates | errors, counts=found.counts | {BASIS_REASON: reason})


def _estimates(system: System, fewer: System, found: Trajectory, other: Trajectory) -> dict[str, float]:
    """Return the estimated errors of the run of a system, from it and that of the nested system."""
    speeds = [body.centre_motion(system.velocity[body.rigid])[:3] for body in system.bodies.values()]
    # A window of as many periods of the highest frequency as in the run itself: the share of the ringing is equal.
    periods = system.window / system.resolution if system.resolution > 0 else 1.0
    window = fewer.resolution * max(1.0, periods)
    errors = _errors(found, other, window, float(np.linalg.norm(speeds, axis=1).max()))
    errors["basis.force"] = max(errors["basis.force"], RINGING * _ringing(found) / max(1.0, periods))
    stiff, massless = _lacking(system, fewer), _unresolved(system, found)
    return {name: max(error, STIFFENED[name] * stiff, UNRESOLVED[name] * massless) for name, error in errors.items()}


def _ringing(found: Trajectory) -> float:
    """Return the largest share, one at most, by which a force over a sample exceeds that over the window."""
    names = [f"{name}.force_peak" for name in found.contacts]
    peaks = [[found.quantities[f"{name}{raw}"]["value"] for raw in ("", "_raw")] for name in names
             if {name, f"{name}_raw"} <= set(found.quantities)]  # fmt: skip
    return max((min(1.0, raw / peak - 1) for peak, raw in peaks if peak > 0), default=0.0)


def _lacking(system: System, fewer: System) -> float:
    """Return the largest share of the compliance that a contact without R lacks, estimated; 0 where all have it."""
    static = [_flexibility(one) for one in (system, fewer)]
    missing, own, most = static[0] - static[1], system.layer + system.yielding(), 0.0
    for contact in system.contacts:
        method = METHODS[system.scene.contact[contact.name].method]
        if not (method.flexible or method.rigid):
            added = float(missing[contact.rows].sum())
            most = max(most, added / (added + float(own[contact.rows].sum())))
    return most


def _unresolved(system: System, found: Trajectory) -> float:
    """Return the largest product of R's share of a contact's compliance and the unresolved share of its main impact.

    The compliance is that to the contact's own distribution of force, and the unresolved share the shortest kept period
    over the impact's duration, at most 1.
    """
    elastic, most = system.stiffness > 0, 0.0
    for contact in system.contacts:
        impacts, history = found.impacts[contact.name], found.contacts[contact.name]
        assert history.peak_multipliers is not None
        forces = history.multipliers.sum(axis=0) + history.peak_multipliers.sum(axis=0)
        if not len(impacts) or not forces.any():
            continue
        main = impacts[impacts[:, IMPULSE].argmax()]
        duration = float(main[ENDS] - main[BEGINS])
        massless = float(forces @ system.residual[contact.rows, contact.rows] @ forces)
        modal = float(((forces @ system.rows[contact.rows][:, elastic]) ** 2 / system.stiffness[elastic]).sum())
        whole = massless + modal + float(forces**2 @ (system.layer + system.yielding())[contact.rows])
        if duration > 0 and whole > 0:
            most = max(most, massless / whole * min(1.0, system.resolution / duration))
    return most


def _flexibility(system: System) -> np.ndarray:
    """Return the static displacement of each contact row per unit force on it, by elastic coordinates [m/N], (c,)."""
    elastic = system.stiffness > 0
    return (system.rows[:, elastic] ** 2 / system.stiffness[elastic]).sum(axis=1)


def _errors(found: Trajectory, other: Trajectory, window: float, speed: float) -> dict[str, float]:
    """Return the estimated errors of the first of two runs with the same samples, see `with_basis_estimates`.

    Args:
        window: Time over which forces are compared, not below what the second run resolves [s].
        speed: Of the fastest body at the start [m/s].
    """
    errors = {"basis.impulse": 0.0, "basis.force": 0.0}
    samples, interval = len(found.times), float(found.times[0])
    widths = [min(max(1, round(factor * window / interval)), samples) for factor in WINDOWS]
    for name, contact in found.contacts.items():
        if not np.any(contact.force):
            continue
        sums = [np.cumsum(np.vstack([np.zeros(3), one.contacts[name].force]), axis=0) for one in (found, other)]
        apart = np.linalg.norm(sums[0][-1] - sums[1][-1]) / np.linalg.norm(sums[0], axis=1).max()
        errors["basis.impulse"] = max(errors["basis.impulse"], float(apart))
        for width in widths:
            peaks = [np.linalg.norm(one[width:] - one[:-width], axis=1).max(initial=0.0) for one in sums]
            if peaks[0] > 0:
                apart = abs(peaks[0] - peaks[1]) / peaks[0] / (2**FORCE_ORDER - 1)
                errors["basis.force"] = max(errors["basis.force"], float(apart))
        keys = [key for key in (f"{name}.{one}" for one in REBOUND) if key in found.quantities]
        if f"{name}.restitution" in found.quantities and keys and speed > 0:
            ours, theirs = (np.array([one.quantities[key]["value"] for key in keys]) for one in (found, other))
            apart = np.abs(ours - theirs).max() / speed
            errors["basis.rebound"] = max(errors.get("basis.rebound", 0.0), float(apart))
    return errors
