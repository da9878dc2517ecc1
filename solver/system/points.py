"""Points of bodies at which slider-cranks and forces act."""

from dataclasses import dataclass

import numpy as np

from gudgeon.modaldb.records.modes import LoadModes
from gudgeon.solver.bodies.placing import turned_vectors
from gudgeon.solver.bodies.small_motion import FlexibleBody, named
from gudgeon.solver.errors import SceneError
from gudgeon.solver.joints.slider_crank import SliderCrank
from gudgeon.solver.scene.scene import Scene


@dataclass(frozen=True)
class HeldPoint:
    """A joint, and the point of a body that it holds."""

    name: str
    joint: SliderCrank
    anchor: np.ndarray
    """Lateral and along coordinate of its point at q = 0 [m], (2,)."""
    resultant: np.ndarray
    """Force and moment about the component's origin of forces lateral and along at its point, (2, 6)."""

    def turn(self) -> np.ndarray:
        """Return heights of the undeformed point along [m] over one turn of the crank, (t,)."""
        angles = np.linspace(0.0, 2 * np.pi / self.joint.rate, 721)
        return self.joint.piston_pin(angles, self.anchor[0])[:, 0]


def held_point(scene: Scene, name: str, body: FlexibleBody) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the place of a slider-crank's point on a body [m], (3,), force and moment about the component's origin of
    forces there, (3, 6), and its elastic rows, (3, m)."""
    joint, position = scene.cranks()[name], np.asarray(scene.body[body.name].position)
    if joint.interface is None:
        arm, resultant = rigid_point(scene, body, joint.at or (0.0, 0.0, 0.0), f"joint.{name}.at", "'mean'")
        return position + arm, resultant, np.empty((3, 0))
    load = load_of(body, joint.interface, f"joint.{name}.interface")
    if len(load.rows) != 3:
        raise SceneError(f"joint.{name}.interface: '{joint.interface}' is no interface of kind 'mean'")
    return position + load.point, load.resultant, load.rows


def rigid_point(
    scene: Scene, body: FlexibleBody, position: tuple[float, float, float], key: str, kinds: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return a point of a rigid body from its origin [m], (3,), and the resultant of forces there, (3, 6)."""
    if len(body.modal.angular_frequencies):
        raise SceneError(f"{key}: body '{body.name}' is elastic; name an interface of kind {kinds}")
    arm = turned_vectors(scene.body[body.name], position)
    return arm, np.column_stack([np.eye(3), np.cross(arm, np.eye(3))])


def load_of(body: FlexibleBody, interface: str, key: str) -> LoadModes:
    """Return the rows of a load or joint on a body; a SceneError that begins with `key` if it has none."""
    return named(body.modal.loads, interface, f"{key}: body '{body.name}' has no load or joint surface")
