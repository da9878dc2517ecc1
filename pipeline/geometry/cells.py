"""Types of cells: nodes, edges and faces in the order of meshio and VTK, names elsewhere; the boundary of a mesh.

A new type is a line of `CELLS`. Who draws, writes or couples a mesh asks its cell, by `cell_of`, and names no type.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError


@dataclass(frozen=True, eq=False)
class Polytope:
    """A reference cell of straight edges."""

    dimension: int
    corners: int
    edges: np.ndarray
    """Corners at the ends of each edge, in the order of the mid-side nodes, (m, 2)."""
    sides: list[list[int]]
    """Corners of each side of the boundary: outward on a solid, with a plane part on their left."""

    @classmethod
    def of(cls, dimension: int, corners: int, edges: str, sides: str) -> Self:
        """Return it with its edges and sides as words of corners."""
        ends, faces = ([[int(corner) for corner in word] for word in words.split()] for words in (edges, sides))
        return cls(dimension, corners, np.array(ends, int).reshape(-1, 2), faces)


POINT = Polytope.of(0, 1, "", "")
LINE = Polytope.of(1, 2, "01", "0 1")
TRIANGLE = Polytope.of(2, 3, "01 12 20", "01 12 20")
TETRAHEDRON = Polytope.of(3, 4, "01 12 20 03 13 23", "021 013 123 032")
HEXAHEDRON = Polytope.of(3, 8, "01 12 23 30 45 56 67 74 04 15 26 37", "0321 4567 0154 1265 2376 3047")
WEDGE = Polytope.of(3, 6, "01 12 20 34 45 53 03 14 25", "021 345 0143 1254 2035")
EDGES = {shape.dimension: shape.edges for shape in (LINE, TRIANGLE, TETRAHEDRON)}


@dataclass(frozen=True, eq=False)
class Cell:
    """A type of cell."""

    name: str
    """As records have it."""
    shape: Polytope
    quadratic: bool = False
    """Whether a node is in the middle of each edge."""
    dofs: int = 0
    """Degrees of freedom of a node of its elements; 0 where nothing is assembled: such cells are only drawn."""
    universal: tuple[int, Sequence[int]] | None = None
    """Descriptor in universal files, and its nodes in their order: around and upwards, with mid-edge nodes between
    corners."""
    meshio: str = ""
    """Its name there, where it differs."""

    @property
    def dimension(self) -> int:
        """3 of solids, 2 of plane parts, 1 of bars and beams, 0 of points."""
        return self.shape.dimension

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return self.shape.corners + self.quadratic * len(self.shape.edges)

    @property
    def solid(self) -> bool:
        """Whether elements of a solid are made of it."""
        return self.dimension == 3 and self.dofs > 0

    @property
    def axial(self) -> bool:
        """Whether its nodes move along an axis only, as those of bars."""
        return self.dofs == 1

    @property
    def spatial(self) -> bool:
        """Whether its nodes move along and rotate about all axes, as those of beams in space."""
        return self.dofs == 6

    @cached_property
    def faces(self) -> list[list[int]]:
        """Nodes of each side of the boundary, as of its polytope, corners first, in the order of Abaqus."""
        corners, edges = self.shape.corners, self.shape.edges.tolist() if self.quadratic else []
        middle = {frozenset(ends): corners + k for k, ends in enumerate(edges)}
        faces = []
        for side in self.shape.sides:
            around = map(frozenset, zip(side, (*side[1:], side[0]), strict=True))
            faces.append([*side, *dict.fromkeys(middle[ends] for ends in around if ends in middle)])
        return faces


TETRA10 = Cell("tetra10", TETRAHEDRON, quadratic=True, dofs=3, universal=(118, (0, 4, 1, 5, 2, 6, 7, 8, 9, 3)))
TRIANGLE6 = Cell("triangle6", TRIANGLE, quadratic=True, dofs=2, universal=(92, (0, 3, 1, 4, 2, 5)))
LINE3 = Cell("line3", LINE, quadratic=True, dofs=1, universal=(11, (0, 1)))
BEAM2 = Cell("beam2", LINE, dofs=2, universal=(21, (0, 1)), meshio="line")
BEAM3 = Cell("beam3", LINE, quadratic=True, dofs=2, universal=(21, (0, 1)), meshio="line3")
FRAME2 = Cell("frame2", LINE, dofs=6, universal=(21, (0, 1)), meshio="line")
VERTEX = Cell("vertex", POINT)
NODES = Cell("nodes", POINT, meshio="vertex")
TETRA4 = Cell("tetra", TETRAHEDRON, universal=(111, range(4)))
HEXAHEDRON8 = Cell("hexahedron", HEXAHEDRON, universal=(115, range(8)))
HEXAHEDRON20 = Cell(
    "hexahedron20", HEXAHEDRON, quadratic=True,
    universal=(116, (0, 8, 1, 9, 2, 10, 3, 11, 16, 17, 18, 19, 4, 12, 5, 13, 6, 14, 7, 15)),
)  # fmt: skip
WEDGE6 = Cell("wedge", WEDGE)
WEDGE15 = Cell(
    "wedge15", WEDGE, quadratic=True, universal=(113, (0, 6, 1, 7, 2, 8, 12, 13, 14, 3, 9, 4, 10, 5, 11))
)  # fmt: skip
CELLS = {cell.name: cell for cell in list(globals().values()) if isinstance(cell, Cell)}

FLAT_TRIANGLES = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
"""Flat triangles that make up one of six nodes."""
GMSH_ORDER = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]
"""gmsh numbers the last two edges of a tet10 the other way round."""
MIRRORED_TETRA = [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]
MIRRORED_TRIANGLE = [0, 2, 1, 5, 4, 3]


def cell_of(mesh: MeshRecord) -> Cell:
    """Return the type of a mesh's cells; those of a foreign record count as points."""
    return CELLS.get(mesh.cell_type) or Cell(mesh.cell_type, POINT)


def compacted(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the points that cells use, the cells renumbered, and the new number of each old point, -1 if unused."""
    used, numbers = np.unique(cells, return_inverse=True)
    new_number = np.full(len(points), -1)
    new_number[used] = np.arange(len(used))
    return points[used], numbers.reshape(cells.shape), new_number


def side_counts(cells: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Return how many elements share each side of each element, (e, k); 1 on the boundary.

    Args:
        sides: Local node numbers of the k sides, (k, s), of which the first k − 1 are corners.
    """
    corners = np.sort(cells[:, sides[:, : len(sides) - 1]].reshape(-1, len(sides) - 1), axis=1)
    _, inverse, count = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
    return count[inverse.reshape(-1, len(sides))]


def outer_faces(cells: np.ndarray, cell: Cell = TETRA10) -> np.ndarray:
    """Return the faces of tetrahedra, or the edges of triangles, that belong to one of them only, (f, s)."""
    sides = np.array(cell.faces)
    return cells[:, sides][side_counts(cells, sides) == 1]


def quadratic_basis(L: np.ndarray, shape: Polytope = TRIANGLE) -> tuple[np.ndarray, np.ndarray]:
    """Return N (…, a) and ∂N/∂ξ (…, a, k) of a quadratic simplex at area coordinates 1 − Σ ξ and ξ (…, k + 1)."""
    (a, b), k = shape.edges.T, shape.dimension
    dL = np.vstack([-np.ones(k), np.eye(k)])
    N = np.concatenate([L * (2 * L - 1), 4 * L[..., a] * L[..., b]], axis=-1)
    middles = 4 * (dL[a] * L[..., b, None] + dL[b] * L[..., a, None])
    return N, np.concatenate([dL * (4 * L - 1)[..., None], middles], axis=-2)


def turned(nodes: np.ndarray, triangles: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return six-node triangles (f, 6) whose corners run about `normal` (3,) by the right hand."""
    a, b, c = np.moveaxis(nodes[triangles[:, :3]], 1, 0)
    against = np.cross(b - a, c - a) @ normal < 0
    return np.where(against[:, None], triangles[:, MIRRORED_TRIANGLE], triangles)


def boundary_facets(cells: np.ndarray, path: str) -> tuple[np.ndarray, np.ndarray]:
    """Return cell and face number (f, 2) of each boundary facet and its nodes (f, 3) or (f, 6), outward.

    Raises:
        InputError: a face belongs to more than two tetrahedra; `path` is their file.
    """
    sides = np.array((TETRA10 if cells.shape[1] == 10 else TETRA4).faces)
    shared = side_counts(cells, sides)
    if shared.max() > 2:
        count = round(float((1 / shared[shared > 2]).sum()))
        raise InputError(f"{path}: {count} faces belong to more than two tetrahedra; allowed: two")
    return np.argwhere(shared == 1), cells[:, sides][shared == 1]
