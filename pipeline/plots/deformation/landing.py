"""Bodies that meet planes, or one another, as films show them: rigid motion and deformation each magnified for itself.

A body bounces over far more than it deforms. Its drawn points are shifted along the normal of each plane that presses
on it until the lowest of them is as high above the plane as its own gap, magnified like the rigid motion: bodies that
touch are drawn touching. Two bodies that meet are shifted alike, each by half, by the least gap between points that
face each other.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gudgeon.pipeline.plots.base import style
from gudgeon.pipeline.plots.base.hardest import Hardest
from gudgeon.pipeline.plots.base.run import BodyMotion, Drawing
from gudgeon.pipeline.plots.deformation.obstacle import planes_of
from gudgeon.solver.obstacles.plane import Plane
from gudgeon.solver.vectors import length_across, unit

APART = 0.15
"""Largest drawn way of two bodies that meet, relative to the smaller one: the gap between them is seen."""


@dataclass(frozen=True)
class Facing:
    """Points of two bodies that face each other."""

    sides: tuple[BodyMotion, BodyMotion]
    """Their motion, of as many points each."""
    positions: tuple[np.ndarray, np.ndarray]
    """Of the bodies' origins in the scene [m], (3,) each."""
    normal: np.ndarray
    """Unit vector from the first to the second, (3,)."""
    offsets: np.ndarray
    """Gap between the true surfaces less that of the points: of beams, whose axes are drawn [m], (p,)."""

    def side(self, body: str) -> float:
        """Return −1 of the first body, 1 of the second one, and 0 of another."""
        return {self.sides[0].name: -1.0, self.sides[1].name: 1.0}.get(body, 0.0)

    def gap(self, points: Sequence[np.ndarray]) -> float:
        """Return the least gap between places of the points of both sides, (p, 3) each [m]."""
        return float(((points[1] - points[0]) @ self.normal + self.offsets).min())


@dataclass(frozen=True)
class Landing:
    """Rigid motion beside planes, or of two bodies that meet."""

    planes: Mapping[str, list[Plane]]
    """Those that press on a body, by its name."""
    facing: Facing | None
    """The two bodies that meet."""
    origin: int
    """Frame in which bodies are where they are."""
    scale: float
    """Factor of rigid motion and gaps."""

    def places(self, body: BodyMotion, position: np.ndarray, frame: int, scale: float) -> np.ndarray:
        """Return where the points of a body are drawn at a frame [m], (p, 3), its deformation magnified by `scale`."""
        still, drawn = body.nodes + position, self._enlarged(body, position, frame, scale)
        for plane in self.planes.get(body.name, ()):
            height = self.scale * _gap(plane, still + body.total(frame))
            drawn = drawn + (height - plane.gap(drawn).min()) * plane.direction(drawn)
        if self.facing is not None and (side := self.facing.side(body.name)):
            pair = [*zip(self.facing.sides, self.facing.positions, strict=True)]
            gap = max(self.facing.gap([b.nodes + p + b.total(frame) for b, p in pair]), 0.0)
            drawn_gap = self.facing.gap([self._enlarged(b, p, frame, scale) for b, p in pair])
            drawn = drawn + 0.5 * side * (self.scale * gap - drawn_gap) * self.facing.normal
        return drawn

    def _enlarged(self, body: BodyMotion, position: np.ndarray, frame: int, scale: float) -> np.ndarray:
        origin = body.rigid(self.origin)
        rigid = origin + self.scale * (body.rigid(frame) - origin)
        return body.nodes + position + rigid + scale * body.elastic(frame)


def landing(
    drawing: Drawing, bodies: Sequence[tuple[BodyMotion, np.ndarray]], frames: np.ndarray, origin: int,
    strongest: Hardest | None,
) -> Landing | None:  # fmt: skip
    """Return how the rigid motion of bodies is drawn, with the position of each [m]; None where one meets more than
    whole planes, or other contacts than those of two bodies with points that face each other."""
    contacts = [contact["against"] for contact in drawing.scene.get("contact", {}).values()]
    facing = _only_pair(drawing, strongest)
    if facing is None and any(against["shape"] != "plane" or against.get("edges") for against in contacts):
        return None
    planes, travel = planes_of(drawing, acting=True) if facing is None else {}, [0.0]
    for body, position in bodies:
        travel += [float(np.linalg.norm(body.rigid(frame) - body.rigid(origin), axis=1).max()) for frame in frames]
        for plane in planes.get(body.name, ()):
            travel += [_gap(plane, body.nodes + position + body.total(frame)) for frame in frames]
    smallest = min((body.size for body, _ in bodies if body.size > 0), default=0.0)
    shown = style.SHOWN if facing is None else APART
    return Landing(planes, facing, origin, style.nice_scale(shown * smallest, max(travel)))


def _only_pair(drawing: Drawing, strongest: Hardest | None) -> Facing | None:
    """Return the points of the only two bodies that meet in a scene; None where others or obstacles are met."""
    contacts = drawing.scene.get("contact", {}).values()
    pairs = {frozenset((contact["body"], contact["against"].get("body"))) for contact in contacts}
    meets = all(contact["against"]["shape"] == "body" for contact in contacts)
    if strongest is None or not meets or [len(pair) for pair in pairs] != [2]:
        return None
    return facing_points(drawing, strongest.contact)


def fitting_scale(drawing: Drawing, body: BodyMotion, frame: int, scale: float) -> float:
    """Return the factor, at most `scale` and at least 1, at which a body that meets itself is not drawn through itself
    at a frame."""
    for name, contact in drawing.scene.get("contact", {}).items():
        if {contact["body"], contact["against"].get("body")} == {body.name}:
            facing = facing_points(drawing, name)
            if facing is not None:
                sides = facing.sides
                gaps = (sides[1].nodes - sides[0].nodes) @ facing.normal + facing.offsets
                closing = (sides[0].elastic(frame) - sides[1].elastic(frame)) @ facing.normal
                room = (gaps[closing > 0] / closing[closing > 0]).min(initial=np.inf)
                scale = min(scale, style.nice_scale(max(float(room), 1.0), 1.0))
    return scale


def facing_points(drawing: Drawing, name: str) -> Facing | None:
    """Return the points of a contact between two bodies, or of one with itself, each with the point of the other side
    that is closest across the normal; None where a side has no points."""
    settings = drawing.scene["contact"][name]
    names = settings["body"], settings["against"]["body"]
    interfaces = settings["interface"], settings["against"]["interface"]
    bodies = [drawing.body(name) for name in names]
    if not all(key in body.modal.interfaces for key, body in zip(interfaces, bodies, strict=True)):
        return None
    nodes = [body.modal.interfaces[key].nodes for key, body in zip(interfaces, bodies, strict=True)]
    positions = drawing.position(names[0]), drawing.position(names[1])
    if not all(map(len, nodes)):
        return None
    forces = drawing.trajectory.contacts[name].multipliers.max(axis=0)
    normals = bodies[0].modal.interfaces[interfaces[0]].normals
    normal = unit(forces @ normals if len(forces) == len(normals) and forces.any() else normals.mean(axis=0))
    points, faced = (body.nodes[rows] + p for body, rows, p in zip(bodies, nodes, positions, strict=True))
    closest = [int(length_across(faced - point, normal).argmin()) for point in points]
    sides = [*zip(bodies, interfaces, nodes, strict=True)]
    surface = [body.modal.interfaces[key].points - body.nodes[rows] for body, key, rows in sides]
    offsets = (surface[1][closest] - surface[0]) @ normal
    return Facing((_at(bodies[0], nodes[0]), _at(bodies[1], nodes[1][closest])), positions, normal, offsets)


def _at(body: BodyMotion, nodes: np.ndarray) -> BodyMotion:
    """Return the motion of some nodes of a body, (k,)."""
    modes = len(body.modal.angular_frequencies)
    shapes = body.modal.shapes
    if shapes is None or not shapes.size:
        shapes = np.zeros((len(body.nodes), 3, modes))
    return body.on(body.nodes[nodes], shapes[nodes])


def _gap(plane: Plane, points: np.ndarray) -> float:
    """Return the smallest gap of points to a plane [m]; of points behind it, as a compressed layer has them, zero."""
    return max(float(plane.gap(points).min()), 0.0)
