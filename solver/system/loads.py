"""Joints, given loads, driven bodies and gravity of a scene. Each load row is the displacement conjugate to a force;
rows 2 j and 2 j + 1 are the displacement of joint j's point, lateral and along; those of drives come last."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from gudgeon.modaldb.records.traction import inside, spread
from gudgeon.solver.bodies.placing import turned_vectors
from gudgeon.solver.bodies.small_motion import FlexibleBody, named
from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.contact.shares import shared
from gudgeon.solver.errors import SceneError
from gudgeon.solver.forces import OverTime
from gudgeon.solver.forces.external import ExternalForce
from gudgeon.solver.forces.moving import MovingForce
from gudgeon.solver.methods import METHODS
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.system.drives import DrivenRows, driven_rows, refuse_contradictions
from gudgeon.solver.system.fields.reading import electrode_end, field_ends
from gudgeon.solver.system.points import HeldPoint, held_point, load_of, rigid_point
from gudgeon.solver.vectors import unit

ON_THE_SPACE = 1e-9
"""Distance relative to its size by which the ends of a path may lie outside a traction space."""

ROWS = {"pressure": 1, "mean": 3, "tie": 6}
"""Rows of a load by the kind of its interface."""
Owner = tuple[str, str | None, np.ndarray]
"""Body and interface of rows, and their mix from the rows of the interface."""


@dataclass(frozen=True)
class GivenLoad:
    """A force prescribed over time, as k generalised forces."""

    name: str
    body: str
    interface: str | None
    """On which it acts; None for a rigid body's point or axis."""
    mix: np.ndarray
    """Its forces per force of its interface, (k, j)."""
    resultant: np.ndarray
    """Force and moment about the component's origin per unit of each, (k, 6)."""
    amounts: Callable[[np.ndarray], np.ndarray]
    """Generalised forces at given times [s], (t,) → (t, k)."""
    travels: bool
    """Whether it is a moving force: the body is undeformed at the start."""
    means: Callable[[np.ndarray, float], np.ndarray] | None = None
    """Their means over steps dt from given times [s], (t,) → (t, k); None: those of the middle."""

    def over_steps(self, start: np.ndarray, dt: float) -> np.ndarray:
        """Return the forces in steps dt [s] from `start` [s], (t, k); those at `start` for dt = 0."""
        return self.amounts(start + 0.5 * dt) if self.means is None or dt == 0 else self.means(start, dt)


@dataclass(frozen=True)
class Driving:
    """Joints, given loads, drives and gravity. Shapes: L load rows, D of drives, m coordinates, c contact rows."""

    joints: list[HeldPoint]
    given: list[GivenLoad]
    drives: list[DrivenRows]
    rows: np.ndarray
    """(L, m)"""
    residual: np.ndarray
    """R among the loads, (L, L)."""
    to_gap: np.ndarray
    """Change of the gaps under unit loads due to R, (c, L)."""
    damping: np.ndarray
    """β of each row's body [s], (L,)."""
    gravity: np.ndarray
    """Generalised force, (m,)."""

    def loads(self, start: np.ndarray, dt: float) -> np.ndarray:
        """Return the given loads in steps dt [s] from `start` [s], (t,); zero for joints and drives, (t, L)."""
        amounts = np.zeros((len(start), len(self.rows)))
        for load, rows in self.given_rows():
            amounts[:, rows] = load.over_steps(start, dt)
        return amounts

    def given_rows(self) -> Iterator[tuple[GivenLoad, slice]]:
        """Yield each given load with its rows."""
        start = 2 * len(self.joints)
        for load in self.given:
            stop = start + len(load.resultant)
            yield load, slice(start, stop)
            start = stop

    def driven_rows(self) -> Iterator[tuple[DrivenRows, slice]]:
        """Yield each drive with its rows."""
        start = 2 * len(self.joints) + sum(len(load.resultant) for load in self.given)
        for drive in self.drives:
            stop = start + len(drive.mix)
            yield drive, slice(start, stop)
            start = stop

    def driven(self, times: np.ndarray) -> np.ndarray:
        """Return where the drives' rows are given to be, and with which rate, at times [s], (t, D, 2)."""
        return np.concatenate([np.zeros((len(times), 0, 2)), *(drive.places(times) for drive in self.drives)], axis=1)

    def places(self) -> Iterator[tuple[str, str | None, np.ndarray, slice]]:
        """Yield body and interface of each joint and load, the mix of its rows from the interface's, and its rows."""
        for i, joint_point in enumerate(self.joints):
            along, lateral = joint_point.joint.axes
            mix = np.array([lateral, along])
            yield joint_point.joint.body, joint_point.joint.interface, mix, slice(2 * i, 2 * i + 2)
        for load, rows in [*self.given_rows(), *self.driven_rows()]:
            yield load.body, load.interface, load.mix, rows

    def crank(self, time: np.ndarray) -> np.ndarray:
        """Return the crank pin of each joint at given times, (t, j, 4)."""
        pins = [j.joint.crank_pin(time) for j in self.joints]
        return np.stack(pins, axis=1) if pins else np.zeros((len(time), 0, 4))

    def begin(
        self, bodies: Mapping[str, FlexibleBody], position: np.ndarray, velocity: np.ndarray, *, deformed: bool
    ) -> np.ndarray:
        """Set bodies to the crank's position at the start, in equilibrium without contact; returns the loads, (L,).

        Their velocity along becomes that at which the rod keeps its length, with their other velocities as given.

        Args:
            position, velocity: Of all coordinates, changed in place, (m,).
            deformed: Whether loads and gravity deform the bodies.

        Raises:
            SceneError: a rod does not reach its point at every crank angle.
        """
        loads = self.loads(np.zeros(1), 0.0)[0]
        for load, rows in self.given_rows():
            loads[rows] *= not load.travels
        for i, joint_point in enumerate(self.joints):
            body, along = bodies[joint_point.joint.body], joint_point.joint.axes[0]
            try:
                joint_point.turn()
            except ValueError as error:
                raise SceneError(
                    f"joint.{joint_point.name}.rod_length: {joint_point.joint.rod_length} m is below crank_radius plus"
                    f" the offset of the pin from the crank axis, {joint_point.anchor[0]:g} m; {error}"
                ) from None
            pin = self.rows[2 * i : 2 * i + 2][:, body.rigid] @ velocity[body.rigid]
            height, speed, rate = joint_point.joint.piston_pin(np.zeros(1), joint_point.anchor[0], pin[0])[0]
            position[body.rigid] += body.rigid_velocity(along * (height - joint_point.anchor[1]), np.zeros(3))
            velocity[body.rigid] += body.rigid_velocity(along * (speed - pin[1]), np.zeros(3))
            generalised_force = body.twists.T @ (self.rows.T @ loads + self.gravity)[body.rigid]
            # Of the mass-normalised motions, M Σ twist (twist·force) is the force itself.
            load_along = body.morph.mass * float(generalised_force[:3] @ along)
            tangent = joint_point.joint.tangent(np.zeros(1), joint_point.anchor[0])[0]
            upright = 1 / np.sqrt(1 + tangent**2)
            rod = (body.morph.mass * rate - load_along) / upright
            loads[2 * i], loads[2 * i + 1] = rod * tangent * upright, rod * upright
        force = self.rows.T @ loads + self.gravity
        for name, body in bodies.items():
            loaded = name in {*(j.joint.body for j in self.joints), *(load.body for load in self.given)}
            if deformed and (loaded or self.gravity[body.elastic].any()):
                position[body.elastic] = force[body.elastic] / body.modal.angular_frequencies**2
        self._fit_rods(bodies, position, loads)
        return loads

    def _fit_rods(self, bodies: Mapping[str, FlexibleBody], position: np.ndarray, loads: np.ndarray) -> None:
        """Shift bodies along so that their deformed points are at rod length."""
        displacement = self.rows @ position + self.residual @ loads
        for i, joint_point in enumerate(self.joints):
            lateral, along = joint_point.anchor + displacement[2 * i : 2 * i + 2]
            body = bodies[joint_point.joint.body]
            height = joint_point.joint.piston_pin(np.zeros(1), lateral)[0, 0]
            shift = joint_point.joint.axes[0] * (height - along)
            position[body.rigid] += body.rigid_velocity(shift, np.zeros(3))


def compile_driving(
    scene: Scene, bodies: Mapping[str, FlexibleBody], contacts: Sequence[ContactRows], size: int
) -> Driving:
    """Build the rows of joints and loads.

    Raises:
        SceneError: a body has no such interface.
    """
    joints: list[HeldPoint] = []
    loads: list[GivenLoad] = []
    rows: list[np.ndarray] = []
    owners: list[Owner] = []
    for name, joint in scene.cranks().items():
        body = bodies[joint.body]
        position, resultant, elastic = held_point(scene, name, body)
        along, lateral = joint.axes
        mix = np.array([lateral, along])
        joints.append(HeldPoint(name, joint, mix @ position, mix @ resultant))
        rows.append(_over_all(body, body.wrench_rows(mix @ resultant), mix @ elastic, size))
        owners.append((joint.body, joint.interface, mix))
    for name, force in scene.given().items():
        body = bodies[force.body]
        made = _travelling if isinstance(force, MovingForce) else _pressing
        made = _over_time if isinstance(force, OverTime) else made
        load, elastic = (_external if isinstance(force, ExternalForce) else made)(scene, name, body)
        loads.append(load)
        rows.append(_over_all(body, body.wrench_rows(load.resultant), elastic, size))
        owners.append((force.body, load.interface, load.mix))
    for load, elastic in _fields(scene, bodies):
        loads.append(load)
        rows.append(_over_all(bodies[load.body], bodies[load.body].wrench_rows(load.resultant), elastic, size))
        owners.append((load.body, load.interface, load.mix))
    drives: list[DrivenRows] = []
    for name, motion in scene.motion.items():
        body = bodies[motion.body]
        drive, elastic = driven_rows(scene, name, body)
        drives.append(drive)
        rows.append(_over_all(body, body.wrench_rows(drive.resultant), elastic, size))
        owners.append((motion.body, motion.interface, drive.mix))
    stacked = np.vstack([np.empty((0, size)), *rows])
    residual, to_gap = _shared(scene, bodies, contacts, owners)
    damping = np.array([bodies[body].stiffness_factor for body, _, mix in owners for _ in mix])
    driving = Driving(
        joints=joints, given=loads, drives=drives, rows=stacked, residual=residual, to_gap=to_gap, damping=damping,
        gravity=_gravity(scene, bodies, size),
    )  # fmt: skip
    for body in bodies.values():
        body_drives = [(item, span) for item, span in driving.driven_rows() if item.body == body.name]
        joint_rows = {f"joint.{j.name}": 2 * n + 1 for n, j in enumerate(joints) if j.joint.body == body.name}
        if body_drives:
            refuse_contradictions(body_drives, joint_rows, body, (driving.rows[:, body.coordinates], driving.residual))
    return driving


def _gravity(scene: Scene, bodies: Mapping[str, FlexibleBody], size: int) -> np.ndarray:
    """Return the generalised forces of gravity on all coordinates, (n,)."""
    forces = np.zeros(size)
    for body in bodies.values():
        forces[body.rigid] = body.rigid_velocity(np.asarray(scene.run.gravity), np.zeros(3))
        if body.modal.participation is not None:
            forces[body.elastic] = np.asarray(scene.run.gravity) @ body.modal.participation
    return forces


Made = tuple[GivenLoad, np.ndarray]
"""A load of k forces, and its elastic rows, (k, m)."""


def _fields(scene: Scene, bodies: Mapping[str, FlexibleBody]) -> Iterator[Made]:
    """Yield the loads of electrostatic fields at each of their ends, then those of the points of electrodes."""
    for name, field in scene.fields().items():
        for end, (body, interface, mix, resultant) in enumerate(field_ends(name, field, scene, bodies)):
            label, none = f"{name}.against" if end else name, np.zeros((len(mix), 0))
            elastic = none if interface is None else mix @ body.modal.loads[interface].rows
            amounts = partial(_none, len(mix))
            yield GivenLoad(label, body.name, interface, mix, resultant, amounts, travels=False), elastic
    for name, electrode in scene.electrodes().items():
        body, interface, mix, resultant = electrode_end(name, electrode, bodies)
        elastic = body.modal.interfaces[electrode.interface].rows
        amounts = partial(_none, len(mix))
        yield GivenLoad(name, body.name, interface, mix, resultant, amounts, travels=False), elastic


def _none(count: int, time: np.ndarray) -> np.ndarray:
    """Return zeros for a field, whose forces the time loop finds, (t, k)."""
    return np.zeros((len(time), count))


def _shared(
    scene: Scene, bodies: Mapping[str, FlexibleBody], contacts: Sequence[ContactRows], owners: Sequence[Owner]
) -> tuple[np.ndarray, np.ndarray]:
    """Return R among loads, (L, L), and the change of gaps by them through R, (c, L)."""
    ends = np.cumsum([0, *(len(mix) for _, _, mix in owners)])
    residual, to_gap = np.zeros((ends[-1], ends[-1])), np.zeros((sum(len(c.points) for c in contacts), ends[-1]))
    spans = [slice(int(start), int(stop)) for start, stop in pairwise(ends)]
    for (body, interface, mix), span in zip(owners, spans, strict=True):
        if interface is None:
            continue
        for (partner, partner_interface, weights), there in zip(owners, spans, strict=True):
            if body == partner and partner_interface is not None:
                residual[span, there] = mix @ bodies[body].residual(interface, partner_interface) @ weights.T
        for contact in contacts:
            for owner, touching, point_weights, *_ in contact.sides:
                if body == owner and METHODS[scene.contact[contact.name].method].flexible:
                    to_gap[contact.rows, span] = (
                        -shared(point_weights, bodies[body].residual(touching, interface)) @ mix.T
                    )
    return residual, to_gap


def _over_time(scene: Scene, name: str, body: FlexibleBody) -> Made:
    """Return a force, torque, pressure or wrench whose amount is given over time; one row, of a wrench six."""
    force, scene_key = scene.over_time()[name], f"force.{name}"
    force.check(scene.run.duration, scene_key)
    interface = getattr(force, "interface", None)
    if interface is None:
        if len(body.modal.angular_frequencies):
            cause = "name an interface of it" if force.surface else f"a {force.kind} acts on rigid bodies"
            key = "at" if force.surface else "body"
            raise SceneError(f"{scene_key}.{key}: body '{body.name}' is elastic; {cause}")
        resultant = np.atleast_2d(force.wrench(partial(turned_vectors, scene.body[body.name])))
        elastic, mix = np.zeros((len(resultant), 0)), np.eye(len(resultant))
    else:
        load = load_of(body, interface, f"{scene_key}.interface")
        kind, count = force.surface, ROWS[force.surface or ""]
        if len(load.rows) != count:
            raise SceneError(f"{scene_key}.interface: '{interface}' is no interface of kind '{kind}'")
        mix = force.mix()
        resultant, elastic = mix @ load.resultant, mix @ load.rows

    breaks = force.breaks(scene.run.duration, scene_key)

    def amounts(time: np.ndarray) -> np.ndarray:
        return force.amounts(time, scene_key)[:, None] * force.share()

    def means(start: np.ndarray, dt: float) -> np.ndarray:
        return force.means(start, dt, scene_key, breaks)[:, None] * force.share()

    return GivenLoad(name, body.name, interface, mix, resultant, amounts, travels=False, means=means), elastic


def _pressing(scene: Scene, name: str, body: FlexibleBody) -> Made:
    """Return a gas pressure; one row."""
    force = scene.gas()[name]
    load, joint = load_of(body, force.interface, f"force.{name}.interface"), scene.cranks()[force.joint]
    if len(load.rows) != 1:
        raise SceneError(f"force.{name}.interface: '{force.interface}' is no interface of kind 'pressure'")
    pressure = force.over_angle()

    def amounts(time: np.ndarray) -> np.ndarray:
        return pressure(joint.angle(time))[:, None]

    mix = np.ones((1, 1))
    return GivenLoad(name, body.name, force.interface, mix, load.resultant, amounts, travels=False), load.rows


def _travelling(scene: Scene, name: str, body: FlexibleBody) -> Made:
    """Return a moving force on the functions of its traction space."""
    force, scene_key = scene.moving()[name], f"force.{name}"
    owner = f"{scene_key}.interface: body '{body.name}' has no traction space"
    space = named(body.modal.tractions, force.interface, owner)
    ends = force.places(np.array([0.0, scene.run.duration]))
    end = space.start + space.spacing * (space.counts - 3)
    # Round-off of speed × duration must not place the end of a path outside the space.
    if not inside(space, ends + ON_THE_SPACE * (space.start + end - 2 * ends)).all():
        raise SceneError(
            f"{scene_key}: it moves from {ends[0].tolist()} to {ends[1].tolist()} m across and along by run.duration,"
            f" its traction space reaches from {space.start.tolist()} to {end.tolist()}; change `at` or run.duration"
        )

    def amounts(time: np.ndarray) -> np.ndarray:
        return spread(space, force.places(time), -force.amounts(time))

    mix = np.eye(len(space.rows))
    return GivenLoad(name, body.name, force.interface, mix, space.resultant, amounts, travels=True), space.rows


def _external(scene: Scene, name: str, body: FlexibleBody) -> Made:
    """Return a force that the caller sets, along one direction or three axes."""
    force, key = scene.external()[name], f"force.{name}.interface"
    axes = np.eye(3) if force.direction is None else unit(force.direction)[None]

    def amounts(time: np.ndarray) -> np.ndarray:
        return np.zeros((len(time), len(axes)))

    if force.interface is None:
        _, resultant = rigid_point(scene, body, force.at, key, "'mean' or 'tie'")
        none = np.empty((len(axes), 0))
        return GivenLoad(name, body.name, None, np.eye(len(axes)), axes @ resultant, amounts, travels=False), none
    load = load_of(body, force.interface, key)
    if len(load.rows) not in (3, 6):
        raise SceneError(f"{key}: '{force.interface}' is no interface of kind 'mean' or 'tie'")
    mix = np.column_stack([axes, np.zeros((len(axes), len(load.rows) - 3))])
    return GivenLoad(
        name, body.name, force.interface, mix, mix @ load.resultant, amounts, travels=False
    ), mix @ load.rows


def _over_all(body: FlexibleBody, rigid: np.ndarray, elastic: np.ndarray, size: int) -> np.ndarray:
    """Return rows over all coordinates, (k, size), of their rigid and elastic parts, (k, r) and (k, m)."""
    rows = np.zeros((len(rigid), size))
    rows[:, body.coordinates] = np.column_stack([rigid, elastic])
    return rows
