"""Quantities of interest of a run, and the momentum balance."""

import numpy as np

from modaldb.schema import Json
from solver.contacts import ContactRows
from solver.outcome import Outcome
from solver.system import System


def quantities(
    system: System, end: Outcome, dt: float, interval: float, forces: np.ndarray, multipliers: np.ndarray
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
        impulse = (end.impulses[contact.rows, None] * contact.directions).sum(axis=0)
        size = float(np.linalg.norm(impulse))
        values = {"impulse": (size, "N s")}
        pressed = float(end.impulses[contact.rows].sum())
        if contact.edge.any() and pressed > 0:
            values["edge_share"] = (float(end.impulses[contact.rows][contact.edge].sum()) / pressed, "1")
        if size > 0:
            along = impulse / size
            history = forces[:, number] @ along
            touching = np.flatnonzero(np.abs(forces[:, number]).sum(axis=1))
            values["force_peak"] = (float(history.max()), "N")
            if len(system.contacts) == 1:
                first, last = end.extreme[4], end.extreme[5]
                values["start"] = (float(first), "s")
                values["duration"] = (float(last - first + dt), "s")
            else:
                values["start"] = (float(touching[0] * interval), "s")
                values["duration"] = (float((touching[-1] - touching[0] + 1) * interval), "s")
            values |= _rebound(system, end, contact, along)
        if contact.areas is not None and multipliers.size:
            pressure = multipliers[:, contact.rows] / contact.areas
            values["pressure_peak"] = (float(pressure.max()), "Pa")
        found |= {f"{contact.name}.{name}": {"value": v, "unit": u} for name, (v, u) in values.items()}
    return found


def _rebound(system: System, end: Outcome, contact: ContactRows, along: np.ndarray) -> dict[str, tuple[float, str]]:
    before, after = (_velocity(system, contact.body, v) @ along for v in (system.velocity, end.v))
    values = {"rebound_velocity": (float(after), "m/s")}
    if before < 0:
        values["restitution"] = (float(-after / before), "1")
    return values


def _velocity(system: System, body: str, v: np.ndarray) -> np.ndarray:
    """Return the velocity of a body's centre of mass [m/s], (3,)."""
    first, item = system.offsets[body], system.bodies[body]
    return item.centre_motion(v[first : first + item.rigid_count])[:3]


def momentum_residual(system: System, end: Outcome, loads: np.ndarray, duration: float) -> float:
    """Return the largest error of a body's linear and angular momentum balance, relative to the impulse.

    Momentum comes from the rigid twists, impulse from forces, directions and arms: two independent ways. Angular
    momentum is measured about the centre of mass, per radius of the contact points.

    Args:
        loads: Impulse of each load row, (L,).
        duration: Of gravity [s].
    """
    worst = 0.0
    for name, body in system.bodies.items():
        first = system.offsets[name]
        columns = slice(first, first + body.rigid_count)
        gained, centre = np.zeros(6), body.morph.centre
        change = body.centre_motion(end.v[columns] - system.velocity[columns])
        gained[:3], gained[3:] = body.morph.mass * change[:3], body.morph.inertia @ change[3:]
        given, size, radius = _driven(system, name, loads, duration)
        for number, contact in enumerate(system.contacts):
            if contact.body == name:
                impulses = end.impulses[contact.rows, None] * contact.directions
                arm = contact.points - centre
                radius = max(radius, float(np.linalg.norm(arm, axis=1).max()))
                given[:3] += impulses.sum(axis=0)
                given[3:] += np.cross(arm, impulses).sum(axis=0)
                size += float(np.linalg.norm(impulses.sum(axis=0)))
            if (over := contact.master) is not None:
                sign = (contact.body == name) - (over.body == name)
                given[:3] += sign * end.drag_impulse[number] * over.direction
                if over.body == name:
                    wrench = -end.master_impulses[contact.functions] @ over.resultant
                    given[:3] += wrench[:3]
                    given[3:] += wrench[3:] - np.cross(centre, wrench[:3])
                    size += float(np.linalg.norm(wrench[:3]))
        if size > 0 and body.rigid_count:
            free = np.abs(body.twists).max(axis=0) > 0
            error = np.abs(gained - given) / size * np.repeat([1.0, 1.0 / (radius or 1.0)], 3)
            worst = max(worst, float(error[free].max()))
    return worst


def _driven(system: System, name: str, loads: np.ndarray, duration: float) -> tuple[np.ndarray, float, float]:
    """Return the impulse and its moment about the centre that loads give a body, its size, and its largest arm [m]."""
    body, given, driving = system.bodies[name], np.zeros(6), system.driving
    size, radius, centre = 0.0, 0.0, body.morph.centre
    wrenches = []
    for number, held in enumerate(driving.joints):
        along, lateral = held.joint.axes
        if held.body == name:
            resultant = body.modal.loads[held.joint.interface].resultant
            force = loads[2 * number] * lateral + loads[2 * number + 1] * along
            wrenches.append(force @ resultant)
    for number, load in enumerate(driving.given, 2 * len(driving.joints)):
        if load.body == name:
            wrenches.append(loads[number] * body.modal.loads[load.force.interface].resultant[0])
    for wrench in wrenches:
        moment = wrench[3:] - np.cross(centre, wrench[:3])
        given += np.concatenate([wrench[:3], moment])
        size += float(np.linalg.norm(wrench[:3]))
    given[:3] += duration * body.morph.mass * np.asarray(system.scene.run.gravity) if body.rigid_count else 0.0
    return given, size, radius
