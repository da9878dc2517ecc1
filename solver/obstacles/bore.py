"""A rigid cylindrical bore around a body: the exact cylinder, without facets."""

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from gudgeon.solver.numbers import Length, Strict
from gudgeon.solver.vectors import Direction, Place, unit


class Bore(Strict):
    """The inside of a circular cylinder."""

    clearance: ClassVar[str] = "enlarge contact.{name}.against.radius"
    """What makes room for points that start inside."""

    shape: Literal["bore"]
    radius: Length = Field(description="Radius")
    axis: Direction = Field(default=(0.0, 0.0, 1.0), description="Direction of the axis")
    origin: Place = Field(default=(0.0, 0.0, 0.0), description="A point of the axis [m]")

    def gap(self, points: np.ndarray) -> np.ndarray:
        """Return the gaps [m], (c,), of points (c, 3)."""
        return self.radius - np.linalg.norm(self._radial(points), axis=1)

    def lateral(self, normals: np.ndarray) -> np.ndarray:
        """Return the tangents along which the surface curves at points with these normals, (c, 3): around the axis."""
        return np.cross(unit(self.axis), normals)

    def direction(self, points: np.ndarray) -> np.ndarray:
        """Return the gaps' gradients, unit vectors towards the axis, (c, 3)."""
        radial = self._radial(points)
        return -radial / np.linalg.norm(radial, axis=1, keepdims=True)

    def _radial(self, points: np.ndarray) -> np.ndarray:
        axis = unit(self.axis)
        arm = points - np.asarray(self.origin, float)
        return arm - np.outer(arm @ axis, axis)
