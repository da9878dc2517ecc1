"""A rigid half-space."""

from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from solver.obstacles.vectors import Direction, Vector


class Plane(BaseModel):
    """Half-space behind a plane."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    shape: Literal["plane"]
    point: Annotated[Vector, Field(description="A point of the plane [m]")]
    normal: Annotated[Direction, Field(description="Out of the obstacle, any length")]

    def gap(self, points: np.ndarray) -> np.ndarray:
        """Return the gaps [m], (c,), of points (c, 3)."""
        return (points - np.asarray(self.point)) @ self._unit()

    def direction(self, points: np.ndarray) -> np.ndarray:
        """Return the gaps' gradients, unit vectors away from the obstacle, (c, 3)."""
        return np.broadcast_to(self._unit(), points.shape).copy()

    def _unit(self) -> np.ndarray:
        normal = np.asarray(self.normal, float)
        return normal / np.linalg.norm(normal)
