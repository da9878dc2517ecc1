"""A rigid half-space."""

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from gudgeon.solver.numbers import Strict
from gudgeon.solver.vectors import Direction, Place, Velocity, unit

PARALLEL = 1 - 1e-9
"""Cosine of the angle of two normals above which their planes have no edge."""


class Edge(Strict):
    """A plane of another face of the same convex solid."""

    point: Place = Field(description="A point of the plane [m]")
    normal: Direction = Field(description="Normal out of the solid, of any length")


class Plane(Strict):
    """The half-space behind a plane; with edges, one face of a convex solid."""

    clearance: ClassVar[str] = "move contact.{name}.against.point"
    """What makes room for points that start inside."""

    shape: Literal["plane"]
    point: Place = Field(description="A point of the plane [m]")
    normal: Direction = Field(description="Normal out of the obstacle, of any length")
    velocity: Velocity = Field(
        default=(0.0, 0.0, 0.0), description="Velocity of the obstacle's surface, tangential to it, for friction [m/s]"
    )

    edges: tuple[Edge, ...] = Field(
        default=(),
        exclude_if=lambda value: not value,
        description="Planes of other faces of the same convex solid, which end this face: a point meets the face where"
        " its gap to this plane is the largest of all; method 'residual' or 'penalty' alone",
    )

    @model_validator(mode="after")
    def _ends(self) -> "Plane":
        if any(unit(self.normal) @ unit(e.normal) > PARALLEL for e in self.edges):
            raise ValueError("edges: a plane parallel to the face cannot end it")
        return self

    @model_validator(mode="after")
    def _along(self) -> "Plane":
        normal, speed = np.asarray(self.normal, float), np.asarray(self.velocity, float)
        if abs(normal @ speed) > 1e-9 * np.linalg.norm(normal) * np.linalg.norm(speed):
            raise ValueError("velocity must lie in the plane; a plane that moves along its normal is a body")
        return self

    def gap(self, points: np.ndarray) -> np.ndarray:
        """Return the gaps [m], (c,), of points (c, 3)."""
        return (points - np.asarray(self.point)) @ unit(self.normal)

    def leads(self, points: np.ndarray) -> np.ndarray:
        """Return by how much the gap of points, (c, 3), exceeds that to each of e edges [m], (c, e)."""
        gaps = [(points - np.asarray(e.point)) @ unit(e.normal) for e in self.edges]
        return self.gap(points)[:, None] - np.array(gaps).reshape(len(gaps), len(points)).T

    def beside(self, points: np.ndarray) -> np.ndarray:
        """Return which points, (c, 3), meet another face of the solid, (c,)."""
        return np.asarray((self.leads(points) < 0).any(axis=1))

    def lateral(self, normals: np.ndarray) -> np.ndarray:
        """Return the tangents along which the surface curves at points with these normals, (c, 3): zero, none."""
        return np.zeros_like(normals)

    def direction(self, points: np.ndarray) -> np.ndarray:
        """Return the gaps' gradients, unit vectors away from the obstacle, (c, 3)."""
        return np.broadcast_to(unit(self.normal), points.shape).copy()
