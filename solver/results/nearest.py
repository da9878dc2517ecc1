"""The smallest gap of contacts that did not touch."""

import numpy as np

from gudgeon.modaldb.records.types import Json
from gudgeon.solver.integrators.curves import least_of_cubics
from gudgeon.solver.integrators.outcome import Outcome
from gudgeon.solver.results.contact_events import named
from gudgeon.solver.system.system import System


def nearest(system: System, end: Outcome, times: np.ndarray, frames: np.ndarray, velocities: np.ndarray) -> Json:
    """Return the smallest gap of each contact without impulse [m], and its time [s].

    Between frames the gap of each point is the cubic of its values and rates there.

    Args:
        times: Of the frames [s], (f,).
        frames, velocities: Coordinates and their rates, (f, m).
    """
    json: Json = {}
    if system.scene.capabilities.turns:  # Its integrator follows the gaps.
        return json
    times = np.concatenate([[0.0], times])
    states, rates = np.vstack([system.position, frames]), np.vstack([system.velocity, velocities])
    for contact in system.contacts:
        if end.impulses[contact.rows].any():
            continue
        gaps = _gaps(system, contact.rows, times, states)
        if (surface := contact.master) is not None:
            body_name, partner = (system.bodies[name] for name in (contact.body, surface.body))
            moved = [
                body.centre_motion(states[:, body.rigid])[:, :3] @ surface.direction for body in (body_name, partner)
            ]
            inward = states @ system.functions[contact.functions].T
            gaps += np.array([surface.at_points(*item) for item in zip(moved[0] - moved[1], inward, strict=True)])
        if system.edged(contact):
            gaps += system.beyond(contact, states)
            frame = int(gaps.min(axis=1).argmin())
            minimum, time = float(gaps[frame].min()), float(times[frame])
        else:
            minimum, time = least_of_cubics(times, gaps, rates @ system.rows[contact.rows].T)
        json |= named(contact.name, {"least_gap": (minimum, "m"), "least_gap_time": (time, "s")})
    return json


def _gaps(system: System, rows: slice, times: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Return the gaps of a contact's points without traction space and contact forces [m], (f, c)."""
    driving = system.driving
    return system.gap[rows] + states @ system.rows[rows].T + driving.loads(times, 0.0) @ driving.to_gap[rows].T
