"""Quantities of a run: impulses, forces, times and velocities of its contacts and bodies."""

import numpy as np

from gudgeon.modaldb.records.types import Json
from gudgeon.solver.contact.pressure import patches, pressure_peak
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.integrators.outcome import FIRST_CONTACT, LAST_CONTACT, Outcome
from gudgeon.solver.integrators.steps import Plan
from gudgeon.solver.results.contact_events import (
    Quantity,
    deflection,
    departure,
    impact_quantities,
    merged,
    named,
    rebound,
    sampled_impacts,
    smoothed_peak,
)
from gudgeon.solver.system.system import System

SLIPS = 3
"""Number of changes between sliding and sticking that are quantities."""


def quantities(
    system: System, plan: Plan, end: Outcome, forces: np.ndarray, states: tuple[np.ndarray, np.ndarray]
) -> Json:
    """Return the quantities of all contacts and bodies, `CONTACT.name` or `BODY.name` → {"value", "unit"}.

    Args:
        forces: Mean resultants over each sample [N], (s, k, 3).
        states: Times of frames and peaks [s], (f,), and contact forces then [N], (f, c).
    """
    found, interval, (times, multipliers) = Json(), plan.schedule.interval, states
    for number, contact in enumerate(system.contacts):
        impulse = (end.impulses[contact.rows, None] * contact.directions).sum(axis=0)
        size = float(np.linalg.norm(impulse))
        values = {"impulse": (size, "N s")}
        pressed = float(end.impulses[contact.rows].sum())
        if contact.edge.any() and pressed > 0:
            values["edge_share"] = (float(end.impulses[contact.rows][contact.edge].sum()) / pressed, "1")
        impacts = end.impacts[number] if number < len(end.impacts) else np.empty((0, 7))
        if size > 0:
            along = impulse / size
            if len(end.impacts):
                values |= impact_quantities(merged(impacts, system.resolution))
                if impacts[:, 3].max() > 0 and system.resolution >= interval:
                    values |= smoothed_peak(forces[:, number] @ along, interval, system.resolution)
            else:
                values |= _of_samples(system, plan, end, contact, forces[:, number], along)
            values |= _rebound(system, end, contact, along)
        if number < len(end.slips):
            values |= _of_slips(end.slips[number])
        if contact.areas is not None and multipliers.any():
            values |= _of_pressure(contact, times, multipliers[:, contact.rows], end.impulses[contact.rows])
        found |= named(contact.name, values)
    return found | (_leaving(system, end) if plan.integrator.counts_impacts else {})


def deflections(system: System, times: np.ndarray, frames: np.ndarray) -> Json:
    """Return the displacement under each moving force, along it: the largest one, its time, and the last one.

    Args:
        times: Of the frames [s], (f,).
        frames: Coordinates, (f, m).
    """
    driving, found = system.driving, Json()
    loads = driving.loads(times, 0.0)
    moved = frames @ driving.rows.T + loads @ driving.residual
    for load, at in driving.given_rows():
        if load.travels:
            found |= named(load.name, deflection(times, loads[:, at], moved[:, at]))
    return found


def _leaving(system: System, end: Outcome) -> Json:
    """Return velocity and shift of each body's centre of mass at the end, along its free motions."""
    found: Json = {}
    for name, body in system.bodies.items():
        if not body.rigid_count:
            continue
        own = body.rigid
        rates = [end.v[own], end.q[own] - system.position[own], system.velocity[own]]
        found |= named(name, departure(*body.centre_motion(np.array(rates))))
    return found


def _of_samples(
    system: System, plan: Plan, end: Outcome, contact: ContactRows, forces: np.ndarray, along: np.ndarray
) -> dict[str, Quantity]:
    """Return the quantities of a contact from its history of resultants [N], (s, 3), with mean direction `along`."""
    interval, dt = plan.schedule.interval, 0.0 if plan.integrator.own_steps else plan.schedule.dt
    pushed, touching = forces @ along, np.flatnonzero(np.abs(forces).sum(axis=1))
    first, last = end.extreme[FIRST_CONTACT], end.extreme[LAST_CONTACT]
    if len(system.contacts) > 1:
        first, last = touching[0] * interval, (touching[-1] + 1) * interval - dt
    impacts = sampled_impacts(pushed, interval) if plan.integrator.counts_impacts else np.empty((0, 7))
    values = impact_quantities(merged(impacts, system.resolution)) if len(impacts) else {}
    values |= {
        "force_peak": (float(pushed.max()), "N"),
        "start": (float(first), "s"),
        "duration": (float(last - first + dt), "s"),
    }
    return values | (smoothed_peak(pushed, interval, system.resolution) if len(contact.points) == 1 else {})


def _of_pressure(
    contact: ContactRows, times: np.ndarray, multipliers: np.ndarray, impulses: np.ndarray
) -> dict[str, Quantity]:
    """Return the largest mean pressure over a patch, the patch's area, time and place; the share of slivers.

    Args:
        times: [s], (f,)
        multipliers: Of the contact's points [N], (f, c).
        impulses: [N s], (c,)
    """
    assert contact.areas is not None
    over = patches(contact.points, contact.areas)
    most = pressure_peak(over, multipliers)
    values: dict[str, Quantity] = {
        "pressure_peak": (most.pressure, "Pa"),
        "pressure_patch": (most.area, "m^2"),
        "pressure_time": (float(times[most.frame]), "s"),
    }
    values |= {f"pressure_{x}": (float(at), "m") for x, at in zip("xyz", contact.points[most.point], strict=True)}
    share = float(impulses[over.slivers].sum())
    return values | ({"sliver_share": (share / float(impulses.sum()), "1")} if share > 0 else {})


def _of_slips(changes: list[tuple[float, bool]]) -> dict[str, Quantity]:
    """Return the first times at which points begin to slip and to stick, and the last slip period [s]."""
    values = {}
    for name, kind in (("slip", True), ("stick", False)):
        times = [time for time, begins in changes if begins is kind]
        values |= {f"{name}{number}": (time, "s") for number, time in enumerate(times[:SLIPS], 1)}
        if name == "slip" and len(times) > 1:
            values["slip_period"] = (times[-1] - times[-2], "s")
    return values


def _rebound(system: System, end: Outcome, contact: ContactRows, along: np.ndarray) -> dict[str, Quantity]:
    """Return the rebound velocities of the contact's bodies and the restitution, see `rebound`."""
    sides = [contact.body] if contact.other is None else [contact.body, contact.other.body]
    bodies, states = [system.bodies[side] for side in sides], (system.velocity, end.v)
    speeds = [np.array([body.centre_motion(v[body.rigid])[:3] for v in states]) for body in bodies]
    alone = len(system.contacts) == 1 and not any(system.scene.run.gravity) and not system.scene.force
    return rebound(along, speeds[0], speeds[1] if len(speeds) > 1 else None, alone)
