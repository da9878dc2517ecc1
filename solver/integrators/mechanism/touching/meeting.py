"""From contacts between two bodies that turn to the arrays of their points and surfaces."""

from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.modes import TractionModes
from gudgeon.modaldb.traction import heights
from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.mechanism.arrays import SURFACE
from gudgeon.solver.integrators.mechanism.flexible.frame import Frame
from gudgeon.solver.integrators.mechanism.touching.sections import Section, rows_of
from gudgeon.solver.integrators.mechanism.touching.surfaces import WHOLE, Surfaces, no_surfaces
from gudgeon.solver.laws.base import Coefficients
from gudgeon.solver.methods import METHODS
from gudgeon.solver.scene.contact import MasterSurface
from gudgeon.solver.system.system import System

DEEP = 0.25
"""Depth below which a point is on the other side of the body, over the smaller extent of the surface."""
ROOM = 1.05
"""Radius of a ball around undeformed points over what they need."""
NO_LAW = Coefficients(0.0, 1.0, 0.0, 0.0)


class Meeting(NamedTuple):
    """One contact between two bodies."""

    contact: ContactRows
    against: MasterSurface
    bodies: tuple[FlexibleBody, FlexibleBody]
    """Of the points and of the surface."""
    numbers: tuple[int, int]
    frames: tuple[Frame, Frame]
    space: TractionModes
    by_law: bool


def meetings(system: System, frames: list[Frame]) -> list[Meeting]:
    """Return the contacts between two bodies of a scene whose bodies turn.

    Raises:
        SceneError: a surface is round, or a law is not what points press by.
    """
    found, names = [], list(system.bodies)
    for contact in system.contacts:
        settings = system.scene.contact[contact.name]
        against = settings.against
        if not isinstance(against, MasterSurface):
            continue
        here, there = names.index(contact.body), names.index(against.body)
        own, other = system.bodies[contact.body], system.bodies[against.body]
        space = other.modal.tractions[against.interface]
        if space.chart["kind"] == "cylinder":
            raise SceneError(
                f"contact.{contact.name}.against.interface: '{against.interface}' is a traction space on a cylinder,"
                f" which points of bodies that turn cannot meet; give"
                f" component.{system.scene.component_of(against.body)}"
                f".interface.{against.interface}.along instead of sector_deg, which makes a patch of it"
            )
        flexible = METHODS[settings.method].flexible
        if flexible and settings.smooth_law:
            raise SceneError(
                f"contact.{contact.name}.law: '{settings.law.kind if settings.law else ''}' given with method"
                " 'residual'; points of bodies that turn press by their flexibility and surface_stiffness, or by method"
                " 'penalty' with a law"
            )
        found.append(
            Meeting(
                contact, against, (own, other), numbers=(here, there), frames=(frames[here], frames[there]),
                space=space, by_law=not flexible and settings.law is not None,
            )
        )  # fmt: skip
    return found


def sections_of(found: list[Meeting], system: System) -> list[Section]:
    """Return the sections of all points, one after the other."""
    sections = []
    for one in found:
        settings = system.scene.contact[one.contact.name]
        law = settings.law.coefficients() if one.by_law and settings.law is not None else NO_LAW
        rubbing = settings.friction
        friction = (rubbing.static, rubbing.speed or 1.0, 0.0, 0.0) if rubbing else (0.0, 1.0, 0.0, 0.0)
        same = Section(one.contact.name, (0.0, 0.0, 0.0), law, friction, SURFACE)
        sections += [same] * len(one.contact.points)
    return sections


def surfaces_of(found: list[Meeting], system: System, elastic: int) -> Surfaces:
    """Return the arrays of all contacts between two bodies.

    Args:
        elastic: Largest number of elastic coordinates of a body.
    """
    if not found:
        return no_surfaces(elastic)
    parts = [_pair(one, system, elastic) for one in found]
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    for name, each in (("points", "arm"), ("functions", "outward")):
        ends = np.cumsum([0, *(len(part[each]) for part in parts)])
        joined[name] = np.column_stack([ends[:-1], ends[1:]])
    for column, each in ((2, "heights"), (3, "cover")):
        joined["cells"][:, column] = np.cumsum([0, *(len(part[each]) for part in parts)])[:-1]
    p, f = len(joined["arm"]), len(joined["outward"])
    residual, compliance, mixed = np.zeros((p, p)), np.zeros((f, f)), np.zeros((p, f))
    for a, one in enumerate(found):
        for b, other in enumerate(found):
            if one.by_law or other.by_law:
                continue
            flexible = all(METHODS[system.scene.contact[m.contact.name].method].flexible for m in (one, other))
            if flexible and one.numbers[0] == other.numbers[0]:
                block = one.bodies[0].residual(one.contact.interface, other.contact.interface)
                residual[slice(*joined["points"][a]), slice(*joined["points"][b])] = block
            if flexible and one.numbers[1] == other.numbers[1]:
                block = one.bodies[1].residual(one.against.interface, other.against.interface)
                compliance[slice(*joined["functions"][a]), slice(*joined["functions"][b])] = block
            if flexible and one.numbers[0] == other.numbers[1]:
                block = one.bodies[0].residual(one.contact.interface, other.against.interface)
                mixed[slice(*joined["points"][a]), slice(*joined["functions"][b])] = block
    joined |= {"residual": residual, "compliance": compliance, "mixed": mixed if mixed.any() else mixed[:0]}
    return Surfaces(**{
        name: np.ascontiguousarray(joined[name], np.int64 if name in WHOLE else float) for name in Surfaces._fields
    })  # fmt: skip


def _pair(one: Meeting, system: System, elastic: int) -> dict[str, np.ndarray]:
    """Return the arrays of one contact but those over all points or functions."""
    own, other = one.bodies
    c, chart, space = len(one.contact.points), one.space.chart, one.space
    arm = one.contact.points - own.morph.centre
    rows, outward = np.zeros((c, 3, elastic)), np.zeros((space.size, elastic))
    rows[:, :, : len(one.frames[0].stiffness)] = rows_of(own, one.frames[0], one.contact)[:, :3]
    outward[:, : len(one.frames[1].stiffness)] = _outward(one)
    low, step, cells, height, cover = _height(space)
    layer = system.layer[one.contact.rows] if not one.by_law else np.zeros(c)
    centre = np.asarray(chart["origin"], float) - other.morph.centre
    axes = np.array([chart["across"], chart["along"], chart["normal"]], float)
    corners = low + step * np.stack(np.meshgrid(*(np.arange(n + 1) for n in cells), indexing="ij"), -1).reshape(-1, 2)
    lifted = heights(chart, corners) if chart["kind"] == "patch" else np.zeros(len(corners))
    places = centre + np.column_stack([corners, lifted]) @ axes
    return {
        "owner": np.array([one.numbers]), "arm": arm, "rows": rows,
        "normal": own.modal.interfaces[one.contact.interface].normals, "layer": layer,
        "by_law": np.array([one.by_law]), "origin": centre[None], "axes": axes[None], "low": low[None],
        "step": step[None], "cells": np.array([[*cells, 0, 0]]), "heights": height, "cover": cover,
        "start": space.start[None], "spacing": space.spacing[None], "counts": np.asarray(space.counts)[None],
        "outward": outward, "balls": np.array([[_ball(arm), _ball(places)]]),
        "deep": np.array([DEEP * float((step * cells).min())]),
    }  # fmt: skip


def _outward(one: Meeting) -> np.ndarray:
    """Return the outward displacement of functions per elastic coordinate, relative to the body's frame, (f, m)."""
    frame, space, centre = one.frames[1], one.space, one.bodies[1].morph.centre
    if not len(frame.stiffness):
        return np.zeros((space.size, 0))
    force, moment = space.resultant[:, :3], space.resultant[:, 3:]
    about = moment - np.cross(centre, force)
    return space.rows - force @ frame.shift - about @ frame.turn


def _height(space: TractionModes) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return least coordinates, steps and cells of a surface's height, its splines, and which cells have surface."""
    chart = space.chart
    if chart["kind"] == "patch":
        low, step, counts = (np.asarray(chart[key], float) for key in ("low", "step", "counts"))
        return low, step, counts.astype(int) - 3, np.asarray(chart["heights"], float), np.asarray(chart["cover"])
    extent = space.spacing * (space.counts - 3)
    return space.start, extent, np.ones(2, int), np.zeros(16), np.ones(1, int)


def _ball(points: np.ndarray) -> np.ndarray:
    """Return centre and radius of a ball around points (p, 3), (4,)."""
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    radius = ROOM * float(np.linalg.norm(points - centre, axis=1).max())
    return np.array([*centre, radius])
