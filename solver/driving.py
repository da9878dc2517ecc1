"""What drives a scene: joints that prescribe motion, given loads, gravity. Each load row is a displacement that a
generalised force works on; rows 2 j and 2 j + 1 are the lateral and along displacement of joint j's point."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from solver.body import FlexibleBody
from solver.contacts import ContactRows
from solver.errors import SceneError
from solver.forces.gas import GasPressure
from solver.joints import Joint
from solver.methods import METHODS
from solver.scene import Scene


@dataclass(frozen=True)
class HeldPoint:
    """A joint on a body."""

    name: str
    joint: Joint
    body: str
    anchor: np.ndarray
    """Lateral and along coordinate of its point at q = 0 [m], (2,)."""


@dataclass(frozen=True)
class GivenLoad:
    """A force given over time."""

    name: str
    force: GasPressure
    joint: Joint
    body: str

    def mean(self, start: np.ndarray, dt: float) -> np.ndarray:
        """Return the generalised force in the middle of steps that begin at given times [s]."""
        return self.force.pressure(self.joint.angle(start + 0.5 * dt))


@dataclass(frozen=True)
class Driving:
    """Shapes: L load rows, m coordinates, c contact rows."""

    joints: list[HeldPoint]
    given: list[GivenLoad]
    rows: np.ndarray
    """(L, m)"""
    residual: np.ndarray
    """R among the loads, (L, L)."""
    to_gap: np.ndarray
    """Change of the gaps under unit loads through R, (c, L)."""
    damping: np.ndarray
    """β of each row's body [s], (L,)."""
    gravity: np.ndarray
    """Generalised force, (m,)."""

    def loads(self, start: np.ndarray, dt: float) -> np.ndarray:
        """Return the given loads' mean over steps that begin at given times, zero for joints, (t, L)."""
        found = np.zeros((len(start), len(self.rows)))
        for number, load in enumerate(self.given, 2 * len(self.joints)):
            found[:, number] = load.mean(start, dt)
        return found

    def crank(self, time: np.ndarray) -> np.ndarray:
        """Return the crank pin of each joint at given times, (t, j, 4)."""
        pins = [held.joint.crank_pin(time) for held in self.joints]
        return np.stack(pins, axis=1) if pins else np.zeros((len(time), 0, 4))

    def begin(
        self, bodies: Mapping[str, FlexibleBody], offsets: Mapping[str, int], position: np.ndarray, velocity: np.ndarray
    ) -> np.ndarray:
        """Place driven bodies where the crank has them, deformed as the loads at the start ask; returns those, (L,).

        Args:
            position, velocity: Of all coordinates, changed in place, (m,).

        Raises:
            SceneError: a rod does not reach its point all around.
        """
        loads = self.loads(np.zeros(1), 0.0)[0]
        for number, held in enumerate(self.joints):
            body, first = bodies[held.body], offsets[held.body]
            along, _lateral = held.joint.axes
            turn = np.linspace(0.0, 2 * np.pi / held.joint.rate, 721)
            try:
                held.joint.piston_pin(turn, held.anchor[0])
            except ValueError as error:
                raise SceneError(
                    f"joint.{held.name}.rod_length: {held.joint.rod_length} m is below crank_radius plus the offset of"
                    f" the pin from the crank axis, {held.anchor[0]:g} m; {error}"
                ) from None
            height, speed, rate = held.joint.piston_pin(np.zeros(1), held.anchor[0])[0]
            columns = slice(first, first + body.rigid_count)
            position[columns] += body.rigid_velocity(along * (height - held.anchor[1]), np.zeros(3))
            velocity[columns] += body.rigid_velocity(along * speed, np.zeros(3))
            push = body.twists.T @ (self.rows.T @ loads + self.gravity)[columns]
            # Of the mass-normalised motions, M Σ twist (twist·force) is the force itself.
            given = body.morph.mass * float(push[:3] @ along)
            tangent = held.joint.tangent(np.zeros(1), held.anchor[0])[0]
            upright = 1 / np.sqrt(1 + tangent**2)
            rod = (body.morph.mass * rate - given) / upright
            loads[2 * number], loads[2 * number + 1] = rod * tangent * upright, rod * upright
        force = self.rows.T @ loads
        for name, body in bodies.items():
            if any(item.body == name for item in [*self.joints, *self.given]):
                elastic = slice(offsets[name] + body.rigid_count, offsets[name] + len(body.stiffness))
                position[elastic] = force[elastic] / body.modal.angular_frequencies**2
        self._fit_rods(bodies, offsets, position, loads)
        return loads

    def _fit_rods(
        self,
        bodies: Mapping[str, FlexibleBody],
        offsets: Mapping[str, int],
        position: np.ndarray,
        loads: np.ndarray,
    ) -> None:
        """Shift bodies along so that their deformed points stand at rod length."""
        place = self.rows @ position + self.residual @ loads
        for number, held in enumerate(self.joints):
            lateral, along = held.anchor + place[2 * number : 2 * number + 2]
            body, first = bodies[held.body], offsets[held.body]
            height = held.joint.piston_pin(np.zeros(1), lateral)[0, 0]
            shift = held.joint.axes[0] * (height - along)
            position[first : first + body.rigid_count] += body.rigid_velocity(shift, np.zeros(3))


def compile_driving(
    scene: Scene,
    bodies: Mapping[str, FlexibleBody],
    offsets: Mapping[str, int],
    contacts: Sequence[ContactRows],
    size: int,
) -> Driving:
    """Build the rows of joints and loads.

    Raises:
        SceneError: a body has no such interface.
    """
    joints, given, rows, owners = [], [], [], []
    for name, joint in scene.joint.items():
        body = bodies[joint.body]
        load = body.load(joint.interface, f"joint.{name}.interface")
        if len(load.rows) != 3:
            raise SceneError(f"joint.{name}.interface: '{joint.interface}' is no interface of kind 'mean'")
        along, lateral = joint.axes
        place = load.point + np.asarray(scene.body[joint.body].position)
        joints.append(HeldPoint(name, joint, joint.body, np.array([place @ lateral, place @ along])))
        for axis in (lateral, along):
            rows.append(_over_all(body, offsets, axis @ body.wrench_rows(load.resultant), axis @ load.rows, size))
            owners.append((joint.body, joint.interface, axis))
    for name, force in scene.given().items():
        body = bodies[force.body]
        load = body.load(force.interface, f"force.{name}.interface")
        if len(load.rows) != 1:
            raise SceneError(f"force.{name}.interface: '{force.interface}' is no interface of kind 'pressure'")
        given.append(GivenLoad(name, force, scene.joint[force.joint], force.body))
        rows.append(_over_all(body, offsets, body.wrench_rows(load.resultant)[0], load.rows[0], size))
        owners.append((force.body, force.interface, np.ones(1)))
    residual = np.zeros((len(rows), len(rows)))
    for a, (body, interface, mix) in enumerate(owners):
        for b, (other, at, weights) in enumerate(owners):
            if body == other:
                residual[a, b] = mix @ bodies[body].residual(interface, at) @ weights
    to_gap = np.zeros((sum(len(contact.points) for contact in contacts), len(rows)))
    for contact in contacts:
        for a, (body, interface, mix) in enumerate(owners):
            if body == contact.body and METHODS[scene.contact[contact.name].method].flexible:
                to_gap[contact.rows, a] = -bodies[body].residual(contact.interface, interface) @ mix
    gravity = np.zeros(size)
    for name, body in bodies.items():
        pull = body.rigid_velocity(np.asarray(scene.run.gravity), np.zeros(3))
        gravity[offsets[name] : offsets[name] + body.rigid_count] = pull
    damping = np.array([bodies[body].stiffness_factor for body, _, _ in owners])
    stacked = np.array(rows).reshape(-1, size)
    return Driving(joints, given, stacked, residual, to_gap, damping, gravity)


def _over_all(
    body: FlexibleBody, offsets: Mapping[str, int], rigid: np.ndarray, elastic: np.ndarray, size: int
) -> np.ndarray:
    row, first = np.zeros(size), offsets[body.name]
    row[first : first + body.rigid_count] = rigid
    row[first + body.rigid_count : first + body.rigid_count + len(elastic)] = elastic
    return row
