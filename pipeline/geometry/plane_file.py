"""A plane part from a mesh file: triangles of six nodes in z = 0, with named edges.

Edges get their names as surfaces of solids do: from gmsh's physical groups of dimension 1, from sets of lines or nodes,
or from integer cell or point arrays (non-zero = member). All of the boundary is `edge`.
"""

from typing import Any, Literal

import numpy as np
from pydantic import Field

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import TRIANGLE6, compacted, outer_faces, turned
from gudgeon.pipeline.geometry.mesh_file import named_facets, read_mesh, scaled_points
from gudgeon.pipeline.geometry.shapes.plane import UP, PlanePart
from gudgeon.pipeline.geometry.soundness import refuse_pieces
from gudgeon.solver.numbers import Length

FLAT = 1e-9
"""How far nodes may lie off z = 0, relative to the part's size."""
EDGE = "edge"


class PlaneFile(PlanePart):
    """A mesh of triangles in a file."""

    kind: Literal["plane-file"]
    path: str = Field(description="File of the mesh, from the folder of the scene")
    unit: Length = Field(default=1.0, description="Metres per unit of length of the file")

    def build(self, size: float | None) -> MeshRecord:
        """Read the mesh; `size` is not used, the file has its own.

        Raises:
            InputError: the file is missing, no mesh, or not one part of six-node triangles in z = 0.
        """
        mesh = read_mesh(self.path)
        points = scaled_points(mesh, self.unit, self.path)
        nodes, cells, new_number = compacted(points, _triangles(mesh, self.path))
        off = float(np.abs(nodes[:, 2]).max())
        if off > FLAT * np.ptp(nodes, axis=0).max():
            raise InputError(f"{self.path}: nodes lie up to {off:.3g} m off z = 0, allowed: a plane part in z = 0")
        cells = turned(nodes, cells, UP)
        edges = outer_faces(cells, TRIANGLE6)
        members = {EDGE: np.ones(len(edges), bool)} | named_facets(mesh, new_number, edges, dimension=1)
        shape = {"thickness": self.thickness}
        surfaces = {name: Surface(edges[chosen], shape) for name, chosen in members.items()}
        record = MeshRecord(nodes, cells, TRIANGLE6.name, surfaces)
        refuse_pieces(record, self.path)
        return record


def _triangles(mesh: Any, path: str) -> np.ndarray:
    """Return the file's triangles (e, 6); other faces and solids are refused, lines and points omitted."""
    kinds = {block.type for block in mesh.cells if len(block.data) and block.dim >= 2}
    if kinds != {TRIANGLE6.name}:
        raise InputError(
            f"{path}: has {', '.join(sorted(kinds)) or 'no triangles'}; a plane part is made of triangle6 alone,"
            " quadratic triangles of six nodes"
        )
    return np.concatenate([block.data for block in mesh.cells if block.type == TRIANGLE6.name])
