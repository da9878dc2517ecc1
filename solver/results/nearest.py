"""The smallest gap of contacts that did not touch."""

import numpy as np

from gudgeon.modaldb.records.types import Json
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.integrators.curves import least_of_cubics
from gudgeon.solver.integrators.outcome import Outcome, Samples
from gudgeon.solver.results.contact_events import named
from gudgeon.solver.system.system import System


def nearest(
    system: System, end: Outcome, samples: Samples, states: tuple[np.ndarray, np.ndarray], spans: tuple[float, float]
) -> Json:
    """Return the smallest gap of each contact without impulse [m], and its time [s].

    Between samples of rigid bodies, or frames where a body is elastic, the gap of each point is the cubic of its values
    and rates there, or that of the tangents where other contacts of its bodies press meanwhile.

    Args:
        states: Coordinates and their rates at frames, (f, m).
        spans: Of a sample, and of a frame [s].
    """
    json: Json = {}
    if system.scene.capabilities.turns:  # Its integrator follows the gaps.
        return json
    (frames, velocities), span, r = states, spans[1], len(system.rigid)
    if r == len(system.velocity):
        frames, velocities, span = samples.snapshots[:, :r], samples.snapshots[:, r : 2 * r], spans[0]
    times = span * np.arange(len(frames) + 1)
    pressing = (samples.forces != 0).any(axis=2)
    presses = pressing.reshape(len(frames), len(pressing) // max(len(frames), 1), pressing.shape[1]).any(axis=1)
    q, rates = np.vstack([system.position, frames]), np.vstack([system.velocity, velocities])
    for contact in system.contacts:
        if end.impulses[contact.rows].any():
            continue
        gaps = _gaps(system, contact.rows, times, q)
        if (surface := contact.master) is not None:
            body_name, partner = (system.bodies[name] for name in (contact.body, surface.body))
            moved = [body.centre_motion(q[:, body.rigid])[:, :3] @ surface.direction for body in (body_name, partner)]
            inward = q @ system.functions[contact.functions].T
            gaps += np.array([surface.at_points(*item) for item in zip(moved[0] - moved[1], inward, strict=True)])
        if system.edged(contact):
            gaps += system.beyond(contact, q)
            frame = int(gaps.min(axis=1).argmin())
            minimum, time = float(gaps[frame].min()), float(times[frame])
        else:
            bodies = _bodies(contact)
            beside = [i for i, c in enumerate(system.contacts) if bodies & _bodies(c)]
            struck = presses[:, beside].any(axis=1)
            minimum, time = least_of_cubics(times, gaps, rates @ system.rows[contact.rows].T, struck)
        json |= named(contact.name, {"least_gap": (minimum, "m"), "least_gap_time": (time, "s")})
    return json


def _bodies(contact: ContactRows) -> set[str]:
    """Return the bodies of a contact."""
    return {side.body for side in (contact, contact.other, contact.master) if side is not None}


def _gaps(system: System, rows: slice, times: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Return the gaps of a contact's points without traction space and contact forces [m], (f, c)."""
    driving = system.driving
    return system.gap[rows] + states @ system.rows[rows].T + driving.loads(times, 0.0) @ driving.to_gap[rows].T
