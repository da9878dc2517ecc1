"""A robot arm that stands on bushings as load cells: its chain, the base wrench, and the wrench at its tool.

With the cells' wrench w on the stand about the base point, the arm's Y p, the stand's own weight and inertia s, and the
contact's wrench c on the tool: w + c = Y p + s. The stand yields: its motion u follows from w = −K u − C u̇, and with
its acceleration the inertia of stand and arm on a moving base is compensated.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.scenes.bodies import SceneFile
from gudgeon.pipeline.sensing.chain import Chain
from gudgeon.solver.forces.bushing import Bushing
from gudgeon.solver.joints.coupled import Driven
from gudgeon.solver.joints.markers import Revolute
from gudgeon.solver.vectors import unit


@dataclass(frozen=True)
class Standing:
    """A chain on load cells."""

    chain: Chain
    drives: list[Driven]
    """Of its joints, (n,)."""
    cells: list[str]
    """Probes of the cells' forces."""
    places: np.ndarray
    """Points of the cells [m], (c, 3)."""
    stiffness: np.ndarray
    """K of all cells about the base point [N/m, N, N m], (6, 6)."""
    damping: np.ndarray
    mass: np.ndarray
    """Of the stand about the base point, (6, 6)."""

    def angles(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return joint angles, rates and second rates as they are given, (t, n) each."""
        moved = np.stack([drive.motions(times, "joint") for drive in self.drives], axis=1)
        return moved[:, :, 0], moved[:, :, 1], moved[:, :, 2]

    def measured(self, found: Trajectory) -> np.ndarray:
        """Return the wrench of the cells on the stand about the base point, (s, 6)."""
        total = np.zeros((len(found.times), 6))
        for name, place in zip(self.cells, self.places, strict=True):
            values = np.asarray(found.probes[name].values)
            total[:, :3] += values[:, :3]
            total[:, 3:] += values[:, 3:] + np.cross(place - self.chain.base, values[:, :3])
        return total

    def touched(self, found: Trajectory, scene: SceneFile, times: np.ndarray) -> np.ndarray:
        """Return the true wrench of all contacts on the last link about the base point, (s, 6)."""
        moved = self.chain.motion(*self.angles(times))
        owner = list(scene.body)[-1]
        total = np.zeros((len(times), 6))
        for name, contact in scene.contact.items():
            if contact.body != owner:
                raise InputError(f"contact.{name}.body: '{contact.body}' given, the tool is '{owner}'")
            points = scene.component[scene.component_of(owner)].geometry.points  # type: ignore[union-attr]
            arm = self.chain.centres[-1] + np.array(points[contact.interface].at) - self.chain.points[-1]
            place = moved.place[:, -1] + np.einsum("sij,j->si", moved.turn[:, -1], arm)
            force = np.asarray(found.contacts[name].force)
            total += np.hstack([force, np.cross(place - self.chain.base, force)])
        return total

    def carried(self, wrench: np.ndarray, interval: float) -> np.ndarray:
        """Return the acceleration of the base by its cells' wrench, (s, 6): that of u̇ = −C⁻¹ (w + K u)."""
        # C⁻¹ K has real positive eigenvalues, those of K V = C V diag(values) with Vᵀ C V = 1.
        values, V = linalg.eigh(self.stiffness, self.damping)
        pushed = -wrench @ V
        decay, u, state = np.exp(-values * interval), np.zeros_like(pushed), np.zeros(6)
        for n, push in enumerate(pushed):
            state = decay * state + (1 - decay) / values * push
            u[n] = state
        return np.gradient((pushed - values * u) @ V.T, interval, axis=0)


def standing(scene: SceneFile) -> Standing:
    """Return the arm of a scene: rigid bodies in a chain of driven revolute joints, whose first stands on bushings.

    Raises:
        InputError: the scene has no such arm; what is missing.
    """
    drives = {one.joint: one for one in scene.joint.values() if isinstance(one, Driven)}
    hinges = [(name, one) for name, one in scene.hinges().items() if isinstance(one, Revolute)]
    if not hinges or len(hinges) != len(scene.hinges()) or any(name not in drives for name, _ in hinges):
        raise InputError("joint: an arm needs revolute joints alone, each with a drive")
    stand = hinges[0][1].against
    bushings = {
        n: f for n, f in scene.force.items() if isinstance(f, Bushing) and f.body == stand and f.against is None
    }
    if stand is None or not bushings:
        raise InputError("force: an arm stands on bushings between its first body and the ground")
    probes = {getattr(one, "of", ""): name for name, one in scene.probe.items()}
    if lacking := [name for name in bushings if f"force.{name}" not in probes]:
        raise InputError(f"probe: no probe reads force.{lacking[0]}; add one of kind 'force'")
    base, before = np.array(scene.body[stand].position, float), stand
    parts = []
    for name, hinge in hinges:
        if hinge.against != before:
            raise InputError(f"joint.{name}.against: '{hinge.against}' given, the chain needs '{before}'")
        geometry, before = scene.component[scene.component_of(hinge.body)].geometry, hinge.body
        place = np.array(scene.body[hinge.body].position, float)
        assert geometry.kind == "rigid"
        point = place + np.array(hinge.at or (0.0, 0.0, 0.0))
        parts.append((unit(hinge.axis), point, geometry.mass, place, np.diag(geometry.inertia)))
    axes, points, masses, centres, inertias = (np.array(part) for part in zip(*parts, strict=True))
    chain = Chain(axes=axes, points=points, masses=masses, centres=centres, inertias=inertias, base=base)
    places = np.array([base + np.array(one.at or (0.0, 0.0, 0.0)) for one in bushings.values()])
    held = [(one.matrices(), place - base) for one, place in zip(bushings.values(), places, strict=True)]
    K, C = (np.sum([_about(both[which], arm) for both, arm in held], axis=0) for which in (0, 1))
    own = scene.component[scene.component_of(stand)].geometry
    assert own.kind == "rigid"
    mass = np.diag([own.mass] * 3 + list(own.inertia))
    cells = [probes[f"force.{name}"] for name in bushings]
    return Standing(
        chain=chain, drives=[drives[name] for name, _ in hinges], cells=cells, places=places,
        stiffness=K, damping=C, mass=mass,
    )  # fmt: skip


def _about(matrix: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Return a 6 × 6 matrix of motions at a point over motions of the base point, `arm` away from it [m]."""
    x, y, z = arm
    T = np.eye(6)
    T[:3, 3:] = -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return T.T @ matrix @ T
