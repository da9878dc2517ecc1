"""Quantities of interest of a run, and the momentum balance."""

import numpy as np

from modaldb.schema import Json
from solver.blows import blow_quantities, departure, merged, rebound, sampled_blows, smoothed_peak
from solver.contacts import ContactRows
from solver.outcome import Outcome
from solver.system import System

LOCATED = ("event", "collocation", "discrete-gradient", "kick")
"""Integrators of scenes whose bodies fly on when it is over."""
SLIPS = 3
"""Changes between sliding and sticking that have quantities of their own."""


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
        blows = end.episodes[number] if number < len(end.episodes) else np.empty((0, 7))
        if size > 0:
            along = impulse / size
            if len(end.episodes):
                values |= blow_quantities(merged(blows, system.resolution))
                if blows[:, 3].max() > 0 and system.resolution >= interval:
                    values |= smoothed_peak(forces[:, number] @ along, interval, system.resolution)
            else:
                values |= _of_samples(system, end, dt, interval, forces[:, number], along, len(contact.points))
            values |= _rebound(system, end, contact, along)
        if number < len(end.slips):
            values |= _of_slips(end.slips[number])
        if contact.areas is not None and multipliers.size:
            pressure = multipliers[:, contact.rows] / contact.areas
            values["pressure_peak"] = (float(pressure.max()), "Pa")
        found |= {f"{contact.name}.{name}": {"value": v, "unit": u} for name, (v, u) in values.items()}
    return found | _leaving(system, end)


def deflections(system: System, times: np.ndarray, frames: np.ndarray) -> Json:
    """Return the displacement under each travelling force, along it: its largest, when, and the last one.

    Args:
        times: Of the frames [s], (f,).
        frames: Coordinates, (f, m).
    """
    found: Json = {}
    for name, under in system.driving.deflections(times, frames).items():
        most = int(np.abs(under).argmax())
        values = {
            "deflection_peak": (under[most], "m"),
            "peak_time": (times[most], "s"),
            "deflection_end": (under[-1], "m"),
        }
        found |= {f"{name}.{key}": {"value": float(v), "unit": unit} for key, (v, unit) in values.items()}
    return found


def _leaving(system: System, end: Outcome) -> Json:
    """Return the velocity with which each body's centre of mass leaves, along what it can move."""
    found: Json = {}
    for name, body in system.bodies.items():
        if not body.rigid_count or system.scene.integrator not in LOCATED:
            continue
        columns = slice(system.offsets[name], system.offsets[name] + body.rigid_count)
        rates = [end.v[columns], end.q[columns] - system.position[columns], system.velocity[columns]]
        values = departure(*body.centre_motion(np.array(rates)))
        found |= {f"{name}.{key}": {"value": v, "unit": unit} for key, (v, unit) in values.items()}
    return found


def _of_samples(
    system: System, end: Outcome, dt: float, interval: float, forces: np.ndarray, along: np.ndarray, points: int
) -> dict[str, tuple[float, str]]:
    """Return what a history of resultants (s, 3) tells of a contact of so many points that pushes `along`."""
    touching = np.flatnonzero(np.abs(forces).sum(axis=1))
    first, last = end.extreme[4], end.extreme[5]
    if len(system.contacts) > 1:
        first, last = touching[0] * interval, (touching[-1] + 1) * interval - dt
    blows = sampled_blows(forces @ along, interval) if system.scene.integrator in LOCATED else np.empty((0, 7))
    values = blow_quantities(merged(blows, system.resolution)) if len(blows) else {}
    values |= {
        "force_peak": (float((forces @ along).max()), "N"),
        "start": (float(first), "s"),
        "duration": (float(last - first + dt), "s"),
    }
    return values | (smoothed_peak(forces @ along, interval, system.resolution) if points == 1 else {})


def _of_slips(changes: list[tuple[float, bool]]) -> dict[str, tuple[float, str]]:
    """Return when points begin to slip and when they stick again, the first few, and the last period."""
    values = {}
    for name, kind in (("slip", True), ("stick", False)):
        times = [time for time, begins in changes if begins is kind]
        values |= {f"{name}{number}": (time, "s") for number, time in enumerate(times[:SLIPS], 1)}
        if name == "slip" and len(times) > 1:
            values["slip_period"] = (times[-1] - times[-2], "s")
    return values


def _rebound(system: System, end: Outcome, contact: ContactRows, along: np.ndarray) -> dict[str, tuple[float, str]]:
    """Return how the body's centre leaves, seen from the other body's where there is one."""
    sides = [contact.body] if contact.other is None else [contact.body, contact.other.body]
    speeds = [np.array([_velocity(system, side, v) for v in (system.velocity, end.v)]) for side in sides]
    alone = len(system.contacts) == 1 and not any(system.scene.run.gravity) and not system.scene.force
    return rebound(along, speeds[0], speeds[1] if len(speeds) > 1 else None, alone)


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
        if not body.rigid_count:
            continue
        first = system.offsets[name]
        columns = slice(first, first + body.rigid_count)
        given, size, radius = _driven(system, name, loads, duration)
        for number, contact in enumerate(system.contacts):
            pushed, arm, length = _pressed(system, end, contact, number, name)
            given, size, radius = given + pushed, size + arm, max(radius, length)
        pulled = system.springs.rows[:, columns].T @ end.springs if len(end.springs) else 0.0
        if len(end.springs):
            size += float(np.abs(end.springs[np.any(system.springs.rows[:, columns], axis=1)]).sum())
        if size > 0:
            # Coordinates' own momentum against twist times wrench; what supports hold takes no part.
            error = np.abs(end.v[columns] - system.velocity[columns] + pulled - body.twists @ given)
            scale = np.linalg.norm(body.twists[:, :3], axis=1) + (radius or 1.0) * np.linalg.norm(
                body.twists[:, 3:], axis=1
            )
            worst = max(worst, float((error / scale).max()) / size)
    return worst


def _moment(arm: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return Σ arm × force of (c, 3) each, (3,)."""
    product = arm.T @ force
    return np.array(
        [product[1, 2] - product[2, 1], product[2, 0] - product[0, 2], product[0, 1] - product[1, 0]]
    )  # fmt: skip


def _pressed(
    system: System, end: Outcome, contact: ContactRows, number: int, name: str
) -> tuple[np.ndarray, float, float]:
    """Return impulse and moment about its centre that a contact gives a body, their size, and their largest arm [m]."""
    given, size, radius, centre = np.zeros(6), 0.0, 0.0, system.bodies[name].morph.centre
    impulses = end.impulses[contact.rows, None] * contact.directions
    friction = system.scene.contact[contact.name].friction
    if friction is not None and len(end.drags):
        line = np.asarray(friction.direction, float)
        impulses = impulses + end.drags[contact.rows, None] * line / np.linalg.norm(line)
    sides = [(contact.body, contact.points, 1.0)]
    if contact.other is not None:
        sides.append((contact.other.body, contact.other.points, -1.0))
    for owner, points, sign in sides:
        if owner == name:
            arm = points - centre
            radius = max(radius, float(np.sqrt((arm * arm).sum(axis=1).max())))
            given += sign * np.concatenate([impulses.sum(axis=0), _moment(arm, impulses)])
            size += float(np.linalg.norm(impulses.sum(axis=0)))
    if (over := contact.master) is not None:
        sign = (contact.body == name) - (over.body == name)
        given[:3] += sign * end.drag_impulse[number] * over.direction
        if over.body == name:
            wrench = -end.master_impulses[contact.functions] @ over.resultant
            given += np.concatenate([wrench[:3], wrench[3:] - np.cross(centre, wrench[:3])])
            size += float(np.linalg.norm(wrench[:3]))
    return given, size, radius


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
    wrenches += [loads[at] @ load.resultant for load, at in driving.given_rows() if load.body == name]
    for wrench in wrenches:
        moment = wrench[3:] - np.cross(centre, wrench[:3])
        given += np.concatenate([wrench[:3], moment])
        size += float(np.linalg.norm(wrench[:3]))
    given[:3] += duration * body.morph.mass * np.asarray(system.scene.run.gravity) if body.rigid_count else 0.0
    return given, size, radius
