"""Plane parts in z = 0: their common keys and edges, and the rectangle."""

from typing import Literal

import numpy as np
from pydantic import Field

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import TRIANGLE6, outer_faces, turned
from gudgeon.pipeline.geometry.mesh_estimate import refuse_large
from gudgeon.pipeline.geometry.occ import GMSH_TRIANGLE6, ON_SURFACE, meshing, nodes_and_cells
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, box_faces, distance
from gudgeon.solver.numbers import Length, Strict

UP = np.array([0.0, 0.0, 1.0])


class PlanePart(Strict):
    """A part of constant thickness that moves in its plane only."""

    thickness: Length = Field(description="Thickness across the plane [m]")
    state: Literal["plane-stress", "plane-strain"] = Field(
        default="plane-stress",
        description="plane-stress: a thin sheet with no stress across it; plane-strain: a slice of a long body",
    )


class Rectangle(PlanePart):
    """Rectangle centred in x and y. All lengths in metres."""

    kind: Literal["rectangle"]
    lx: Length = Field(description="Length along x")
    ly: Length = Field(description="Length along y")

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        """Return the named edges with the true shape of each."""
        faces = box_faces(self.lx, self.ly, self.thickness)
        edges = {"left": "left", "right": "right", "bottom": "front", "top": "back"}
        return {name: faces[face] | {"thickness": self.thickness} for name, face in edges.items()}

    def build(self, size: float) -> MeshRecord:
        """Mesh the rectangle with triangles of six nodes and edge length `size` [m].

        Raises:
            InputError: the size is so large that nothing is meshed.
            StageError: gmsh failed.
        """
        refuse_large("plane", 2.3 * self.lx * self.ly / size**2, size)
        with meshing(size, {}) as gmsh:
            gmsh.model.occ.addRectangle(-self.lx / 2, -self.ly / 2, 0, self.lx, self.ly)
            gmsh.model.occ.synchronize()
            gmsh.model.mesh.generate(2)
            gmsh.model.mesh.setOrder(2)
            nodes, cells, _ = nodes_and_cells(gmsh.model.mesh, GMSH_TRIANGLE6, list(range(6)))
        if not len(cells):
            raise InputError(f"mesh.size: at {size} m gmsh makes no element, try a smaller size")
        cells = turned(nodes, cells, UP)
        edges, surfaces = outer_faces(cells, TRIANGLE6), {}
        for name, shape in self.surface_shapes().items():
            off = distance(nodes[edges], shape).max(axis=1)
            surfaces[name] = Surface(edges[off < ON_SURFACE * max(self.lx, self.ly)], shape)
        return MeshRecord(nodes, cells, TRIANGLE6.name, surfaces)
