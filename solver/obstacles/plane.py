"""A rigid half-space."""

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from gudgeon.solver.numbers import Strict
from gudgeon.solver.vectors import Direction, Place, Velocity, unit


class Plane(Strict):
    """The half-space behind a plane."""

    clearance: ClassVar[str] = "move contact.{name}.against.point"
    """What makes room for points that start inside."""

    shape: Literal["plane"]
    point: Place = Field(description="A point of the plane [m]")
    normal: Direction = Field(description="Normal out of the obstacle, of any length")
    velocity: Velocity = Field(
        default=(0.0, 0.0, 0.0), description="Velocity of the obstacle's surface, tangential to it, for friction [m/s]"
    )

    @model_validator(mode="after")
    def _along(self) -> "Plane":
        normal, speed = np.asarray(self.normal, float), np.asarray(self.velocity, float)
        if abs(normal @ speed) > 1e-9 * np.linalg.norm(normal) * np.linalg.norm(speed):
            raise ValueError("velocity must lie in the plane; a plane that moves along its normal is a body")
        return self

    def gap(self, points: np.ndarray) -> np.ndarray:
        """Return the gaps [m], (c,), of points (c, 3)."""
        return (points - np.asarray(self.point)) @ unit(self.normal)

    def lateral(self, normals: np.ndarray) -> np.ndarray:
        """Return the tangents along which the surface curves at points with these normals, (c, 3): zero, none."""
        return np.zeros_like(normals)

    def direction(self, points: np.ndarray) -> np.ndarray:
        """Return the gaps' gradients, unit vectors away from the obstacle, (c, 3)."""
        return np.broadcast_to(unit(self.normal), points.shape).copy()
