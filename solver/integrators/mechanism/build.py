"""The model of a compiled scene's mechanism: bodies, markers, terms of its joints, and their rows."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from gudgeon.solver.bodies.placing import turned_vectors
from gudgeon.solver.bodies.small_motion import named
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces.bushing import Bushing
from gudgeon.solver.forces.fields.co_energy import OUT, basis_shape
from gudgeon.solver.forces.fields.electrostatic import Electrostatic, FieldForce
from gudgeon.solver.forces.given import GivenForce, GivenTorque, GivenWrench
from gudgeon.solver.forces.spring import Spring
from gudgeon.solver.integrators.mechanism.arrays import (
    ALONG,
    ANGLE,
    CURL,
    DISTANCE,
    NONE,
    PUSHES,
    SQUARE,
    STAGES,
    SUMS,
    WIDTH,
    Model,
    Work,
)
from gudgeon.solver.integrators.mechanism.constraints.pattern import coupled, envelope, groups, is_thin
from gudgeon.solver.integrators.mechanism.flexible.arrays import flexible_arrays
from gudgeon.solver.integrators.mechanism.flexible.frame import Frame, frame_of, point_of
from gudgeon.solver.integrators.mechanism.parts import Point, Row
from gudgeon.solver.integrators.mechanism.touching.kernel import COLUMNS
from gudgeon.solver.integrators.mechanism.touching.meeting import Meeting, meetings, sections_of, surfaces_of
from gudgeon.solver.integrators.mechanism.touching.sections import Section, of_contact, of_journal, section_arrays
from gudgeon.solver.integrators.mechanism.touching.surfaces import pressing_of
from gudgeon.solver.joints.clearance import Clearance
from gudgeon.solver.joints.coupled import Driven, Gear
from gudgeon.solver.joints.markers import Distance, Marked, Screw, Universal
from gudgeon.solver.joints.slider_crank import SliderCrank
from gudgeon.solver.system.system import System
from gudgeon.solver.vectors import frame_along, unit

Term = tuple[int, int, int, int]
Drive = Callable[[np.ndarray], np.ndarray]
"""Motion, rate and second rate at times [s], (t,) → (t, 3)."""


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
    drives: list[Drive] = field(default_factory=list)
    sections: list[Section] = field(default_factory=list)
    """What may touch: journals of joints with clearance, then points of contacts, those with other bodies last."""
    meetings: list[Meeting] = field(default_factory=list)
    """Contacts between two bodies, and with the ground by flexibility."""

    def point(
        self, body: str | None, at: tuple[float, float, float] | None, interface: str | None = None, where: str = ""
    ) -> Point:
        """Return a point of a body, or of the ground.

        Args:
            where: Key of the element that needs it.

        Raises:
            SceneError: the body deforms and no interface is given, or it has no such interface.
        """
        if body is None:
            return Point(NONE, np.asarray(at or (0.0, 0.0, 0.0), float))
        number, settings, own = self.names.index(body), self.system.scene.body[body], self.system.bodies[body]
        if interface is not None:
            named(own.modal.loads, interface, f"{where}: body '{body}' has no interface of kind 'mean' or 'tie'")
            return Point(number, *point_of(own, self.frames[number], interface))
        if len(self.frames[number].stiffness):
            raise SceneError(f"{where}: body '{body}' deforms; name an interface of it instead of a point")
        place = turned_vectors(settings, at or (0.0, 0.0, 0.0)) + np.asarray(settings.position)
        return Point(number, place - self.centres[number])

    def place(self, point: Point) -> np.ndarray:
        """Return where a point is as the scene places the bodies [m], (3,)."""
        return point.arm if point.owner == NONE else self.centres[point.owner] + point.arm

    def ends(self, one: Marked | Spring | Bushing | FieldForce, where: str) -> tuple[Point, Point]:
        """Return the point on the other side of an element, and its own; the former is at the latter by default."""
        own = self.point(one.body, one.at, one.interface, f"{where}.at")
        at = None if isinstance(one, Bushing | FieldForce) else one.against_at
        if at is not None or one.against_interface is not None:
            return self.point(one.against, at, one.against_interface, f"{where}.against_at"), own
        number, place = NONE if one.against is None else self.names.index(one.against), self.place(own)
        if number == NONE:
            return Point(NONE, place), own
        if m := len(self.frames[number].stiffness):
            raise SceneError(
                f"{where}.against_interface: is missing; body '{one.against}' deforms with {m} elastic coordinates:"
                " name an interface of it"
            )
        return Point(number, place - self.centres[number]), own

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
                " 'mechanism' holds bodies by joints alone, and needs all three moments of inertia"
            )
    centres = [np.asarray(scene.body[name].position) + body.morph.centre for name, body in system.bodies.items()]
    frames = [frame_of(body, scene.body[name]) for name, body in system.bodies.items()]
    found = Linkage(system, list(system.bodies), np.array(centres), frames=frames)
    for name, joint in scene.hinges().items():
        _add_hinge(found, name, joint)
    for name, joint in scene.cranks().items():
        _add_crank(found, name, joint)
    for name, joint in scene.joint.items():
        if isinstance(joint, Gear):
            _add_gear(found, name, joint)
        elif isinstance(joint, Driven):
            _add_drive(found, name, joint)
    for contact in system.contacts:
        for ends, axes, section in of_contact(contact, system, found.names, found.centres, found.frames):
            found.sections.append(section._replace(pair=len(found.markers)))
            found.markers.append(ends)
            found.axes.append(axes)
    found.meetings = meetings(system, frames)
    found.sections += sections_of(found.meetings, system)
    return found


def _add_hinge(found: Linkage, name: str, joint: Marked) -> None:
    pair = found.pairs[name] = len(found.markers)
    other, own = found.ends(joint, f"joint.{name}")
    third, thither = joint.axes
    frame = frame_along(thither)
    turned = frame_along(third) if isinstance(joint, Universal) else _shortest(thither, third) @ frame
    found.markers.append((other, own))
    found.axes.append(np.array([frame, turned]))
    if isinstance(joint, Clearance):
        found.sections += of_journal(name, joint, pair, found.system.bores.get(name))
    if isinstance(joint, Distance):
        apart = float(np.linalg.norm(found.place(own) - found.place(other)))
        if apart == 0:
            raise SceneError(f"joint.{name}: its two points coincide; a distance needs a direction")
        found.rows.append(Row(name, ((found.term(DISTANCE, pair), 1.0),), joint.length or apart, length=True))
        return
    found.rows += [Row(name, ((found.term(ALONG, pair, i), 1.0),), length=True) for i in joint.along]
    found.rows += [Row(name, ((found.term(SQUARE, pair, i, k), 1.0),)) for i, k in joint.squares]
    if joint.turns:
        found.term(ANGLE, pair)
    if isinstance(joint, Screw):
        terms = (found.term(ALONG, pair, 2), 1.0), (found.term(ANGLE, pair), -joint.pitch / (2 * np.pi))
        found.rows.append(Row(name, terms, found.start_along(pair), length=True))


def _add_crank(found: Linkage, name: str, joint: SliderCrank) -> None:
    """Add the rod of a slider-crank: the distance of a body's point from the crank pin, a driven point of the ground in
    the plane of the crank through the body's point."""
    pair = found.pairs[name] = len(found.markers)
    own = found.point(joint.body, joint.at, joint.interface, f"joint.{name}.at")
    normal, centre = np.cross(*joint.axes), np.asarray(joint.centre, float)
    pin = Point(NONE, centre + normal * (normal @ (found.place(own) - centre)), drive=len(found.drives))
    found.drives += [partial(joint.pin_motion, axis=axis) for axis in range(3)]
    found.markers.append((pin, own))
    found.axes.append(np.array([np.eye(3), np.eye(3)]))
    found.rows.append(Row(name, ((found.term(DISTANCE, pair), 1.0),), joint.rod_length, length=True))


def _add_gear(found: Linkage, name: str, joint: Gear) -> None:
    for key, one in (("joint", joint.joint), ("other", joint.other)):
        _check_motion(found, f"joint.{name}.{key}", one, "angle")
    if joint.joint == joint.other:
        raise SceneError(f"joint.{name}.other: '{joint.other}' is also its joint; a gear couples two joints")
    one, other = (found.term(ANGLE, found.pairs[key]) for key in (joint.joint, joint.other))
    found.rows.append(Row(name, ((one, 1.0), (other, -joint.signed_ratio))))


def _add_drive(found: Linkage, name: str, joint: Driven) -> None:
    motion = joint.given(found.system.scene.hinges().get(joint.joint))
    _check_motion(found, f"joint.{name}.joint", joint.joint, motion)
    if (reason := joint.refusal(found.system.scene.run.duration)) is not None:
        raise SceneError(f"joint.{name}.{reason}")
    if (jump := joint.jump(found.system.scene.run.duration, f"joint.{name}")) is not None:
        raise SceneError(
            f"joint.{name}.expression: its {jump[0]} jumps at {jump[1]:.6g} s, which asks for an infinite acceleration;"
            " give a smooth motion"
        )
    pair, number = found.pairs[joint.joint], len(found.drives)
    found.drives.append(partial(joint.motions, where=f"joint.{name}"))
    angle = motion == "angle"
    term = found.term(ANGLE, pair) if angle else found.term(ALONG, pair, 2)
    start = 0.0 if angle else found.start_along(pair)
    found.rows.append(Row(name, ((term, 1.0),), start, number, length=not angle))


def _check_motion(found: Linkage, where: str, name: str, motion: str) -> None:
    """Raise a SceneError unless a joint leaves the motion that is to be coupled or driven."""
    hinges = found.system.scene.hinges()
    able = [key for key, one in hinges.items() if (one.turns if motion == "angle" else one.slides)]
    if name in able:
        return
    what = "an angle" if motion == "angle" else "a displacement"
    kind = f"of kind '{hinges[name].kind}' has none" if name in hinges else "does not exist"  # type: ignore[attr-defined]
    raise SceneError(f"{where}: joint '{name}' {kind}: {what} is needed; {', '.join(able) or 'no joint'} has one")


def _shortest(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the shortest rotation of a unit vector to another one less than 180 degrees away, (3, 3)."""
    v = np.cross(one, other)
    K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + K + K @ K / (1 + one @ other)


def model_of(found: Linkage) -> Model:
    """Return the arrays of a mechanism."""
    system, scene = found.system, found.system.scene
    bodies, size = list(system.bodies.values()), reach_of(found)
    springs = [(found.ends(one, f"force.{name}"), one) for name, one in scene.point_springs().items()]
    loads = scene.turning_loads()
    pressed = [_pressed(found, name, one) for name, one in loads.items()]
    bushings = [(found.ends(one, f"force.{name}"), one) for name, one in scene.six_motions().items()]
    points = [*(p for two in found.markers for p in two), *(p for ends, _ in springs for p in ends), *pressed,
              *(p for ends, _ in bushings for p in ends)]  # fmt: skip
    inertia = np.array([body.morph.inertia for body in bodies])
    frames = np.tile(np.eye(3), (len(points), 1, 1))
    for number, (_, force) in enumerate(bushings):
        if isinstance(force, FieldForce):
            first = len(points) - 2 * len(bushings) + 2 * number
            frames[first : first + 2] = force.axes()
    if found.axes:
        frames[: 2 * len(found.markers)] = np.array(found.axes).reshape(-1, 3, 3)
    return Model(
        mass=np.array([body.morph.mass for body in bodies]), inertia=inertia, inverse=np.linalg.inv(inertia),
        gravity=np.asarray(scene.run.gravity, float), size=size,
        point_owner=np.array([p.owner for p in points], np.int64), point_frame=frames,
        point_arm=np.array([p.arm for p in points], float).reshape(-1, 3),
        point_drive=np.array([p.drive for p in points], np.int64), **_row_arrays(found, size),
        spring=np.array([_law(found, ends, one) for ends, one in springs], float).reshape(-1, 3),
        load=np.array([_wrench(one) for one in loads.values()], float).reshape(-1, 6),
        **flexible_arrays(found.frames, points), **section_arrays(found.sections), **_bushings(found, bushings),
        surfaces=surfaces_of(found.meetings, system, max((len(one.stiffness) for one in found.frames), default=0)),
    )  # fmt: skip


def _row_arrays(found: Linkage, size: float) -> dict[str, Any]:
    """Return the arrays of the rows of joints; size: of the mechanism [m]."""
    rows = found.rows
    terms = [(*row.terms, (NONE, 0.0))[:2] for row in rows]
    row_terms = np.array([[t for t, _ in two] for two in terms], np.int64).reshape(-1, 2)
    kinds = np.array(list(found.terms), np.int64).reshape(-1, 4)
    owner = np.array([[p.owner for p in two] for two in found.markers], np.int64).reshape(-1, 2)
    pairs = coupled(row_terms, kinds, owner)
    return {
        "owner": owner, "terms": kinds, "row_terms": row_terms, "pairs": pairs, "envelope": envelope(pairs, len(rows)),
        "factors": np.array([[f for _, f in two] for two in terms], float).reshape(-1, 2),
        "constant": np.array([row.constant for row in rows], float),
        "drive_of": np.array([row.drive for row in rows], np.int64),
        "row_pair": np.array([found.pairs.get(row.joint, NONE) for row in rows], np.int64),
        "reach": np.array([size if row.length else 1.0 for row in rows], float),
        "group": groups([(row.joint, row.length) for row in rows]),
    }  # fmt: skip


def _bushings(found: Linkage, bushings: list[tuple[tuple[Point, Point], Bushing | FieldForce]]) -> dict[str, Any]:
    """Return the arrays of the bushings, whose axes are those of the scene at the start, and of fields."""
    nothing = np.zeros((6, 6))
    matrices = [one.matrices() if isinstance(one, Bushing) else (nothing, nothing) for _, one in bushings]
    fields = [isinstance(one, FieldForce) for _, one in bushings]
    return {
        "bush_field": np.where(fields, np.cumsum(fields) - 1, NONE).astype(np.int64),
        "fields": found.system.fields.energies,
        "bush_rest": np.array([_rest(found, ends, one) for ends, one in bushings]).reshape(-1, 3),
        "bush_stiffness": np.array([stiffness for stiffness, _ in matrices], float).reshape(-1, 6, 6),
        "bush_damping": np.array([damping for _, damping in matrices], float).reshape(-1, 6, 6),
    }


def _rest(found: Linkage, ends: tuple[Point, Point], one: Bushing | FieldForce) -> np.ndarray:
    """Return the way from the other point of a bushing or field to its own where its motion is zero [m], (3,)."""
    apart = found.place(ends[1]) - found.place(ends[0])
    if isinstance(one, FieldForce):
        apart = one.axes().T @ apart
    return apart - np.array(one.start) if isinstance(one, Electrostatic) else apart


def _pressed(found: Linkage, name: str, load: GivenForce | GivenTorque | GivenWrench) -> Point:
    """Return the point where a load acts.

    Raises:
        SceneError: it acts on no interface of a body that deforms, or is not finite over the run.
    """
    load.check(found.system.scene.run.duration, f"force.{name}")
    if isinstance(load, GivenTorque):
        if len(found.frames[found.names.index(load.body)].stiffness):
            raise SceneError(
                f"force.{name}.kind: 'torque' given, and body '{load.body}' deforms; give kind 'wrench' with a moment,"
                " at an interface of kind 'tie'"
            )
        return found.point(load.body, None)
    return found.point(load.body, load.at, load.interface, f"force.{name}.{'interface' if load.interface else 'at'}")


def _wrench(load: GivenForce | GivenTorque | GivenWrench) -> np.ndarray:
    """Return force and moment per unit of a load at its point, (6,)."""
    if isinstance(load, GivenWrench):
        return load.share()
    line = unit(load.direction)
    return np.concatenate([line, np.zeros(3)] if isinstance(load, GivenForce) else [np.zeros(3), line])


def _law(found: Linkage, ends: tuple[Point, Point], spring) -> tuple[float, float, float]:  # type: ignore[no-untyped-def]
    """Return stiffness, damping and the length without force of a spring between two points."""
    stiffness = spring.stiffness or 0.0
    length = spring.length
    if length is None:
        length = float(np.linalg.norm(found.place(ends[1]) - found.place(ends[0]))) - spring.stretch
    free = length - (spring.preload / stiffness if stiffness else 0.0)
    if free != 0 and np.array_equal(found.place(ends[0]), found.place(ends[1])):
        (name,) = (key for key, one in found.system.scene.point_springs().items() if one is spring)
        raise SceneError(
            f"force.{name}: its ends coincide at the start, where the force of a spring without force at"
            f" {free:.6g} m has no direction; move body.{spring.body}.position, or an end"
        )
    return stiffness, spring.damping, free


def reach_of(found: Linkage) -> float:
    """Return the size of a mechanism: the diagonal of the box of its centres and markers [m]."""
    places = [*found.centres]
    places += [found.place(point) for two in found.markers for point in two]
    size = float(np.linalg.norm(np.ptp(np.array(places), axis=0)))
    gyration = max(
        float(np.sqrt(np.linalg.eigvalsh(body.morph.inertia)[-1] / body.morph.mass))
        for body in found.system.bodies.values()
    )
    return max(size, gyration)


def size_of(model: Model) -> int:
    """Return how many numbers a state has."""
    return WIDTH * len(model.mass) + 2 * int(model.elastic[:, 0].sum()) + PUSHES * len(model.touch_pair) + SUMS


def work_of(model: Model, drives: int) -> Work:
    """Return work arrays of a model with a number of drives."""
    n, m, t, p, e = len(model.mass), len(model.row_terms), len(model.terms), *model.point_rows.shape[::2]
    size, c, u = size_of(model), len(model.touch_pair), len(model.bush_rest)
    shapes = {
        "turn": (n, 3, 3), "omega": (n, 3), "back": (n, 3, 3), "rate": (n, 6 + e), "push": (n, 6 + e), "value": (t,),
        "bend": (t,), "slope": (t, 2, 6), "turned": (t,), "block_owner": (m, 4), "block": (m, 4, 6 + e),
        "light": (m, 4, 6 + e), "matrix": (m, m), "lower": (m, m), "scale": (m,), "order": (m,), "begin": (m,),
        "end": (m,), "within": (1,), "left": (m,), "rank": (1,), "least": (1,), "right": (m,), "multiplier": (m,),
        "small": (m, m), "spare": (2, m), "slopes": (STAGES, size), "stage": (size,), "lost": (SUMS,),
        "given": (drives, 3), "place": (p, 3), "arm": (p, 3), "speed": (p, 3), "drift": (p, 3), "spin": (p, 3),
        "spin_drift": (p, 3), "axes": (p, 3, 3), "point_rows": (p, 6, e), "local": (p, 3, 6), "curved": (e,),
        "moving": (e,),
        "moment": (n, CURL + 3, e), "moment_rate": (n, 3, e), "second": (n, CURL), "coupling": (n, 3, e),
        "root": (n, 3, 3), "modal": (n, 3 + e),
        "inner_force": (n, e), "across": (n, e), "light_error": (3 + e,), "touching": (c,), "slipping": (c,),
        "deflection": (c, 2), "approach": (c,), "shift": (c,), "touch": (c, COLUMNS), "bush": (u, 12),
        "bush_push": (u, 6),
        "field": (len(model.fields.head), OUT), "field_basis": basis_shape(model.fields),
    }  # fmt: skip
    whole = ("block_owner", "order", "begin", "end", "within", "rank", "touching", "slipping")
    arrays = {name: np.zeros(shape, np.int64 if name in whole else float) for name, shape in shapes.items()}
    found = Work(**arrays, pressing=pressing_of(model.surfaces))
    found.within[0] = is_thin(model.envelope)
    return found
