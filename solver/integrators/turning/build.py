"""The model of a compiled scene's mechanism: bodies, markers, terms of its joints, and their rows."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gudgeon.solver.bodies.placing import turned_vectors
from gudgeon.solver.bodies.small_motion import named
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.bushing import Bushing
from gudgeon.solver.forces.fields.electrostatic import Electrostatic, FieldForce
from gudgeon.solver.forces.given import GivenForce, GivenTorque, GivenWrench
from gudgeon.solver.forces.signals import Function
from gudgeon.solver.forces.spring import Spring
from gudgeon.solver.integrators.turning.arrays import (
    ALONG,
    ANGLE,
    DISTANCE,
    NONE,
    PUSHES,
    SQUARE,
    SUMS,
    WIDTH,
    Model,
)
from gudgeon.solver.integrators.turning.constraints.pattern import coupled, envelope, groups
from gudgeon.solver.integrators.turning.flexible.arrays import flexible_arrays
from gudgeon.solver.integrators.turning.flexible.frame import Frame, frame_of, point_of
from gudgeon.solver.integrators.turning.parts import Point, Row
from gudgeon.solver.integrators.turning.touching.meeting import Meeting, meetings, sections_of, surfaces_of
from gudgeon.solver.integrators.turning.touching.sections import Section, of_contact, of_journal, section_arrays
from gudgeon.solver.joints.clearance import Clearance
from gudgeon.solver.joints.coupled import Driven, Gear
from gudgeon.solver.joints.markers import Distance, Marked, Screw, Universal
from gudgeon.solver.joints.slider_crank import SliderCrank
from gudgeon.solver.system.system import System
from gudgeon.solver.vectors import frame_along, unit

Term = tuple[int, int, int, int]


@dataclass
class Linkage:
    """The parts of a mechanism while it is built."""

    system: System
    names: list[str]
    """Of the bodies."""
    centres: np.ndarray
    """Of mass, as the scene places the bodies [m], (n, 3)."""
    pairs: dict[str, int] = field(default_factory=dict)
    """Number of the pair of markers of each joint that has one."""
    markers: list[tuple[Point, Point]] = field(default_factory=list)
    axes: list[np.ndarray] = field(default_factory=list)
    frames: list[Frame] = field(default_factory=list)
    """Floating frames of the bodies."""
    terms: dict[Term, int] = field(default_factory=dict)
    rows: list[Row] = field(default_factory=list)
    drives: list[Function] = field(default_factory=list)
    """Motions that joints and points are given."""
    sections: list[Section] = field(default_factory=list)
    """What may touch: journals of joints with clearance, then points of contacts, those with other bodies last."""
    meetings: list[Meeting] = field(default_factory=list)
    """Contacts between two bodies, and with the ground by flexibility."""

    def point(
        self, body: str | None, position: tuple[float, float, float] | None, interface: str | None = None, key: str = ""
    ) -> Point:
        """Return a point of a body, or of the ground.

        Args:
            key: Key of the element that needs it.

        Raises:
            SceneError: the body deforms and no interface is given, or it has no such interface.
        """
        if body is None:
            return Point(NONE, np.asarray(position or (0.0, 0.0, 0.0), float))
        body_id, settings, flexible = self.names.index(body), self.system.scene.body[body], self.system.bodies[body]
        if interface is not None:
            named(flexible.modal.loads, interface, f"{key}: body '{body}' has no interface of kind 'mean' or 'tie'")
            return Point(body_id, *point_of(flexible, self.frames[body_id], interface))
        if len(self.frames[body_id].stiffness):
            raise SceneError(f"{key}: body '{body}' deforms; name an interface of it instead of a point")
        placed = turned_vectors(settings, position or (0.0, 0.0, 0.0)) + np.asarray(settings.position)
        return Point(body_id, placed - self.centres[body_id])

    def place(self, point: Point) -> np.ndarray:
        """Return where a point is as the scene places the bodies [m], (3,)."""
        return point.arm if point.owner == NONE else self.centres[point.owner] + point.arm

    def ends(self, element: Marked | Spring | Bushing | FieldForce, key: str) -> tuple[Point, Point]:
        """Return the point on the other side of an element, and its own; the former is at the latter by default."""
        near_end = self.point(element.body, element.at, element.interface, f"{key}.at")
        position = None if isinstance(element, Bushing | FieldForce) else element.against_at
        if position is not None or element.against_interface is not None:
            return self.point(element.against, position, element.against_interface, f"{key}.against_at"), near_end
        body_id, placed = NONE if element.against is None else self.names.index(element.against), self.place(near_end)
        if body_id == NONE:
            return Point(NONE, placed), near_end
        if m := len(self.frames[body_id].stiffness):
            raise SceneError(
                f"{key}.against_interface: is missing; body '{element.against}' deforms with {m} elastic coordinates:"
                " name an interface of it"
            )
        return Point(body_id, placed - self.centres[body_id]), near_end

    def term(self, *key: int) -> int:
        """Return the number of a term: kind, pair, axis of the other marker, axis of the own one."""
        full: Term = (*key, *(4 - len(key)) * (0,))  # type: ignore[assignment]
        return self.terms.setdefault(full, len(self.terms))

    def start_along(self, pair: int) -> float:
        """Return d along the third axis of the other marker as the scene places the bodies [m]."""
        a, b = self.markers[pair]
        return float((self.place(b) - self.place(a)) @ self.axes[pair][0][:, 2])


def linkage_of(system: System) -> Linkage:
    """Return the parts of a scene's mechanism.

    Raises:
        SceneError: a body cannot turn, a point does not fit its body, or a joint cannot be coupled or driven so.
    """
    scene = system.scene
    for name, body in system.bodies.items():
        if body.rigid_count < 6:
            raise SceneError(
                f"body.{name}: supports, freedom or an inertia of zero hold some of its rigid motions; integrator"
                " 'turning' holds bodies by joints alone, and needs all three moments of inertia"
            )
    centres = [np.asarray(scene.body[name].position) + body.morph.centre for name, body in system.bodies.items()]
    frames = [frame_of(body, scene.body[name]) for name, body in system.bodies.items()]
    linkage = Linkage(system, list(system.bodies), np.array(centres), frames=frames)
    for name, joint in scene.hinges().items():
        _add_hinge(linkage, name, joint)
    for name, joint in scene.cranks().items():
        _add_crank(linkage, name, joint)
    for name, joint in scene.joint.items():
        if isinstance(joint, Gear):
            _add_gear(linkage, name, joint)
        elif isinstance(joint, Driven):
            _add_drive(linkage, name, joint)
    for contact in system.contacts:
        for ends, axes, section in of_contact(contact, system, linkage.names, linkage.centres, linkage.frames):
            linkage.sections.append(section._replace(pair=len(linkage.markers)))
            linkage.markers.append(ends)
            linkage.axes.append(axes)
    linkage.meetings = meetings(system, frames)
    linkage.sections += sections_of(linkage.meetings, system)
    return linkage


def _add_hinge(linkage: Linkage, name: str, joint: Marked) -> None:
    pair = linkage.pairs[name] = len(linkage.markers)
    far_end, near_end = linkage.ends(joint, f"joint.{name}")
    third, thither = joint.axes
    frame = frame_along(thither)
    turned = frame_along(third) if isinstance(joint, Universal) else _shortest(thither, third) @ frame
    linkage.markers.append((far_end, near_end))
    linkage.axes.append(np.array([frame, turned]))
    if isinstance(joint, Clearance):
        linkage.sections += of_journal(name, joint, pair, linkage.system.bores.get(name))
    if isinstance(joint, Distance):
        distance = float(np.linalg.norm(linkage.place(near_end) - linkage.place(far_end)))
        if distance == 0:
            raise SceneError(f"joint.{name}: its two points coincide; a distance needs a direction")
        linkage.rows.append(Row(name, ((linkage.term(DISTANCE, pair), 1.0),), joint.length or distance, length=True))
        return
    linkage.rows += [Row(name, ((linkage.term(ALONG, pair, i), 1.0),), length=True) for i in joint.along]
    linkage.rows += [Row(name, ((linkage.term(SQUARE, pair, i, k), 1.0),)) for i, k in joint.squares]
    if joint.turns:
        linkage.term(ANGLE, pair)
    if isinstance(joint, Screw):
        terms = (linkage.term(ALONG, pair, 2), 1.0), (linkage.term(ANGLE, pair), -joint.pitch / (2 * np.pi))
        linkage.rows.append(Row(name, terms, linkage.start_along(pair), length=True))


def _add_crank(linkage: Linkage, name: str, joint: SliderCrank) -> None:
    """Add the rod of a slider-crank: the distance of a body's point from the crank pin, a driven point of the ground in
    the plane of the crank through the body's point."""
    pair = linkage.pairs[name] = len(linkage.markers)
    near_end = linkage.point(joint.body, joint.at, joint.interface, f"joint.{name}.at")
    normal, centre = np.cross(*joint.axes), np.asarray(joint.centre, float)
    pin = Point(NONE, centre + normal * (normal @ (linkage.place(near_end) - centre)), drive=len(linkage.drives))
    linkage.drives += [joint.pin(axis) for axis in range(3)]
    linkage.markers.append((pin, near_end))
    linkage.axes.append(np.array([np.eye(3), np.eye(3)]))
    linkage.rows.append(Row(name, ((linkage.term(DISTANCE, pair), 1.0),), joint.rod_length, length=True))


def _add_gear(linkage: Linkage, name: str, joint: Gear) -> None:
    for key, named_joint in (("joint", joint.joint), ("other", joint.other)):
        _check_motion(linkage, f"joint.{name}.{key}", named_joint, "angle")
    if joint.joint == joint.other:
        raise SceneError(f"joint.{name}.other: '{joint.other}' is also its joint; a gear couples two joints")
    term, partner_term = (linkage.term(ANGLE, linkage.pairs[key]) for key in (joint.joint, joint.other))
    linkage.rows.append(Row(name, ((term, 1.0), (partner_term, -joint.signed_ratio))))


def _add_drive(linkage: Linkage, name: str, joint: Driven) -> None:
    motion = joint.given(linkage.system.scene.hinges().get(joint.joint))
    _check_motion(linkage, f"joint.{name}.joint", joint.joint, motion)
    if (reason := joint.refusal(linkage.system.scene.run.duration)) is not None:
        raise SceneError(f"joint.{name}.{reason}")
    if (jump := joint.jump(linkage.system.scene.run.duration, f"joint.{name}")) is not None:
        raise SceneError(
            f"joint.{name}.expression: its {jump[0]} jumps at {jump[1]:.6g} s, which asks for an infinite acceleration;"
            " give a smooth motion"
        )
    pair, drive = linkage.pairs[joint.joint], len(linkage.drives)
    linkage.drives.append(joint.function(f"joint.{name}"))
    angle = motion == "angle"
    term = linkage.term(ANGLE, pair) if angle else linkage.term(ALONG, pair, 2)
    start = 0.0 if angle else linkage.start_along(pair)
    linkage.rows.append(Row(name, ((term, 1.0),), start, drive, length=not angle))


def _check_motion(linkage: Linkage, path: str, name: str, motion: str) -> None:
    """Raise a SceneError unless a joint leaves the motion that is to be coupled or driven."""
    hinges = linkage.system.scene.hinges()
    able = [key for key, h in hinges.items() if (h.turns if motion == "angle" else h.slides)]
    if name in able:
        return
    quantity = "an angle" if motion == "angle" else "a displacement"
    kind = f"of kind '{hinges[name].kind}' has none" if name in hinges else "does not exist"  # type: ignore[attr-defined]
    raise SceneError(f"{path}: joint '{name}' {kind}: {quantity} is needed; {', '.join(able) or 'no joint'} has one")


def _shortest(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the shortest rotation of a unit vector to another one less than 180 degrees away, (3, 3)."""
    v = np.cross(a, b)
    K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + K + K @ K / (1 + a @ b)


def model_of(linkage: Linkage) -> Model:
    """Return the arrays of a mechanism."""
    system, scene = linkage.system, linkage.system.scene
    bodies, size = list(system.bodies.values()), reach_of(linkage)
    springs = [(linkage.ends(s, f"force.{name}"), s) for name, s in scene.point_springs().items()]
    loads = scene.turning_loads()
    load_points = [_pressed(linkage, name, load) for name, load in loads.items()]
    bushings = [(linkage.ends(m, f"force.{name}"), m) for name, m in scene.six_motions().items()]
    points = [*(p for two in linkage.markers for p in two), *(p for ends, _ in springs for p in ends), *load_points,
              *(p for ends, _ in bushings for p in ends)]  # fmt: skip
    inertia = np.array([body.morph.inertia for body in bodies])
    frames = np.tile(np.eye(3), (len(points), 1, 1))
    for i, (_, force) in enumerate(bushings):
        if isinstance(force, FieldForce):
            start = len(points) - 2 * len(bushings) + 2 * i
            frames[start : start + 2] = force.axes()
    if linkage.axes:
        frames[: 2 * len(linkage.markers)] = np.array(linkage.axes).reshape(-1, 3, 3)
    return Model(
        mass=np.array([body.morph.mass for body in bodies]), inertia=inertia, inverse=np.linalg.inv(inertia),
        gravity=np.asarray(scene.run.gravity, float), size=size,
        point_owner=np.array([p.owner for p in points], np.int64), point_frame=frames,
        point_arm=np.array([p.arm for p in points], float).reshape(-1, 3),
        point_drive=np.array([p.drive for p in points], np.int64), **_row_arrays(linkage, size),
        spring=np.array([_law(linkage, ends, spring) for ends, spring in springs], float).reshape(-1, 3),
        load=np.array([_wrench(load) for load in loads.values()], float).reshape(-1, 6),
        **flexible_arrays(linkage.frames, points), **section_arrays(linkage.sections), **_bushings(linkage, bushings),
        surfaces=surfaces_of(linkage.meetings, system, max((len(f.stiffness) for f in linkage.frames), default=0)),
    )  # fmt: skip


def _row_arrays(linkage: Linkage, size: float) -> dict[str, Any]:
    """Return the arrays of the rows of joints; size: of the mechanism [m]."""
    rows = linkage.rows
    terms = [(*row.terms, (NONE, 0.0))[:2] for row in rows]
    row_terms = np.array([[t for t, _ in two] for two in terms], np.int64).reshape(-1, 2)
    kinds = np.array(list(linkage.terms), np.int64).reshape(-1, 4)
    owner = np.array([[p.owner for p in two] for two in linkage.markers], np.int64).reshape(-1, 2)
    pairs = coupled(row_terms, kinds, owner)
    return {
        "owner": owner, "terms": kinds, "row_terms": row_terms, "pairs": pairs, "envelope": envelope(pairs, len(rows)),
        "factors": np.array([[f for _, f in two] for two in terms], float).reshape(-1, 2),
        "constant": np.array([row.constant for row in rows], float),
        "drive_of": np.array([row.drive for row in rows], np.int64),
        "row_pair": np.array([linkage.pairs.get(row.joint, NONE) for row in rows], np.int64),
        "reach": np.array([size if row.length else 1.0 for row in rows], float),
        "group": groups([(row.joint, row.length) for row in rows]),
    }  # fmt: skip


def _bushings(linkage: Linkage, bushings: list[tuple[tuple[Point, Point], Bushing | FieldForce]]) -> dict[str, Any]:
    """Return the arrays of the bushings, whose axes are those of the scene at the start, and of fields."""
    nothing = np.zeros((6, 6))
    matrices = [b.matrices() if isinstance(b, Bushing) else (nothing, nothing) for _, b in bushings]
    fields = [isinstance(b, FieldForce) for _, b in bushings]
    return {
        "bush_field": np.where(fields, np.cumsum(fields) - 1, NONE).astype(np.int64),
        "fields": linkage.system.fields.energies,
        "bush_rest": np.array([_rest(linkage, ends, b) for ends, b in bushings]).reshape(-1, 3),
        "bush_stiffness": np.array([stiffness for stiffness, _ in matrices], float).reshape(-1, 6, 6),
        "bush_damping": np.array([damping for _, damping in matrices], float).reshape(-1, 6, 6),
    }


def _rest(linkage: Linkage, ends: tuple[Point, Point], element: Bushing | FieldForce) -> np.ndarray:
    """Return the way from the other point of a bushing or field to its own where its motion is zero [m], (3,)."""
    offset = linkage.place(ends[1]) - linkage.place(ends[0])
    if isinstance(element, FieldForce):
        offset = element.axes().T @ offset
    return offset - np.array(element.start) if isinstance(element, Electrostatic) else offset


def _pressed(linkage: Linkage, name: str, load: GivenForce | GivenTorque | GivenWrench) -> Point:
    """Return the point where a load acts.

    Raises:
        SceneError: it acts on no interface of a body that deforms, or is not finite over the run.
    """
    load.check(linkage.system.scene.run.duration, f"force.{name}")
    if isinstance(load, GivenTorque):
        if len(linkage.frames[linkage.names.index(load.body)].stiffness):
            raise SceneError(
                f"force.{name}.kind: 'torque' given, and body '{load.body}' deforms; give kind 'wrench' with a moment,"
                " at an interface of kind 'tie'"
            )
        return linkage.point(load.body, None)
    return linkage.point(load.body, load.at, load.interface, f"force.{name}.{'interface' if load.interface else 'at'}")


def _wrench(load: GivenForce | GivenTorque | GivenWrench) -> np.ndarray:
    """Return force and moment per unit of a load at its point, (6,)."""
    if isinstance(load, GivenWrench):
        return load.share()
    line = unit(load.direction)
    return np.concatenate([line, np.zeros(3)] if isinstance(load, GivenForce) else [np.zeros(3), line])


def _law(linkage: Linkage, ends: tuple[Point, Point], spring) -> tuple[float, float, float]:  # type: ignore[no-untyped-def]
    """Return stiffness, damping and the length without force of a spring between two points."""
    stiffness = spring.stiffness or 0.0
    length = spring.length
    if length is None:
        length = float(np.linalg.norm(linkage.place(ends[1]) - linkage.place(ends[0]))) - spring.stretch
    free = length - (spring.preload / stiffness if stiffness else 0.0)
    if free != 0 and np.array_equal(linkage.place(ends[0]), linkage.place(ends[1])):
        (name,) = (key for key, s in linkage.system.scene.point_springs().items() if s is spring)
        raise SceneError(
            f"force.{name}: its ends coincide at the start, where the force of a spring without force at"
            f" {free:.6g} m has no direction; move body.{spring.body}.position, or an end"
        )
    return stiffness, spring.damping, free


def reach_of(linkage: Linkage) -> float:
    """Return the size of a mechanism: the diagonal of the box of its centres and markers [m]."""
    positions = [*linkage.centres]
    positions += [linkage.place(point) for two in linkage.markers for point in two]
    size = float(np.linalg.norm(np.ptp(np.array(positions), axis=0)))
    gyration = max(
        float(np.sqrt(np.linalg.eigvalsh(body.morph.inertia)[-1] / body.morph.mass))
        for body in linkage.system.bodies.values()
    )
    return max(size, gyration)


def size_of(model: Model) -> int:
    """Return how many numbers a state has."""
    return WIDTH * len(model.mass) + 2 * int(model.elastic[:, 0].sum()) + PUSHES * len(model.touch_pair) + SUMS
