"""A scene turned as a whole: bodies, obstacles, joints, forces, velocities and gravity. Its scalars stay the same."""

from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel
from scipy.spatial.transform import Rotation

from gudgeon.pipeline.robustness.units import with_values
from gudgeon.solver.forces.bushing import Bushing
from gudgeon.solver.forces.fields.electrostatic import Electrostatic
from gudgeon.solver.scene.body import ALL_FREE, Body
from gudgeon.solver.scene.orientation import Orientation, quaternion_of

VECTORS = (
    "position", "velocity", "angular_velocity", "point", "normal", "axis", "origin", "direction", "centre", "along",
    "lateral", "gravity", "force", "moment", "against_axis",
)  # fmt: skip
"""Keys of vectors in the axes of the scene."""
MATRICES = ("stiffness", "rotational_stiffness", "coupling", "damping", "rotational_damping", "coupling_damping")
"""Keys of matrices in the axes of the scene, of bushings."""
PARTS = ("body", "contact", "joint", "force", "motion", "run")
"""Parts of a scene with vectors; those of components are in their own axes."""
ANY = Orientation(axis=(0.3, -0.5, 0.8), angle=137.0)
"""A rotation without symmetry."""
CYCLIC = Orientation(quaternion=(0.5, 0.5, 0.5, 0.5))
"""The axes x, y, z become y, z, x: the only kind of rotation that `freedom` can name."""

Scene = TypeVar("Scene", bound=BaseModel)


def turned(scene: Scene) -> Scene:
    """Return a scene turned as a whole, by `CYCLIC` where a body's freedom names axes, and by `ANY` otherwise."""
    bodies: Mapping[str, Body] = scene.body  # type: ignore[attr-defined]
    constrained = any(tuple(body.freedom) != ALL_FREE for body in bodies.values())
    Q = (CYCLIC if constrained else ANY).matrix()
    return scene.model_copy(update={name: _turned(getattr(scene, name), Q) for name in PARTS})


def _turned(value: Any, Q: np.ndarray) -> Any:
    """Return a value with every vector in the axes of the scene turned, not checked again."""
    if isinstance(value, Mapping):
        return {key: _turned(item, Q) for key, item in value.items()}
    if not isinstance(value, BaseModel):
        return value
    changes: dict[str, Any] = {key: _turned_field(value, key, Q) for key in type(value).model_fields}
    if isinstance(value, Electrostatic):
        changes["turn"] = tuple(np.degrees(Rotation.from_matrix(Q @ value.axes()).as_rotvec()).tolist())
    if isinstance(value, Bushing):
        changes |= {key: _turned_matrix(getattr(value, key), Q) for key in MATRICES}
    if isinstance(value, Body):
        axes = np.eye(3) if value.orientation is None else value.orientation.matrix()
        changes["orientation"] = Orientation(quaternion=_without_round_off(np.array(quaternion_of(Q @ axes))))
        if tuple(value.freedom) != ALL_FREE:
            changes["freedom"] = tuple(motion[:-1] + "yzx"["xyz".index(motion[-1])] for motion in value.freedom)
    return with_values(value, changes)


def _turned_field(model: BaseModel, key: str, Q: np.ndarray) -> Any:
    """Return the value of a key of a model, turned if it is a vector in the axes of the scene or has such vectors."""
    value = getattr(model, key)
    ground = key == "against_at" and getattr(model, "against", "") is None
    if (key in VECTORS or ground) and isinstance(value, tuple):
        return _without_round_off(Q @ np.asarray(value, float))
    if isinstance(value, tuple) and value and all(isinstance(item, BaseModel) for item in value):
        return tuple(_turned(item, Q) for item in value)
    return _turned(value, Q) if isinstance(value, BaseModel) else value


def _turned_matrix(value: Any, Q: np.ndarray) -> Any:
    """Return the 3 × 3 matrix of a bushing, or its diagonal, along turned axes; what is equal along all stays."""
    if value is None or (np.ndim(value) == 1 and len(set(value)) == 1):
        return value
    matrix = np.diag(value) if np.ndim(value) == 1 else np.array(value, float)
    rotated = Q @ matrix @ Q.T
    if np.array_equal(matrix, matrix.T):
        rotated = 0.5 * (rotated + rotated.T)
    return tuple(map(tuple, rotated.tolist()))


def _without_round_off(vector: np.ndarray) -> tuple[Any, ...]:
    """Return a vector without components of round-off, which are out of the range of a scene's numbers."""
    threshold = 4 * float(np.finfo(float).eps) * float(np.linalg.norm(vector))
    return tuple(np.where(np.abs(vector) > threshold, vector, 0.0).tolist())
