"""From contacts between two bodies that turn, and of one with the ground by flexibility, to the arrays of their points
and surfaces."""

from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.modes import TractionModes
from gudgeon.modaldb.records.traction import heights
from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.errors import SceneError
from gudgeon.solver.integrators.turning.arrays import NONE, SURFACE
from gudgeon.solver.integrators.turning.flexible.frame import Frame
from gudgeon.solver.integrators.turning.touching.sections import (
    Section,
    belt_of,
    by_flexibility,
    rows_of,
    rubbing_of,
)
from gudgeon.solver.integrators.turning.touching.surfaces import WHOLE, Surfaces, no_surfaces
from gudgeon.solver.laws.base import Coefficients
from gudgeon.solver.methods import METHODS
from gudgeon.solver.obstacles import Bore, Plane
from gudgeon.solver.scene.contact import Contact, MasterSurface
from gudgeon.solver.system.system import System
from gudgeon.solver.vectors import frame_along, unit

DEEP = 0.25
"""Depth below which a point is on the other side of the body, over the smaller extent of the surface."""
ROOM = 1.05
"""Radius of a ball around undeformed points over what they need."""
NO_LAW = Coefficients(0.0, 1.0, 0.0, 0.0)


class Meeting(NamedTuple):
    """One contact between two bodies, or of one with a plane or bore of the ground by flexibility."""

    contact: ContactRows
    against: MasterSurface | Plane | Bore
    bodies: tuple[FlexibleBody, ...]
    """Of the points, and of the surface if it is of a body."""
    numbers: tuple[int, int]
    """The second one `NONE` of the ground."""
    frames: tuple[Frame, ...]
    space: TractionModes | None
    """None of the ground."""
    flexible: bool
    """Whether residual flexibility acts."""
    by_law: bool

    @property
    def compliance(self) -> np.ndarray:
        """R of each point along its normal [m/N], (c,)."""
        if not self.flexible:
            return np.zeros(len(self.contact.points))
        return self.bodies[0].residual(self.contact.interface, self.contact.interface).diagonal()


def meetings(system: System, frames: list[Frame]) -> list[Meeting]:
    """Return the contacts between two bodies of a scene whose bodies turn, and those by flexibility.

    Raises:
        SceneError: a surface is round, or a law is not what points press by.
    """
    result, names = [], list(system.bodies)
    for contact in system.contacts:
        settings = system.scene.contact[contact.name]
        against, b = settings.against, names.index(contact.body)
        flexible, body = METHODS[settings.method].flexible, system.bodies[contact.body]
        if isinstance(against, Plane | Bore):
            if not by_flexibility(settings, frames[b]):
                continue
            _check_law(contact.name, settings)
            result.append(Meeting(contact, against, (body,), numbers=(b, NONE), frames=(frames[b],), space=None,
                                 flexible=flexible, by_law=False))  # fmt: skip
            continue
        assert isinstance(against, MasterSurface)  # Others are refused with the scene.
        a = names.index(against.body)
        master = system.bodies[against.body]
        space = master.modal.tractions[against.interface]
        if space.chart["kind"] == "cylinder":
            raise SceneError(
                f"contact.{contact.name}.against.interface: '{against.interface}' is a traction space on a cylinder,"
                f" which points of bodies that turn cannot meet; give"
                f" component.{system.scene.component_of(against.body)}"
                f".interface.{against.interface}.along instead of sector_deg, which makes a patch of it"
            )
        if flexible:
            _check_law(contact.name, settings)
        result.append(
            Meeting(
                contact, against, (body, master), numbers=(b, a), frames=(frames[b], frames[a]),
                space=space, flexible=flexible, by_law=not flexible and settings.law is not None,
            )
        )  # fmt: skip
    return result


def _check_law(name: str, settings: Contact) -> None:
    """Raise a SceneError for a law that is more than a compliance beside R."""
    law = settings.law
    if law is None or (not settings.smooth_law and law.coefficients().damping == 0):
        return
    raise SceneError(
        f"contact.{name}.law: '{law.kind}'{' with damping' if law.kind == 'linear' else ''} given with method"
        " 'residual'; points of bodies that turn press by their flexibility and surface_stiffness, or by method"
        " 'penalty' with a law"
    )


def sections_of(found_pairs: list[Meeting], system: System) -> list[Section]:
    """Return the sections of all points, one after the other.

    Raises:
        SceneError: friction is not what bodies that turn have.
    """
    sections = []
    for pair in found_pairs:
        settings = system.scene.contact[pair.contact.name]
        if pair.by_law:
            laws = coefficients = [Coefficients(*map(float, row)) for row in system.law[pair.contact.rows]]
        else:
            laws = [NO_LAW] * len(pair.contact.points)
            soft = pair.compliance + system.layer[pair.contact.rows]
            coefficients = [Coefficients(1 / each, 1.0, 0.0, 0.0) for each in map(float, soft)]
        sections += [
            Section(pair.contact.name, (0.0, 0.0, 0.0), law,
                    rubbing_of(pair.contact.name, settings, point_law, pair.bodies[0]), belt_of(settings), SURFACE)
            for law, point_law in zip(laws, coefficients, strict=True)
        ]  # fmt: skip
    return sections


def surfaces_of(pairs: list[Meeting], system: System, elastic: int) -> Surfaces:
    """Return the arrays of all contacts between two bodies.

    Args:
        elastic: Largest number of elastic coordinates of a body.
    """
    if not pairs:
        return no_surfaces(elastic)
    tables = [_pair(m, system, elastic) for m in pairs]
    joined = {name: np.concatenate([t[name] for t in tables]) for name in tables[0]}
    for name, each in (("points", "arm"), ("functions", "outward")):
        ends = np.cumsum([0, *(len(t[each]) for t in tables)])
        joined[name] = np.column_stack([ends[:-1], ends[1:]])
    for column, each in ((2, "heights"), (3, "cover")):
        joined["cells"][:, column] = np.cumsum([0, *(len(t[each]) for t in tables)])[:-1]
    joined |= _flexibilities(pairs, joined)
    return Surfaces(**{
        name: np.ascontiguousarray(joined[name], np.int64 if name in WHOLE else float) for name in Surfaces._fields
    })  # fmt: skip


def _flexibilities(pairs: list[Meeting], joined: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return R among all points, among all functions, and between both."""
    p, f = len(joined["arm"]), len(joined["outward"])
    residual, compliance, mixed = np.zeros((p, p, 3, 3)), np.zeros((f, f)), np.zeros((p, 3, f))
    for a, meeting in enumerate(pairs):
        for b, partner in enumerate(pairs):
            if not (meeting.flexible and partner.flexible):
                continue
            span, points = slice(*joined["points"][a]), slice(*joined["points"][b])
            functions = slice(*joined["functions"][b])
            if meeting.numbers[0] == partner.numbers[0]:
                residual[span, points] = _between(meeting, partner)
            if meeting.numbers[1] == partner.numbers[1] != NONE:
                block = meeting.bodies[1].residual(_surface(meeting), _surface(partner))
                compliance[slice(*joined["functions"][a]), functions] = block
            if meeting.numbers[0] == partner.numbers[1]:
                mixed[span, :, functions] = _towards(meeting, _surface(partner))
    return {"residual": residual, "compliance": compliance, "mixed": mixed if mixed.any() else mixed[:0]}


def _surface(meeting: Meeting) -> str:
    """Return the interface of a body that is the surface."""
    assert isinstance(meeting.against, MasterSurface)
    return meeting.against.interface


def _between(meeting: Meeting, partner: Meeting) -> np.ndarray:
    """Return R between the points of two contacts of one body along its axes [m/N], (c, k, 3, 3)."""
    body, (a, b) = meeting.bodies[0], (meeting.contact.interface, partner.contact.interface)
    if body.modal.residual_flexibility is None:
        return np.zeros((len(meeting.contact.points), len(partner.contact.points), 3, 3))
    frame_a, frame_b = body.contact_frame(a), body.contact_frame(b)
    block = body.contact_residual(a, b).reshape(len(frame_a), 3, len(frame_b), 3)
    return np.einsum("pri,prqs,qsj->pqij", frame_a, block, frame_b)


def _towards(meeting: Meeting, surface: str) -> np.ndarray:
    """Return how outward forces on functions of their body move points along its axes [m/N], (c, 3, f)."""
    body, interface = meeting.bodies[0], meeting.contact.interface
    R, functions = body.modal.residual_flexibility, slice(*body.modal.interface_rows[surface])
    frame = body.contact_frame(interface)
    if R is None:
        return np.zeros((len(frame), 3, functions.stop - functions.start))
    block = R[body.contact_places(interface), functions].reshape(len(frame), 3, -1)
    return np.einsum("pri,prf->pif", frame, block)


def _pair(pair: Meeting, system: System, elastic: int) -> dict[str, np.ndarray]:
    """Return the arrays of one contact but those over all points or functions."""
    body = pair.bodies[0]
    c = len(pair.contact.points)
    arm, rows = pair.contact.points - body.morph.centre, np.zeros((c, 3, elastic))
    rows[:, :, : len(pair.frames[0].stiffness)] = rows_of(body, pair.frames[0], pair.contact)[:, :3]
    layer = system.layer[pair.contact.rows] if not pair.by_law else np.zeros(c)
    of_points = {
        "owner": np.array([pair.numbers]), "arm": arm, "rows": rows,
        "normal": body.modal.interfaces[pair.contact.interface].normals, "layer": layer,
        "by_law": np.array([pair.by_law]),
    }  # fmt: skip
    if pair.space is None:
        return of_points | _ground(pair, elastic)
    return of_points | _face(pair, pair.space, _ball(arm), elastic)


def _ground(meeting: Meeting, elastic: int) -> dict[str, np.ndarray]:
    """Return the arrays of a plane or bore of the ground, which has no functions."""
    against = meeting.against
    assert isinstance(against, Plane | Bore)
    if isinstance(against, Plane):
        axis, origin, radius = unit(against.normal), np.asarray(against.point, float), 0.0
    else:
        axis, origin, radius = unit(against.axis), np.asarray(against.origin, float), against.radius
    shapes = {"low": 2, "step": 2, "cells": 4, "start": 2, "spacing": 2, "counts": 2}
    return {name: np.zeros((1, size)) for name, size in shapes.items()} | {
        "origin": origin[None], "axes": frame_along(axis).T[None], "radius": np.array([radius]),
        "heights": np.zeros(0), "cover": np.zeros(0), "outward": np.zeros((0, elastic)),
        "balls": np.zeros((1, 2, 4)), "deep": np.array([np.inf]),
    }  # fmt: skip


def _face(meeting: Meeting, space: TractionModes, ball: np.ndarray, elastic: int) -> dict[str, np.ndarray]:
    """Return the arrays of the surface of a body.

    Args:
        ball: Around the points, (4,).
    """
    master, chart = meeting.bodies[1], space.chart
    outward = np.zeros((space.size, elastic))
    outward[:, : len(meeting.frames[1].stiffness)] = _outward(meeting, space)
    low, step, cells, height, cover = _height(space)
    centre = np.asarray(chart["origin"], float) - master.morph.centre
    axes = np.array([chart["across"], chart["along"], chart["normal"]], float)
    corners = low + step * np.stack(np.meshgrid(*(np.arange(n + 1) for n in cells), indexing="ij"), -1).reshape(-1, 2)
    lifted = heights(chart, corners) if chart["kind"] == "patch" else np.zeros(len(corners))
    positions = centre + np.column_stack([corners, lifted]) @ axes
    return {
        "origin": centre[None], "axes": axes[None], "radius": np.zeros(1), "low": low[None], "step": step[None],
        "cells": np.array([[*cells, 0, 0]]), "heights": height, "cover": cover, "start": space.start[None],
        "spacing": space.spacing[None], "counts": np.asarray(space.counts)[None], "outward": outward,
        "balls": np.array([[ball, _ball(positions)]]), "deep": np.array([DEEP * float((step * cells).min())]),
    }  # fmt: skip


def _outward(meeting: Meeting, space: TractionModes) -> np.ndarray:
    """Return the outward displacement of functions per elastic coordinate, relative to the body's frame, (f, m)."""
    frame, centre = meeting.frames[1], meeting.bodies[1].morph.centre
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
