"""Plane parts in z = 0: what they share, and the rectangle."""

from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, Field

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.geometry.numbers import STRICT, Length
from gudgeon.pipeline.geometry.occ import GMSH_TRIANGLE6, ON_SURFACE, SurfaceRule, plane

EDGES = np.array([[0, 1, 3], [1, 2, 4], [2, 0, 5]])
"""First corner, second corner, middle of each edge of a triangle of positive area, the part on the left."""
MIRRORED = [0, 2, 1, 5, 4, 3]


class PlanePart(BaseModel):
    """A part of constant thickness that moves in its plane alone."""

    model_config = STRICT
    thickness: Length = Field(description="Across the plane [m]")
    state: Literal["plane-stress", "plane-strain"] = Field(
        default="plane-stress",
        description="plane-stress: a thin sheet, free to thin; plane-strain: a slice of a long body, which is not",
    )


class Rectangle(PlanePart):
    """Rectangle centred in x and y. All lengths in metres."""

    kind: Literal["rectangle"]
    lx: Length
    ly: Length

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        """Return the named edges with the true shape of each."""
        x, y = self.lx / 2, self.ly / 2
        edges = {
            "left": plane((-1, 0, 0), (-x, 0, 0)),
            "right": plane((1, 0, 0), (x, 0, 0)),
            "bottom": plane((0, -1, 0), (0, -y, 0)),
            "top": plane((0, 1, 0), (0, y, 0)),
        }
        return {name: shape | {"thickness": self.thickness} for name, shape in edges.items()}

    def build(self, size: float) -> MeshRecord:
        """Mesh the rectangle with triangles of six nodes and edge length `size` [m]."""
        nodes, cells = _meshed(lambda occ: occ.addRectangle(-self.lx / 2, -self.ly / 2, 0, self.lx, self.ly), size)
        edges, surfaces = boundary_edges(cells), {}
        for name, shape in self.surface_shapes().items():
            off = np.abs((nodes[edges] - shape["origin"]) @ np.array(shape["normal"])).max(axis=1)
            surfaces[name] = Surface(edges[off < ON_SURFACE * max(self.lx, self.ly)], shape)
        return MeshRecord(nodes, cells, "triangle6", surfaces)


def boundary_edges(cells: np.ndarray) -> np.ndarray:
    """Return the edges that belong to one triangle (e, 6) only, the part on their left, (f, 3)."""
    edges = cells[:, EDGES].reshape(-1, 3)
    _, first, count = np.unique(edges[:, 2], return_index=True, return_counts=True)
    return edges[np.sort(first[count == 1])]


def counter_clockwise(nodes: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return triangles (e, 6) whose corners run about +z."""
    a, b, c = np.moveaxis(nodes[cells[:, :3]], 1, 0)
    clockwise = np.cross(b - a, c - a)[:, 2] < 0
    return np.where(clockwise[:, None], cells[:, MIRRORED], cells)


def _meshed(draw: Any, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes (n, 3) and triangles (e, 6) of what is drawn into gmsh's OCC model.

    Raises:
        InputError: the size is so large that nothing is meshed.
        StageError: gmsh failed.
    """
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        draw(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(2)
        tags, positions, _ = gmsh.model.mesh.getNodes()
        _, corners = gmsh.model.mesh.getElementsByType(GMSH_TRIANGLE6)
    except Exception as error:
        raise StageError(f"gmsh: {str(error).splitlines()[0]}") from error
    finally:
        gmsh.finalize()
    if not len(corners):
        raise InputError(f"mesh.size: at {size} m gmsh makes no element, try a smaller size")
    used, cells = np.unique(corners.astype(int), return_inverse=True)
    row = np.empty(int(tags.max()) + 1, int)
    row[tags.astype(int)] = np.arange(len(tags))
    nodes = positions.reshape(-1, 3)[row[used]]
    return nodes, counter_clockwise(nodes, cells.reshape(-1, 6))
