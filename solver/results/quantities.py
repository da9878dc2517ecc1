"""Quantities of interest of a run."""

from collections.abc import Mapping

import numpy as np

from gudgeon.modaldb.records.types import Json
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.integrators.outcome import FIRST_CONTACT, LAST_CONTACT, Outcome
from gudgeon.solver.integrators.steps import Plan
from gudgeon.solver.results.contact_events import (
    Quantity,
    departure,
    impact_quantities,
    merged,
    rebound,
    sampled_impacts,
    smoothed_peak,
)
from gudgeon.solver.system.system import System

SLIPS = 3
"""Changes between sliding and sticking that have quantities of their own."""


def quantities(system: System, plan: Plan, end: Outcome, forces: np.ndarray, multipliers: np.ndarray) -> Json:
    """Return name → {"value", "unit"} for every contact, names led by the contact's.

    Args:
        forces: Mean resultants over each sample [N], (s, k, 3).
        multipliers: Contact forces at each frame [N], (f, c).
    """
    found, interval = Json(), plan.schedule.interval
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
        if contact.areas is not None and multipliers.size:
            pressure = multipliers[:, contact.rows] / contact.areas
            values["pressure_peak"] = (float(pressure.max()), "Pa")
        found |= _named(contact.name, values)
    return found | (_leaving(system, end) if plan.integrator.counts_impacts else {})


def deflections(system: System, times: np.ndarray, frames: np.ndarray) -> Json:
    """Return the displacement under each travelling force, along it: its largest, when, and the last one.

    Args:
        times: Of the frames [s], (f,).
        frames: Coordinates, (f, m).
    """
    found: Json = {}
    for name, under in system.driving.deflections(times, frames).items():
        most = int(np.abs(under).argmax())
        peak, late = (float(under[most]), "m"), (float(times[most]), "s")
        found |= _named(name, {"deflection_peak": peak, "peak_time": late, "deflection_end": (float(under[-1]), "m")})
    return found


def _named(owner: str, values: Mapping[str, Quantity]) -> Json:
    """Return quantities of a contact, force or body as they are recorded."""
    return {f"{owner}.{name}": {"value": value, "unit": unit} for name, (value, unit) in values.items()}


def _leaving(system: System, end: Outcome) -> Json:
    """Return the velocity with which each body's centre of mass leaves, along what it can move."""
    found: Json = {}
    for name, body in system.bodies.items():
        if not body.rigid_count:
            continue
        columns = slice(system.offsets[name], system.offsets[name] + body.rigid_count)
        rates = [end.v[columns], end.q[columns] - system.position[columns], system.velocity[columns]]
        found |= _named(name, departure(*body.centre_motion(np.array(rates))))
    return found


def _of_samples(
    system: System, plan: Plan, end: Outcome, contact: ContactRows, forces: np.ndarray, along: np.ndarray
) -> dict[str, Quantity]:
    """Return what a history of resultants (s, 3) tells of a contact that pushes `along`."""
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


def _of_slips(changes: list[tuple[float, bool]]) -> dict[str, Quantity]:
    """Return when points begin to slip and when they stick again, the first few, and the last period."""
    values = {}
    for name, kind in (("slip", True), ("stick", False)):
        times = [time for time, begins in changes if begins is kind]
        values |= {f"{name}{number}": (time, "s") for number, time in enumerate(times[:SLIPS], 1)}
        if name == "slip" and len(times) > 1:
            values["slip_period"] = (times[-1] - times[-2], "s")
    return values


def _rebound(system: System, end: Outcome, contact: ContactRows, along: np.ndarray) -> dict[str, Quantity]:
    """Return how the body's centre leaves, seen from the other body's where there is one."""
    sides = [contact.body] if contact.other is None else [contact.body, contact.other.body]
    speeds = [np.array([_velocity(system, side, v) for v in (system.velocity, end.v)]) for side in sides]
    alone = len(system.contacts) == 1 and not any(system.scene.run.gravity) and not system.scene.force
    return rebound(along, speeds[0], speeds[1] if len(speeds) > 1 else None, alone)


def _velocity(system: System, body: str, v: np.ndarray) -> np.ndarray:
    """Return the velocity of a body's centre of mass [m/s], (3,)."""
    first, item = system.offsets[body], system.bodies[body]
    return item.centre_motion(v[first : first + item.rigid_count])[:3]
