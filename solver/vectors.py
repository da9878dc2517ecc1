"""Types of vectors in a scene file; a direction is not zero."""

from typing import Annotated

import numpy as np
from pydantic import AfterValidator

from gudgeon.solver.numbers import Acceleration, AngularVelocity, Component, Coordinate, Speed

Place = tuple[Coordinate, Coordinate, Coordinate]
"""Position [m]."""
Velocity = tuple[Speed, Speed, Speed]
Spin = tuple[AngularVelocity, AngularVelocity, AngularVelocity]
Gravity = tuple[Acceleration, Acceleration, Acceleration]
ROUND_OFF = 1e-15
"""Component of a direction over the largest one that is zero."""


def _without_round_off(vector: tuple[float, ...]) -> tuple[float, ...]:
    """Return a vector whose components of round-off are zero."""
    largest = max(map(abs, vector))
    if 0 < largest < ROUND_OFF:
        raise ValueError(f"{list(vector)} given; allowed magnitude of the largest: {ROUND_OFF:g} to 1e+15")
    limit = ROUND_OFF * largest
    return tuple(0.0 if abs(component) <= limit else component for component in vector)


Vector = Annotated[tuple[Component, Component, Component], AfterValidator(_without_round_off)]
Quaternion = Annotated[tuple[Component, Component, Component, Component], AfterValidator(_without_round_off)]


def _directed(vector: tuple[float, ...]) -> tuple[float, ...]:
    if not any(vector):
        raise ValueError("the vector is zero, it must have a direction")
    return vector


Direction = Annotated[Vector, AfterValidator(_directed)]
"""Direction of any length."""


def unit(vector: tuple[float, ...] | np.ndarray) -> np.ndarray:
    """Return a vector at length 1, (3,)."""
    array = np.asarray(vector, float)
    return array / np.linalg.norm(array)


def rotation_of(rotation: np.ndarray) -> np.ndarray:
    """Return the rotation matrix of a rotation vector [rad], (3, 3)."""
    angle = float(np.linalg.norm(rotation))
    if angle == 0:
        return np.eye(3)
    x, y, z = rotation / angle
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew


def length_across(vectors: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return the length of vectors (…, 3) across a unit vector, (…)."""
    return np.linalg.norm(vectors - (vectors @ along)[..., None] * along, axis=-1)


def frame_along(axis: np.ndarray) -> np.ndarray:
    """Return three axes as columns, the third one given, a unit vector, (3, 3)."""
    x = np.eye(3)[np.abs(axis).argmin()]
    x = x - (x @ axis) * axis
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])
