"""Local systems of decks: rotation and origin of Cartesian axes in the basic ones."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from gudgeon.pipeline.geometry.decks.model import Source

THIN = 1e-12
"""Least sine of the angle between two directions that span a plane."""


@dataclass(frozen=True)
class Axes:
    """Cartesian axes."""

    turn: np.ndarray = field(default_factory=lambda: np.eye(3))
    """Their directions as columns, (3, 3)."""
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def placed(self, points: np.ndarray) -> np.ndarray:
        """Return points (k, 3) of these axes in the basic ones."""
        return points @ self.turn.T + self.origin

    def turned(self, a: np.ndarray, b: np.ndarray, angle: float, source: Source) -> "Axes":
        """Return these axes turned about the line from a to b by an angle [deg], by the right hand.

        Raises:
            InputError: both points are one.
        """
        direction = b - a
        length = float(np.linalg.norm(direction))
        if not length > 0:
            raise source.error("both points of the axis of a rotation are the same")
        x, y, z = direction / length
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        R = c * np.eye(3) + s * cross + (1 - c) * np.outer([x, y, z], [x, y, z])
        return Axes(R @ self.turn, R @ (self.origin - a) + a)


def axes_of(numbers: Sequence[float], source: Source) -> Axes:
    """Return the axes of a `*SYSTEM`: origin, a point of x, a point of the plane x, y; the latter two may be missing.

    Raises:
        InputError: the points are on a line.
    """
    values = np.array([*numbers, *[0.0] * 9][:9]).reshape(3, 3)
    origin, on_x, in_plane = values
    if len(numbers) <= 3:
        return Axes(np.eye(3), origin)
    x = on_x - origin
    z = np.cross(x, in_plane - origin) if len(numbers) > 6 else np.array([0.0, 0.0, 1.0])
    return from_z_x(origin, z, x, source)


def from_z_x(origin: np.ndarray, z: np.ndarray, x: np.ndarray, source: Source) -> Axes:
    """Return axes with a direction of z and a vector of the half plane of positive x.

    Raises:
        InputError: the vectors have one direction.
    """
    y = np.cross(z, x)
    if not np.linalg.norm(y) > THIN * np.linalg.norm(z) * np.linalg.norm(x):
        raise source.error("the three points of a coordinate system are on a line")
    across = np.cross(y, z)
    columns = [vector / np.linalg.norm(vector) for vector in (across, y, z)]
    return Axes(np.column_stack(columns), origin)


def in_system(origin: np.ndarray, on_x: np.ndarray, in_plane: np.ndarray, source: Source) -> np.ndarray:
    """Return the directions of axes by their origin, a point of x and one of the plane of x and y, as columns (3, 3).

    Raises:
        InputError: the points are on a line.
    """
    x = on_x - origin
    return from_z_x(origin, np.cross(x, in_plane - origin), x, source).turn


def by_angles(angles: np.ndarray) -> np.ndarray:
    """Return the axes that rotations about z, then the new x, then the new y make [deg], (3,), as columns (3, 3)."""
    (cz, cx, cy), (sz, sx, sy) = np.cos(np.radians(angles)), np.sin(np.radians(angles))
    about_z = np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    about_y = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    return np.asarray(about_z @ about_x @ about_y)
