"""A rigid body without mesh: mass, principal inertia, and the points where it has contact or supports."""

from typing import Literal

import numpy as np
from pydantic import Field

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.geometry.cells import VERTEX
from gudgeon.pipeline.geometry.numbers import NonZero, Point
from gudgeon.pipeline.geometry.surfaces import point_surface
from gudgeon.solver.numbers import Area, Mass, Moments, Name, Strict


class RigidPoint(Strict):
    """A point on the surface of the body."""

    at: Point = Field(description="Position from the centre of mass [m]")
    normal: NonZero = Field(description="Outward normal, of any length")
    area: Area = Field(
        default=1.0,
        description="Tributary area [m^2]; with 1, a surface_stiffness is the point's own in N/m",
    )


class Rigid(Strict):
    """Rigid body with its centre of mass at the origin."""

    kind: Literal["rigid"]
    mass: Mass = Field(description="Mass")
    inertia: Moments = Field(
        default=(0.0, 0.0, 0.0),
        description="Principal inertia about x, y, z [kg m^2]; the body does not rotate about an axis with 0",
    )
    points: dict[Name, RigidPoint] = Field(default={}, description="Points of contact, joints and supports, by name")

    def build(self, size: float | None) -> MeshRecord:
        """Return a node at the centre and one at each point, with a surface for each point."""
        positions = [np.zeros(3), *(np.array(point.at) for point in self.points.values())]
        surfaces = {}
        for node, (name, point) in enumerate(self.points.items(), start=1):
            normal = np.array(point.normal) / np.linalg.norm(point.normal)
            surfaces[name] = point_surface(node, normal, point.area, positions[node])
        return MeshRecord(np.array(positions), np.arange(len(positions))[:, None], VERTEX.name, surfaces)
