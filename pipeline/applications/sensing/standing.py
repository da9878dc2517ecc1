"""A robot arm that stands on bushings as load cells: its chain, the base wrench, and the wrench at its tool.

With the cells' wrench w on the stand about the base point, the arm's Y p, the stand's own weight and inertia s, and the
contact's wrench c on the tool: w + c = Y p + s. The stand yields, so that it moves: `smoothing` estimates how, and c.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.applications.sensing.chain import Chain
from gudgeon.pipeline.applications.sensing.smoothing import Felt, Yielding, felt
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.bodies import SceneFile
from gudgeon.solver.forces.bushing import Bushing
from gudgeon.solver.joints.coupled import Driven
from gudgeon.solver.joints.markers import Fixed, Revolute
from gudgeon.solver.vectors import unit


@dataclass(frozen=True)
class Arm:
    """A chain whose joints are driven, on a stand."""

    chain: Chain
    drives: list[Driven]
    """Of its joints, (n,)."""
    stand: str
    """Body on which it stands."""
    tool: str
    """Its last link."""
    mass: np.ndarray
    """Of the stand about the base point, (6, 6)."""

    def angles(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return joint angles, rates and second rates as they are given, (t, n) each."""
        moved = np.stack([drive.function("joint").read(times, 2) for drive in self.drives], axis=1)
        return moved[:, :, 0], moved[:, :, 1], moved[:, :, 2]

    def felt(
        self,
        times: np.ndarray,
        wrench: np.ndarray,
        *,
        base: Yielding | None,
        parameters: np.ndarray,
        gravity: np.ndarray,
        levels: np.ndarray,
    ) -> Felt:
        """Return the wrench on the tool by that of the base, with the noise of its components; see `smoothing.felt`."""
        return felt(
            self.chain, self.mass, self.angles(times), wrench, base=base, parameters=parameters, gravity=gravity,
            levels=levels, interval=float(times[1] - times[0]),
        )  # fmt: skip

    def touched(self, trajectory: Trajectory, scene: SceneFile, times: np.ndarray) -> np.ndarray:
        """Return the true wrench of all contacts on the last link about the base point, (s, 6)."""
        moved = self.chain.motion(*self.angles(times))
        total = np.zeros((len(times), 6))
        for name, contact in scene.contact.items():
            if contact.body != self.tool:
                raise InputError(f"contact.{name}.body: '{contact.body}' given, the tool is '{self.tool}'")
            points = scene.component[scene.component_of(self.tool)].geometry.points  # type: ignore[union-attr]
            arm = self.chain.centres[-1] + np.array(points[contact.interface].at) - self.chain.points[-1]
            position = moved.place[:, -1] + np.einsum("sij,j->si", moved.turn[:, -1], arm)
            force = np.asarray(trajectory.contacts[name].force)
            total += np.hstack([force, np.cross(position - self.chain.base, force)])
        return total


@dataclass(frozen=True)
class Standing:
    """An arm on load cells."""

    arm: Arm
    cells: list[str]
    """Probes of the cells' forces."""
    places: np.ndarray
    """Points of the cells [m], (c, 3)."""
    stiffness: np.ndarray
    """K of all cells about the base point [N/m, N, N m], (6, 6)."""
    damping: np.ndarray

    def measured(self, trajectory: Trajectory) -> np.ndarray:
        """Return the wrench of the cells on the stand about the base point, (s, 6)."""
        total = np.zeros((len(trajectory.times), 6))
        for name, position in zip(self.cells, self.places, strict=True):
            values = np.asarray(trajectory.probes[name].values)
            total[:, :3] += values[:, :3]
            total[:, 3:] += values[:, 3:] + np.cross(position - self.arm.chain.base, values[:, :3])
        return total

    def yields(self) -> Yielding:
        """Return how the stand yields, which its cells feel by stiffness and damping."""
        return Yielding(self.stiffness, self.damping, feels_damping=True)


@dataclass(frozen=True)
class Gauged:
    """A chain whose stand is fixed on a plate with strain gauges, at its base point."""

    arm: Arm
    gauges: list[str]
    """Of the trajectory, (g,)."""
    matrix: np.ndarray
    """Wrench on the plate per strain [N, N m], (6, g)."""
    compliance: np.ndarray
    """Motion of the base point per wrench on the plate [m, rad per N, N m], (6, 6)."""
    beta: float
    """Its damping over its stiffness [s]."""
    mass: np.ndarray
    """Of the plate itself that moves with the base point [kg, kg m, kg m²], (6, 6)."""
    own: np.ndarray
    """Strains by its own weight, (g,)."""

    def measured(self, strains: np.ndarray) -> np.ndarray:
        """Return the wrench of the plate on the stand at strains (s, g), without the plate's own weight, (s, 6)."""
        return -(strains - self.own) @ self.matrix.T

    def yields(self) -> Yielding:
        """Return how the plate yields; its gauges feel strains alone."""
        K = np.linalg.inv(self.compliance)
        return Yielding(K, self.beta * K, feels_damping=False, mass=self.mass)


def arm_of(scene: SceneFile) -> Arm:
    """Return the arm of a scene: rigid bodies in a chain of driven revolute joints.

    Raises:
        InputError: the scene has no such arm; what is missing.
    """
    drives = {j.joint: j for j in scene.joint.values() if isinstance(j, Driven)}
    hinges = [(name, h) for name, h in scene.hinges().items() if isinstance(h, Revolute)]
    others = [h for h in scene.hinges().values() if not isinstance(h, Revolute | Fixed)]
    if not hinges or others or any(name not in drives for name, _ in hinges) or hinges[0][1].against is None:
        raise InputError("joint: an arm needs revolute joints, each with a drive, on a stand; others may be fixed")
    stand = before = str(hinges[0][1].against)
    links = []
    for name, hinge in hinges:
        if hinge.against != before:
            raise InputError(f"joint.{name}.against: '{hinge.against}' given, the chain needs '{before}'")
        links.append(_link(scene, name, hinge))
        before = hinge.body
    axes, points, masses, centres, inertias = (np.array(column) for column in zip(*links, strict=True))
    base = np.array(scene.body[stand].position, float)
    chain = Chain(axes=axes, points=points, masses=masses, centres=centres, inertias=inertias, base=base)
    stand_geometry = scene.component[scene.component_of(stand)].geometry
    if stand_geometry.kind != "rigid":
        raise InputError(f"joint.{hinges[0][0]}.against: '{stand}' deforms; the stand of an arm is rigid")
    mass = np.diag([stand_geometry.mass] * 3 + list(stand_geometry.inertia))
    return Arm(chain, [drives[name] for name, _ in hinges], stand, tool=before, mass=mass)


def _link(scene: SceneFile, name: str, hinge: Revolute) -> tuple[Any, ...]:
    """Return axis, point of the joint [m], mass [kg], centre [m] and inertia [kg m²] of a link."""
    geometry = scene.component[scene.component_of(hinge.body)].geometry
    centre = np.array(scene.body[hinge.body].position, float)
    if geometry.kind != "rigid":
        raise InputError(f"joint.{name}.body: '{hinge.body}' deforms; the links of an arm are rigid")
    point = centre + np.array(hinge.at or (0.0, 0.0, 0.0))
    return unit(hinge.axis), point, geometry.mass, centre, np.diag(geometry.inertia)


def _ground_bushings(scene: SceneFile, body: str) -> dict[str, Bushing]:
    """Return the bushings between a body and the ground, by name."""
    return {n: f for n, f in scene.force.items() if isinstance(f, Bushing) and f.body == body and not f.against}


def standing(scene: SceneFile) -> Standing:
    """Return the arm of a scene whose stand is held by bushings as load cells.

    Raises:
        InputError: the scene has no such arm; what is missing.
    """
    arm = arm_of(scene)
    cells_by_name = _ground_bushings(scene, arm.stand)
    if not cells_by_name:
        raise InputError(f"force: no bushing holds the stand, body '{arm.stand}', on the ground")
    probes = {getattr(p, "of", ""): name for name, p in scene.probe.items()}
    if lacking := [name for name in cells_by_name if f"force.{name}" not in probes]:
        raise InputError(f"probe: no probe reads force.{lacking[0]}; add one of kind 'force'")
    arms = [np.array(b.at or (0.0, 0.0, 0.0)) for b in cells_by_name.values()]
    both = [(b.matrices(), point) for b, point in zip(cells_by_name.values(), arms, strict=True)]
    K, C = (np.sum([about(two[which], point) for two, point in both], axis=0) for which in (0, 1))
    cells = [probes[f"force.{name}"] for name in cells_by_name]
    return Standing(arm=arm, cells=cells, places=arm.chain.base + np.array(arms), stiffness=K, damping=C)


def about(matrix: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Return a 6 × 6 matrix of motions at a point over motions of the base point, `arm` away from it [m]."""
    x, y, z = arm
    T = np.eye(6)
    T[:3, 3:] = -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return T.T @ matrix @ T
