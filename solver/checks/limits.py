"""Where a run leaves the range of its model: rotations, deflections, lateral offsets, slip across a line of friction.

Motion is small: rows, gaps and directions are those of the bodies as they are placed, and Euler's equations are without
their gyroscopic terms. A rotation by θ changes a gap at a distance r by ½ r θ², 0.1 % of r at the default limit.

The rotation by bending is estimated by the elastic deflection over the size of the body. Modes are mass-orthonormal, so
its root mean square over the mass is |q|/√m, and the size is the radius of gyration. A uniform cantilever of length L
whose end deflects by w has 1.7 w/L, and its end turns by 1.4 w/L; a beam on two supports has 2.4 w/L and π w/L.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from gudgeon.solver.checks.faces import Faces
from gudgeon.solver.contact.pairs import ASIDE
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.integrators.outcome import Samples
from gudgeon.solver.obstacles import Bore, Plane
from gudgeon.solver.result import Result
from gudgeon.solver.scene.run import SMALL_ROTATION
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.system.friction import ACROSS, lines
from gudgeon.solver.system.friction import ROUND_OFF as VELOCITY_ROUND_OFF
from gudgeon.solver.system.system import System

BALL = 1e-9
"""Relative difference of the moments of inertia of a ball, and distance of normals from its centre by its radius."""
ROUND_OFF = 1e-9
"""Offset relative to the displacement of a point that is round-off."""


class Exit(NamedTuple):
    """How and when a run left the range of its model."""

    result: Result
    sentence: str


class Aside(NamedTuple):
    """The lateral offset of one contact's points. c: points, r: rigid coordinates of the system."""

    name: str
    number: int
    rows: np.ndarray
    """Relative displacement along two directions in which the surfaces curve or pair, then the normal, (3, c, r)."""
    reach: np.ndarray
    """Largest displacement of any point along both directions, (r, 2)."""
    limit: float
    """[m]"""
    cause: str
    touching: bool
    """Whether the offset matters only while they touch: a gap does not change by it."""

    def sentence(self, offset: float, time: float) -> str:
        """Return the reason for the end of a run in which the points moved aside by an offset [m] at a time [s]."""
        wrong = "the gap is measured along the normal of the start"
        if self.touching:
            wrong = "the force acts on the points that faced each other at the start"
        return (
            f"the points of contact '{self.name}' moved aside by {offset:.3g} m at {time:.6g} s, beyond {self.cause}"
            f" = {self.limit:.3g} m: {wrong}; shorten run.duration, hold the lateral motion by body.NAME.freedom, or"
            " raise run.limits.offset"
        )


class Limits:
    """The limits of a system's model, tested frame by frame."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._faces = Faces(system)
        self._contacts = list(_offsets(system))
        self._reach = np.array([c.reach for c in self._contacts]).reshape(len(self._contacts), len(system.rigid), 2)
        self._offsets = np.array([c.limit for c in self._contacts])
        self._lines = list(lines(system))
        self._sizes = [body.gyration for body in system.bodies.values()]
        masses = np.array([body.morph.mass for body in system.bodies.values()])
        self._squares = masses * (system.scene.run.limits.angle * np.array(self._sizes)) ** 2
        self._turns = _turns(system)
        self._round = frozenset(name for name in system.bodies if _rolls(system, name))
        self._widest = dict.fromkeys(system.bodies, 0.0)
        self._fastest = {line.name: float(np.linalg.norm(line.relative(system.velocity))) for line in self._lines}

    def test(self, times: np.ndarray, samples: Samples) -> Exit | None:
        """Return the first way in which a frame left the range; None where it did not.

        Args:
            times: Ends of its samples [s], (s,).
            samples: Its samples.
        """
        turned_faces = [
            (face.time, Exit(Result.FACE_TURNED, face.sentence)) for face in self._faces.test(times, samples)
        ]
        if self._system.scene.capabilities.turns:
            return min(turned_faces)[1] if turned_faces else None
        r = len(self._system.rigid)
        positions = samples.snapshots[:, :r]
        exits = [*turned_faces, *self._deformed(times, samples.paths.squares), *self._turned(times, positions)]
        exits += self._moved_aside(times, positions, samples.forces)
        exits += self._slipped(times, samples.snapshots[:, r : 2 * r], samples.forces)
        return min(exits, key=lambda item: item[0])[1] if exits else None

    def _turned(self, times: np.ndarray, positions: np.ndarray) -> Iterator[tuple[float, Exit]]:
        limit, start = self._system.scene.run.limits.angle, 0
        if not (np.abs(positions) @ self._turns > min(limit, SMALL_ROTATION) * (1 - ROUND_OFF)).any():
            return  # No body can have turned so far.
        for name, body in self._system.bodies.items():
            span = slice(start, start + body.rigid_count)
            start = span.stop
            angles = np.linalg.norm(body.centre_motion(positions[:, span])[:, 3:], axis=1)
            self._widest[name] = max(self._widest[name], float(angles.max()))
            if (frame := _first(angles > limit)) is not None and name not in self._round:
                yield times[frame], Exit(Result.ROTATION, _turned_too_far(name, angles[frame], times[frame], limit))

    def notes(self) -> list[str]:
        """Return a note of each face of a patch that turns, and of each body that turned beyond small motion in a run
        whose limit allows it."""
        scene = self._system.scene
        balls = [
            f"body.{name} turned by {angle:.3g} rad as a ball: its inertia is the same about all axes, and its contact"
            " points stay where their normals go through its centre"
            for name, angle in self._widest.items()
            if name in self._round and angle > scene.run.limits.angle
        ]
        if (limit := scene.run.limits.angle) <= SMALL_ROTATION or scene.capabilities.turns:
            return self._faces.notes() + balls
        advice = '; run.integrator = "turning" computes both' if scene.may_turn else ""
        turned = [
            f"body.{name} turned by {angle:.3g} rad, which run.limits.angle = {limit:g} allows: beyond"
            f" {SMALL_ROTATION:g} rad this is right only where rotation changes neither the contact geometry nor the"
            f" inertia, since rotations are linear and gyroscopic terms are left out{advice}"
            for name, angle in self._widest.items()
            if angle > SMALL_ROTATION and name not in self._round
        ]
        return self._faces.notes() + balls + turned

    def _deformed(self, times: np.ndarray, squares: np.ndarray) -> Iterator[tuple[float, Exit]]:
        limit = self._system.scene.run.limits.angle
        if not (squares > self._squares * (1 - ROUND_OFF)).any():
            return
        for (name, body), squares_body, size in zip(self._system.bodies.items(), squares.T, self._sizes, strict=True):
            deflections = np.sqrt(squares_body / body.morph.mass)
            if (frame := _first(deflections > limit * size)) is not None:
                sentence = _deformed_too_far(name, deflections[frame], times[frame], (size, limit))
                yield times[frame], Exit(Result.ROTATION, sentence)

    def _moved_aside(
        self, times: np.ndarray, positions: np.ndarray, forces: np.ndarray
    ) -> Iterator[tuple[float, Exit]]:
        for k in np.flatnonzero(self._far(positions)):
            aside = self._contacts[k]
            rows = np.swapaxes(aside.rows, 1, 2)
            offsets = np.sqrt(((positions @ rows[:2]) ** 2).sum(axis=0)).max(axis=1)
            moved = np.sqrt(((np.abs(positions) @ np.abs(rows)) ** 2).sum(axis=0)).max(axis=1)
            touches = forces[:, aside.number].any(axis=1) | (not aside.touching)
            if (frame := _first(touches & (offsets > aside.limit + ROUND_OFF * moved))) is not None:
                yield times[frame], Exit(Result.OFFSET, aside.sentence(offsets[frame], times[frame]))

    def _far(self, positions: np.ndarray) -> np.ndarray:
        """Return at which contacts a point may have moved aside beyond its limit, (k,)."""
        offsets = np.abs(positions).max(axis=0, initial=0.0) @ self._reach
        return (offsets**2).sum(axis=1) > self._offsets**2

    def _slipped(self, times: np.ndarray, rates: np.ndarray, forces: np.ndarray) -> Iterator[tuple[float, Exit]]:
        for line in self._lines:
            speeds = line.relative(rates, rigid=True)
            size = np.maximum.accumulate(np.append(self._fastest[line.name], np.linalg.norm(speeds, axis=1)))[1:]
            self._fastest[line.name], across = float(size[-1]), np.abs(speeds @ line.across)
            touches = forces[:, line.number].any(axis=1)
            allowed = np.maximum(ACROSS * size, VELOCITY_ROUND_OFF * line.size(rates, rigid=True))
            if (frame := _first(touches & (across > allowed))) is not None:
                yield times[frame], Exit(Result.SLIP_ACROSS, line.sentence(float(across[frame]), float(times[frame])))


def _rolls(system: System, name: str) -> bool:
    """Whether a body is a ball for all that acts on it: rigid, of equal moments of inertia, and touched along normals
    through its centre alone, with no probe beside its origin. Its linear rotation about a contact point is that of a
    ball of any angle."""
    scene, body = system.scene, system.bodies[name]
    moments = np.linalg.eigvalsh(body.morph.inertia)
    named = [*scene.force.values(), *scene.joint.values(), *scene.motion.values()]
    acted_on = any(name in (getattr(item, "body", None), getattr(item, "against", None)) for item in named)
    if (
        len(body.modal.angular_frequencies)
        or np.ptp(moments) > BALL * moments[-1]
        or acted_on
        or scene.fields()
        or _is_read_aside(scene, name)
    ):
        return False
    sides = [(c, points) for c in system.contacts for owner, _, _, points, _ in c.sides if owner == name]
    levers = [np.cross(points - body.morph.centre, contact.directions) for contact, points in sides]
    radii = [np.linalg.norm(points - body.morph.centre, axis=1).max() for _, points in sides]
    return bool(sides) and all(np.abs(a).max() <= BALL * r for a, r in zip(levers, radii, strict=True))


def _is_read_aside(scene: Scene, name: str) -> bool:
    """Whether a probe reads the motion of a point of a body that is not its origin: by a linear rotation."""
    sides = (("body", "interface", "at"), ("against", "against_interface", "against_at"))
    return any(
        getattr(probe, body, None) == name and any(getattr(probe, key, None) is not None for key in places)
        for probe in scene.probe.values()
        for body, *places in sides
    )


def _turns(system: System) -> np.ndarray:
    """Return bounds of how far each body turns by each rigid coordinate of the system [rad], (r, b)."""
    bounds, start = np.zeros((len(system.rigid), len(system.bodies))), 0
    for i, body in enumerate(system.bodies.values()):
        identity = np.eye(body.rigid_count)
        bounds[start : start + body.rigid_count, i] = np.linalg.norm(body.centre_motion(identity)[:, 3:], axis=1)
        start += body.rigid_count
    return bounds


def _turned_too_far(name: str, angle: float, time: float, limit: float) -> str:
    return (
        f"body '{name}' turned by {angle:.3g} rad at {time:.6g} s, beyond run.limits.angle = {limit:g} rad: rotations"
        " are linear and gyroscopic terms are missing; shorten run.duration, set run.integrator to 'turning' for free"
        " bodies, or raise run.limits.angle where rotation changes neither the contact geometry nor the inertia"
    )


def _deformed_too_far(name: str, deflection: float, time: float, limits: tuple[float, float]) -> str:
    size, limit = limits
    return (
        f"body '{name}' deformed by {deflection:.3g} m (root mean square) at {time:.6g} s, {deflection / size:.3g} of"
        f" its radius of gyration {size:.3g} m, beyond run.limits.angle = {limit:g}: deflections are linear; check the"
        " material and the loads, shorten run.duration, or raise run.limits.angle"
    )


def _first(flags: np.ndarray) -> int | None:
    """Return the number of the first True, or None."""
    frames = np.flatnonzero(flags)
    return int(frames[0]) if len(frames) else None


def _offsets(system: System) -> Iterator[Aside]:
    """Yield the lateral offset of each contact that has one: against another body, or a surface that curves."""
    prescribed = system.scene.run.limits.offset
    for i, contact in enumerate(system.contacts):
        surface, partner = contact.master, contact.other
        directions = _lateral(system, contact)
        if not directions[:2].any():
            continue
        rows = _displacements(system, contact.body, contact.points, directions)
        if partner is not None:
            rows = rows - _displacements(system, partner.body, partner.points, directions)
        elif surface is not None:
            # The points of the design lie over the same places of the other body's design.
            body_position, surface_position = (
                np.asarray(system.scene.body[name].position) for name in (contact.body, surface.body)
            )
            rows = rows - _displacements(
                system, surface.body, contact.points + body_position - surface_position, directions
            )
        limit, cause = _spacing(system, contact) if prescribed is None else (prescribed, "run.limits.offset")
        bounds = np.abs(rows[:2]).max(axis=1).T
        yield Aside(contact.name, i, rows, bounds, limit, cause=cause, touching=partner is not None)


def _lateral(system: System, contact: ContactRows) -> np.ndarray:
    """Return two directions in which motion leaves the range at each point, zero where it does not, and the normal."""
    directions, normals = np.zeros((3, *contact.points.shape)), contact.directions
    directions[2] = normals
    if contact.other is not None:
        # The axis that is farthest from the normal.
        axis = np.eye(3)[np.abs(normals).argmin(axis=1)]
        directions[0] = np.cross(normals, axis)
        directions[0] /= np.linalg.norm(directions[0], axis=1, keepdims=True)
        directions[1] = np.cross(normals, directions[0])
    elif contact.master is not None:
        directions[0] = np.cross(normals, contact.master.direction)
    elif isinstance(obstacle := system.scene.contact[contact.name].against, Plane | Bore):
        directions[0] = obstacle.lateral(normals)
    return directions


def _displacements(system: System, name: str, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return the displacement of points along directions (3, c, 3) per rigid coordinate of the system, (3, c, r)."""
    body, r = system.bodies[name], len(system.rigid)
    rows = np.zeros((len(directions), len(points), r))
    columns = np.flatnonzero((system.rigid >= body.rigid.start) & (system.rigid < body.rigid.stop))
    for k in range(len(directions)):
        rows[k][:, columns] = body.rigid_rows(points, directions[k])
    return rows


def _spacing(system: System, contact: ContactRows) -> tuple[float, str]:
    """Return the offset [m] that leaves the range by default, and what it is."""
    points = contact.points
    if len(points) > 1:
        from scipy.spatial import cKDTree

        spacing = cKDTree(points).query(points, k=2)[0][:, 1]
        return float(np.median(spacing)), "the distance of neighbouring contact points"
    sides = [(name, x) for name, _, _, x, _ in contact.sides]
    radius = max(float(np.linalg.norm(x - system.bodies[name].morph.centre, axis=1).max()) for name, x in sides)
    return ASIDE * radius, f"{ASIDE:g} of the distance from the contact point to the centre of mass"
