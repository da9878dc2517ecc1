"""A plane ring: the section of a bearing bush, a pin or a tube."""

from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.geometry.cells import TRIANGLE6, outer_faces, turned
from gudgeon.pipeline.geometry.mesh_estimate import refuse_large
from gudgeon.pipeline.geometry.shapes.plane import UP, PlanePart
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, cylinder
from gudgeon.solver.numbers import Length

FEWEST = 12
"""Elements about the axis."""


class Ring(PlanePart):
    """Ring about the origin, of evenly spaced triangles that grow with the radius. All lengths in metres."""

    kind: Literal["ring"]
    inner_radius: Length = Field(description="Of the hole, along which elements have the size of the mesh [m]")
    outer_radius: Length = Field(description="Outer radius [m]")

    @model_validator(mode="after")
    def _wall(self) -> "Ring":
        if self.outer_radius <= self.inner_radius:
            raise ValueError(f"outer_radius: {self.outer_radius:g} m is not above inner_radius {self.inner_radius:g} m")
        return self

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        """Return the named edges with the true shape of each."""
        radii = {"inner": self.inner_radius, "outer": self.outer_radius}
        return {name: cylinder(radius) | {"thickness": self.thickness} for name, radius in radii.items()}

    def build(self, size: float) -> MeshRecord:
        """Mesh the ring with triangles of six nodes and an edge length of `size` [m] along the hole.

        Raises:
            InputError: the mesh would be too large.
        """
        around = max(FEWEST, round(2 * np.pi * self.inner_radius / size))
        ratio = self.outer_radius / self.inner_radius
        layers = max(1, round(np.log(ratio) / (2 * np.pi / around)))
        refuse_large("plane", 2.0 * around * layers, size)
        n, m = 2 * around, 2 * layers
        radii, turn = self.inner_radius * ratio ** (np.arange(m + 1) / m), 2 * np.pi / n * np.arange(n)
        plane = np.stack(np.broadcast_arrays(radii[:, None] * np.cos(turn), radii[:, None] * np.sin(turn), 0.0), -1)
        j, i = (grid.ravel() for grid in np.meshgrid(2 * np.arange(layers), 2 * np.arange(around), indexing="ij"))

        def at(layer: int, column: int) -> np.ndarray:
            return (j + layer) * n + (i + column) % n

        low = [at(0, 0), at(0, 2), at(2, 2), at(0, 1), at(1, 2), at(1, 1)]
        high = [at(0, 0), at(2, 2), at(2, 0), at(1, 1), at(2, 1), at(1, 0)]
        nodes = plane.reshape(-1, 3)
        cells = turned(nodes, np.concatenate([np.column_stack(low), np.column_stack(high)]), UP)
        edges = outer_faces(cells, TRIANGLE6)
        at_hole = edges[:, 2] < n
        facets = {"inner": edges[at_hole], "outer": edges[~at_hole]}
        shapes = self.surface_shapes()
        return MeshRecord(nodes, cells, TRIANGLE6.name, {name: Surface(facets[name], shapes[name]) for name in shapes})
