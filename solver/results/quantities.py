"""Quantities of a run: impulses, forces, times and velocities of its contacts and bodies."""

import numpy as np

from gudgeon.modaldb.records.types import Json
from gudgeon.solver.bodies.placing import own_vectors
from gudgeon.solver.contact.pressure import patches, pressure_peak
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.integrators.outcome import Outcome
from gudgeon.solver.results.contact_events import (
    Quantity,
    deflection,
    departure,
    impact_quantities,
    named,
    rebound,
    restitution,
)
from gudgeon.solver.system.system import System

SLIPS = 3
"""Number of changes between sliding and sticking that are quantities."""


def quantities(system: System, end: Outcome, states: tuple[np.ndarray, np.ndarray]) -> Json:
    """Return the quantities of all contacts and bodies, `CONTACT.name` or `BODY.name` → {"value", "unit"}.

    Args:
        states: Times of frames and peaks [s], (f,), and contact forces then [N], (f, c).
    """
    json, (times, multipliers) = Json(), states
    for i, contact in enumerate(system.contacts):
        impulse = (end.impulses[contact.rows, None] * contact.directions).sum(axis=0)
        size = float(np.linalg.norm(impulse))
        values = {"impulse": (size, "N s")}
        total = float(end.impulses[contact.rows].sum())
        if contact.edge.any() and total > 0:
            values["edge_share"] = (float(end.impulses[contact.rows][contact.edge].sum()) / total, "1")
        values |= impact_quantities(end.impacts[i], float(system.windows[i]))
        points = own_vectors(system.scene.body[contact.body], contact.points)
        if size > 0 and not system.scene.capabilities.turns:
            values |= _rebound(system, end, contact, impulse / size)
        if system.scene.contact[contact.name].friction is not None and len(end.rubbed):
            values["friction_work"] = (float(end.rubbed[i]), "J")
        if i < len(end.slips):
            values |= _of_slips(end.slips[i])
        if contact.areas is not None and multipliers.any():
            values |= _of_pressure((points, contact.areas), times, multipliers[:, contact.rows],
                                   end.impulses[contact.rows])  # fmt: skip
        if len(points) > 1 and np.any(multipliers[:, contact.rows]):
            values |= _of_area(points, contact.areas, multipliers[:, contact.rows])
        json |= named(contact.name, values)
    for name, jumps in end.jumps.items():
        values = {"basis_changes": (float(len(jumps)), "1"), "energy_jump": (max(jumps, default=0.0), "1")}
        json |= named(name, values)
    return json | _leaving(system, end)


def deflections(system: System, times: np.ndarray, frames: np.ndarray) -> Json:
    """Return the displacement under each moving force, along it: the largest one, its time, and the last one.

    Args:
        times: Of the frames [s], (f,).
        frames: Coordinates, (f, m).
    """
    driving, json = system.driving, Json()
    loads = driving.loads(times, 0.0)
    moved = frames @ driving.rows.T + loads @ driving.residual
    for load, rows in driving.given_rows():
        if load.travels:
            json |= named(load.name, deflection(times, loads[:, rows], moved[:, rows]))
    return json


def _leaving(system: System, end: Outcome) -> Json:
    """Return velocity and shift of each body's centre of mass at the end, along its free motions."""
    json: Json = {}
    for name, body in system.bodies.items():
        if not body.rigid_count:
            continue
        span = body.rigid
        rates = [end.v[span], end.q[span] - system.position[span], system.velocity[span]]
        json |= named(name, departure(*body.centre_motion(np.array(rates))))
    return json


def _of_pressure(
    surface: tuple[np.ndarray, np.ndarray], times: np.ndarray, multipliers: np.ndarray, impulses: np.ndarray
) -> dict[str, Quantity]:
    """Return the largest mean pressure over a patch, the patch's area, time and place; the share of slivers.

    Args:
        surface: The contact's points in the component's axes [m], (c, 3), and their areas [m²], (c,).
        times: [s], (f,)
        multipliers: Of the contact's points [N], (f, c).
        impulses: [N s], (c,)
    """
    points, areas = surface
    surface_patches = patches(points, areas)
    peak = pressure_peak(surface_patches, multipliers)
    values: dict[str, Quantity] = {
        "pressure_peak": (peak.pressure, "Pa"),
        "pressure_patch": (peak.area, "m^2"),
        "pressure_time": (float(times[peak.frame]), "s"),
    }
    values |= {f"pressure_{x}": (float(p), "m") for x, p in zip("xyz", points[peak.point], strict=True)}
    sliver_impulse = float(impulses[surface_patches.slivers].sum())
    return values | ({"sliver_share": (sliver_impulse / float(impulses.sum()), "1")} if sliver_impulse > 0 else {})


def _of_area(points: np.ndarray, areas: np.ndarray | None, multipliers: np.ndarray) -> dict[str, Quantity]:
    """Return the centre of pressure at the largest force, and the area that is pressed then where areas are known.

    Args:
        points: Of the contact, in the component's axes [m], (c, 3).
        areas: Of them [m²], (c,).
        multipliers: Of them [N], (f, c).
    """
    peak = multipliers[int(multipliers.sum(axis=1).argmax())]
    centre = peak @ points / peak.sum()
    values: dict[str, Quantity] = {f"centre_{x}": (float(c), "m") for x, c in zip("xyz", centre, strict=True)}
    if areas is not None:
        values["contact_area"] = (float(areas[peak > 0].sum()), "m^2")
    return values


def _of_slips(changes: list[tuple[float, bool]]) -> dict[str, Quantity]:
    """Return the first times at which points begin to slip and to stick, and the last slip period [s]."""
    values = {}
    for name, kind in (("slip", True), ("stick", False)):
        times = [time for time, begins in changes if begins is kind]
        values |= {f"{name}{i}": (time, "s") for i, time in enumerate(times[:SLIPS], 1)}
        if name == "slip" and len(times) > 1:
            values["slip_period"] = (times[-1] - times[-2], "s")
    return values


def _rebound(system: System, end: Outcome, contact: ContactRows, along: np.ndarray) -> dict[str, Quantity]:
    """Return the rebound velocities of the contact's bodies, and the restitution where nothing else acts on them.

    Without a restitution where the contact still pushes at the end, and without any where a body meets itself.
    """
    if contact.other is not None and contact.other.body == contact.body:
        return {}
    sides = [contact.body] if contact.other is None else [contact.body, contact.other.body]
    bodies = [system.bodies[side] for side in sides]
    speeds = [body.centre_motion(end.v[body.rigid])[:3] if body.rigid_count else None for body in bodies]
    values = rebound(along, speeds[0], speeds[1] if len(speeds) > 1 else None)
    scene, rigid = system.scene, system.rigid
    if len(system.contacts) > 1 or any(scene.run.gravity) or scene.force or scene.cranks():
        return values
    if (end.multipliers[contact.rows] * ~system.rigid_contact[contact.rows]).any():
        return values  # The impact goes on: the velocities after it are not known.
    rubbed = np.zeros(len(system.velocity))
    if end.drags.any():
        for name, _, _, points, sign in contact.sides:
            body = system.bodies[name]
            rubbed[body.rigid] += sign * body.rigid_rows(points, end.drags[contact.rows]).sum(axis=0)
    return values | restitution(system.velocity[rigid], end.v[rigid], rubbed[rigid])
