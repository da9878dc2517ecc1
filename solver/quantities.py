"""Quantities of interest of a run, and the momentum balance."""

import numpy as np

from modaldb.schema import Json
from solver.kernel import State
from solver.system import ContactRows, System


def quantities(
    system: System, state: State, dt: float, interval: float, forces: np.ndarray, multipliers: np.ndarray
) -> Json:
    """Return name → {"value", "unit"} for every contact, names led by the contact's.

    Args:
        dt: Step [s].
        interval: Sample interval [s].
        forces: Mean resultants over each sample [N], (s, k, 3).
        multipliers: Contact forces at each frame [N], (f, c).
    """
    found: Json = {}
    for number, contact in enumerate(system.contacts):
        impulse = (state.impulses[contact.rows, None] * contact.directions).sum(axis=0)
        size = float(np.linalg.norm(impulse))
        values = {"impulse": (size, "N s")}
        pressed = float(state.impulses[contact.rows].sum())
        if contact.edge.any() and pressed > 0:
            values["edge_share"] = (float(state.impulses[contact.rows][contact.edge].sum()) / pressed, "1")
        if size > 0:
            along = impulse / size
            history = forces[:, number] @ along
            touching = np.flatnonzero(np.abs(forces[:, number]).sum(axis=1))
            values["force_peak"] = (float(history.max()), "N")
            if len(system.contacts) == 1:
                first, last = state.extreme[4], state.extreme[5]
                values["start"] = (float(first), "s")
                values["duration"] = (float(last - first + dt), "s")
            else:
                values["start"] = (float(touching[0] * interval), "s")
                values["duration"] = (float((touching[-1] - touching[0] + 1) * interval), "s")
            values |= _rebound(system, state, contact, along)
        if contact.areas is not None and multipliers.size:
            pressure = multipliers[:, contact.rows] / contact.areas
            values["pressure_peak"] = (float(pressure.max()), "Pa")
        found |= {f"{contact.name}.{name}": {"value": v, "unit": u} for name, (v, u) in values.items()}
    return found


def _rebound(system: System, state: State, contact: ContactRows, along: np.ndarray) -> dict[str, tuple[float, str]]:
    before, after = (_velocity(system, contact.body, v) @ along for v in (system.velocity, state.v))
    values = {"rebound_velocity": (float(after), "m/s")}
    if before < 0:
        values["restitution"] = (float(-after / before), "1")
    return values


def _velocity(system: System, body: str, v: np.ndarray) -> np.ndarray:
    """Return the velocity of a body's centre of mass [m/s], (3,)."""
    first, item = system.offsets[body], system.bodies[body]
    return item.centre_motion(v[first : first + item.rigid_count])[:3]


def momentum_residual(system: System, state: State) -> float:
    """Return the largest error of a body's linear and angular momentum balance, relative to the impulse.

    Momentum comes from the rigid twists, impulse from forces, directions and arms: two independent ways. Angular
    momentum is measured about the centre of mass, per radius of the contact points.
    """
    worst = 0.0
    for name, body in system.bodies.items():
        gained, given, size, radius = np.zeros(6), np.zeros(6), 0.0, 1.0
        first = system.offsets[name]
        columns = slice(first, first + body.rigid_count)
        change = body.centre_motion(state.v[columns] - system.velocity[columns])
        gained[:3], gained[3:] = body.morph.mass * change[:3], body.morph.inertia @ change[3:]
        for contact in system.contacts:
            if contact.body == name:
                impulses = state.impulses[contact.rows, None] * contact.directions
                arm = contact.points - body.morph.centre
                radius = float(np.linalg.norm(arm, axis=1).max())
                given[:3] += impulses.sum(axis=0)
                given[3:] += np.cross(arm, impulses).sum(axis=0)
                size += float(np.linalg.norm(impulses.sum(axis=0)))
        if size > 0:
            free = np.abs(body.morph.rigid_twists).max(axis=0) > 0
            error = np.abs(gained - given) / size * np.repeat([1.0, 1.0 / radius], 3)
            worst = max(worst, float(error[free].max()))
    return worst
