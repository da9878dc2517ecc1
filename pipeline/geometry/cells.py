"""Types of cells: nodes, edges and faces in the order of meshio and VTK, names elsewhere; the boundary of a mesh.

A new type is a line of `CELLS`. Who draws, writes or couples a mesh asks its cell, by `cell_of`, and names no type.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Self

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
QUADRANGLE = Polytope.of(2, 4, "01 12 23 30", "01 12 23 30")
TETRAHEDRON = Polytope.of(3, 4, "01 12 20 03 13 23", "021 013 123 032")
HEXAHEDRON = Polytope.of(3, 8, "01 12 23 30 45 56 67 74 04 15 26 37", "0321 4567 0154 1265 2376 3047")
WEDGE = Polytope.of(3, 6, "01 12 20 34 45 53 03 14 25", "021 345 0143 1254 2035")
PYRAMID = Polytope.of(3, 5, "01 12 23 30 04 14 24 34", "0321 014 124 234 304")
ANY = Polytope.of(3, 0, "", "")
"""Of solids of several types."""
EDGES = {shape.dimension: shape.edges for shape in (LINE, TRIANGLE, TETRAHEDRON)}


@dataclass(frozen=True, eq=False)
class Cell:
    """A type of cell."""

    name: str
    """As records have it."""
    shape: Polytope
    quadratic: bool = False
    """Whether a node is in the middle of each edge."""
    centred: Sequence[int] = ()
    """Sides of the boundary with a node in their centre, in the order of these nodes, which follow those of the
    edges; the only side of a plane cell is 0."""
    interior: bool = False
    """Whether a node, the last one, is in the centre of a solid."""
    dofs: int = 0
    """Degrees of freedom of a node of its elements; 0 where nothing is assembled: such cells are only drawn."""
    universal: tuple[int, Sequence[int]] | None = None
    """Descriptor in universal files, and its nodes in their order: around and upwards, with mid-edge nodes between
    corners, without those in centres."""
    meshio: str = ""
    """Its name there, where it differs."""

    @property
    def dimension(self) -> int:
        """3 of solids, 2 of plane parts, 1 of bars and beams, 0 of points."""
        return self.shape.dimension

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return self.shape.corners + self.quadratic * len(self.shape.edges) + len(self.centred) + self.interior

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
    def centres(self) -> list[list[int]]:
        """Corners around each node that is none: of the edges, then of the sides, then of all."""
        corners = list(range(self.shape.corners))
        sides = self.shape.sides if self.dimension == 3 else [corners]
        edges = self.shape.edges.tolist() if self.quadratic else []
        return [*edges, *(sides[side] for side in self.centred), *([corners] if self.interior else [])]

    @cached_property
    def faces(self) -> list[list[int]]:
        """Nodes of each side of the boundary, as of its polytope: corners, in Abaqus's order, mid-edges, centre."""
        node_of = {frozenset(around): self.shape.corners + k for k, around in enumerate(self.centres)}
        faces = []
        for side in self.shape.sides:
            around = [frozenset(ends) for ends in zip(side, (*side[1:], side[0]), strict=True)]
            faces.append(
                [*side, *(node_of[ends] for ends in dict.fromkeys([*around, frozenset(side)]) if ends in node_of)]
            )
        return faces


TETRA10 = Cell("tetra10", TETRAHEDRON, quadratic=True, dofs=3, universal=(118, (0, 4, 1, 5, 2, 6, 7, 8, 9, 3)))
TRIANGLE6 = Cell("triangle6", TRIANGLE, quadratic=True, dofs=2, universal=(92, (0, 3, 1, 4, 2, 5)))
LINE2 = Cell("line", LINE)
LINE3 = Cell("line3", LINE, quadratic=True, dofs=1, universal=(11, (0, 1)))
BEAM2 = Cell("beam2", LINE, dofs=2, universal=(21, (0, 1)), meshio="line")
BEAM3 = Cell("beam3", LINE, quadratic=True, dofs=2, universal=(21, (0, 1)), meshio="line3")
FRAME2 = Cell("frame2", LINE, dofs=6, universal=(21, (0, 1)), meshio="line")
VERTEX = Cell("vertex", POINT)
NODES = Cell("nodes", POINT, meshio="vertex")
TETRA4 = Cell("tetra", TETRAHEDRON, dofs=3, universal=(111, range(4)))
HEXAHEDRON8 = Cell("hexahedron", HEXAHEDRON, dofs=3, universal=(115, range(8)))
HEXAHEDRON20 = Cell(
    "hexahedron20", HEXAHEDRON, quadratic=True, dofs=3,
    universal=(116, (0, 8, 1, 9, 2, 10, 3, 11, 16, 17, 18, 19, 4, 12, 5, 13, 6, 14, 7, 15)),
)  # fmt: skip
HEXAHEDRON27 = Cell(
    "hexahedron27", HEXAHEDRON, quadratic=True, centred=(5, 3, 2, 4, 0, 1), interior=True, dofs=3,
    universal=HEXAHEDRON20.universal,
)  # fmt: skip
WEDGE6 = Cell("wedge", WEDGE, dofs=3, universal=(112, range(6)))
WEDGE15 = Cell(
    "wedge15", WEDGE, quadratic=True, dofs=3, universal=(113, (0, 6, 1, 7, 2, 8, 12, 13, 14, 3, 9, 4, 10, 5, 11))
)  # fmt: skip
WEDGE18 = Cell("wedge18", WEDGE, quadratic=True, centred=(2, 3, 4), dofs=3, universal=WEDGE15.universal)
PYRAMID5 = Cell("pyramid", PYRAMID, dofs=3)
PYRAMID13 = Cell("pyramid13", PYRAMID, quadratic=True, dofs=3)
PYRAMID14 = Cell("pyramid14", PYRAMID, quadratic=True, centred=(0,), dofs=3)
MIXED = Cell("mixed", ANY, dofs=3)
TRIANGLE3 = Cell("triangle", TRIANGLE)
QUADRANGLE4 = Cell("quad", QUADRANGLE)
QUADRANGLE8 = Cell("quad8", QUADRANGLE, quadratic=True)
QUADRANGLE9 = Cell("quad9", QUADRANGLE, quadratic=True, centred=(0,))
CELLS = {cell.name: cell for cell in list(globals().values()) if isinstance(cell, Cell)}
SOLIDS = {cell.nodes: cell for cell in CELLS.values() if cell.solid and cell is not MIXED}
FACETS = {cell.nodes: cell for cell in (TRIANGLE3, QUADRANGLE4, TRIANGLE6, QUADRANGLE8, QUADRANGLE9)}
"""Cells of solids, and facets of their surfaces, by their number of nodes."""

FACET_WIDTH = 4
"""Nodes of a row of facets of a solid at least, triangles of 3 filled too: rows of 3 are edges of plane parts."""
FLAT_TRIANGLES = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
"""Flat triangles that make up one of six nodes."""
FLAT = {
    TRIANGLE3: np.array([[0, 1, 2]]),
    QUADRANGLE4: np.array([[0, 1, 2], [0, 2, 3]]),
    TRIANGLE6: FLAT_TRIANGLES,
    QUADRANGLE8: np.array([[0, 4, 7], [4, 1, 5], [5, 2, 6], [6, 3, 7], [4, 5, 6], [4, 6, 7]]),
    QUADRANGLE9: np.array([[a, b, 8] for a, b in zip((0, 4, 1, 5, 2, 6, 3, 7), (4, 1, 5, 2, 6, 3, 7, 0), strict=True)]),
}
"""Flat triangles that make up a facet."""
GMSH_ORDER = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]
"""gmsh numbers the last two edges of a tet10 the other way round."""
MIRRORED_CORNERS = {
    TRIANGLE: [0, 2, 1], QUADRANGLE: [0, 3, 2, 1], TETRAHEDRON: [0, 2, 1, 3], HEXAHEDRON: [0, 3, 2, 1, 4, 7, 6, 5],
    WEDGE: [0, 2, 1, 3, 5, 4], PYRAMID: [0, 3, 2, 1, 4],
}  # fmt: skip
"""Corners of the mirror image of a cell."""


def cell_of(mesh: MeshRecord) -> Cell:
    """Return the type of a mesh's cells; those of a foreign record count as points."""
    return CELLS.get(mesh.cell_type) or Cell(mesh.cell_type, POINT)


class Block(NamedTuple):
    """Cells or facets of one type."""

    cell: Cell
    rows: np.ndarray
    """Their numbers in the mesh or the surface, (k,), ascending."""
    nodes: np.ndarray
    """(k, a)"""


def blocks_of(rows: np.ndarray, types: Mapping[int, Cell]) -> list[Block]:
    """Return the blocks of rows of nodes (e, w), of which those of fewer nodes repeat their last one to the end.

    Args:
        types: Cells by their number of nodes, `SOLIDS` or `FACETS`.
    """
    repeats = np.cumprod(rows[:, ::-1] == rows[:, -1:], axis=1).sum(axis=1)
    counts = rows.shape[1] - repeats + 1
    numbers = {count: np.flatnonzero(counts == count) for count in np.unique(counts).tolist()}
    return [Block(types[count], chosen, rows[chosen, :count]) for count, chosen in numbers.items()]


def facet_blocks(facets: np.ndarray) -> list[Block]:
    """Return the facets of a solid's surface by type, or the edges of a plane part's, (f, 3), or nodes, (f, 1)."""
    if facets.shape[1] < FACET_WIDTH:
        return [Block({1: NODES, 3: LINE3}[facets.shape[1]], np.arange(len(facets)), facets)]
    return blocks_of(facets, FACETS)


def flat_triangles(facets: np.ndarray) -> np.ndarray:
    """Return flat triangles that make up facets of a solid or cells of a plane part, of all of their nodes, (t, 3)."""
    triangles = [block.nodes[:, FLAT[block.cell]].reshape(-1, 3) for block in blocks_of(facets, FACETS)]
    return np.concatenate([np.empty((0, 3), int), *triangles])


def corner_triangles(facets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles of the corners of a solid's facets, (t, 3), and the facet of each, (t,)."""
    split = {TRIANGLE: FLAT[TRIANGLE3], QUADRANGLE: FLAT[QUADRANGLE4]}
    corners = [(b, split[b.cell.shape]) for b in blocks_of(facets, FACETS)]
    triangles = np.concatenate([b.nodes[:, s].reshape(-1, 3) for b, s in corners])
    return triangles, np.concatenate([np.repeat(b.rows, len(s)) for b, s in corners])


def cell_blocks(mesh: MeshRecord) -> list[Block]:
    """Return the cells of a mesh by type; those of one type are one block."""
    if (cell := cell_of(mesh)) is MIXED:
        return blocks_of(mesh.cells, SOLIDS)
    return [Block(cell, np.arange(len(mesh.cells)), mesh.cells)]


def block_meshes(mesh: MeshRecord) -> list[tuple[np.ndarray, MeshRecord]]:
    """Return the cells of a mesh by type and formulation: their numbers, and a mesh of them alone on all nodes."""
    if cell_of(mesh) is not MIXED and not mesh.formulations:
        return [(np.arange(len(mesh.cells)), mesh)]
    blocks, meshes = cell_blocks(mesh), []
    for block in blocks:
        named = {name: np.isin(block.rows, rows) for name, rows in mesh.formulations.items()}
        plain = ~np.any([np.zeros(len(block.rows), bool), *named.values()], axis=0)
        for name, chosen in {**named, "": plain}.items():
            if chosen.any():
                formulations = {name: np.arange(chosen.sum())} if name else {}
                same = replace(mesh, cells=block.nodes[chosen], cell_type=block.cell.name, surfaces={}, volumes={},
                               formulations=formulations, attachments={}, relations={})  # fmt: skip
                meshes.append((block.rows[chosen], same))
    return meshes


def submesh(mesh: MeshRecord, cells: np.ndarray) -> tuple[MeshRecord, np.ndarray]:
    """Return a mesh of cells, a mask or numbers, without surfaces and volumes, and its nodes in the whole, (k,)."""
    chosen = np.arange(len(mesh.cells))[cells]
    nodes, numbers = np.unique(mesh.cells[chosen], return_inverse=True)
    formulations = {name: np.flatnonzero(np.isin(chosen, rows)) for name, rows in mesh.formulations.items()}
    return replace(
        mesh, nodes=mesh.nodes[nodes], cells=numbers.reshape(len(chosen), -1), surfaces={}, volumes={}, attachments={},
        relations={},
        formulations={name: rows for name, rows in formulations.items() if len(rows)},
    ), nodes  # fmt: skip


def cell_centres(mesh: MeshRecord) -> np.ndarray:
    """Return the mean of the corners of each cell [m], (e, 3)."""
    centres = np.empty((len(mesh.cells), 3))
    for block in cell_blocks(mesh):
        centres[block.rows] = mesh.nodes[block.nodes[:, : block.cell.shape.corners]].mean(axis=1)
    return centres


def joined(blocks: Sequence[np.ndarray], width: int = 0) -> np.ndarray:
    """Return rows of nodes of several widths, (k, a) each, one below the other, smaller ones filled by their last.

    Args:
        width: Of the rows at least: `FACET_WIDTH` of facets of a solid.
    """
    width = max([width, *(rows.shape[1] for rows in blocks)])
    filled = [np.pad(rows, ((0, 0), (0, width - rows.shape[1])), mode="edge") for rows in blocks]
    return np.concatenate(filled) if filled else np.empty((0, width), int)


def compacted(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the points that cells use, the cells renumbered, and the new number of each old point, -1 if unused."""
    used, numbers = np.unique(cells, return_inverse=True)
    new_number = np.full(len(points), -1)
    new_number[used] = np.arange(len(used))
    return points[used], numbers.reshape(cells.shape), new_number


def sides_of(blocks: Sequence[Block]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return all sides of all cells: the number of each side's cell (k,), its nodes, and how many cells share it, (k,).

    Nodes are (k, s), corners first; sides of fewer nodes repeat their last one, and triangles of solids too.
    """
    owners, facets, corners = [], [], []
    for block in blocks:
        for count in sorted({len(face) for face in block.cell.faces}):
            faces = [k for k, face in enumerate(block.cell.faces) if len(face) == count]
            nodes = block.nodes[:, [block.cell.faces[k] for k in faces]].reshape(-1, count)
            ends = np.sort(nodes[:, : len(block.cell.shape.sides[faces[0]])], axis=1)
            owners.append(np.repeat(block.rows, len(faces)))
            facets.append(nodes)
            corners.append(np.pad(ends, ((0, 0), (4 - ends.shape[1], 0)), constant_values=-1))
    _, inverse, count = np.unique(np.concatenate(corners), axis=0, return_inverse=True, return_counts=True)
    width = FACET_WIDTH if blocks[0].cell.dimension == 3 else 0
    return np.concatenate(owners), joined(facets, width), count[inverse.ravel()]


def outer_faces(cells: np.ndarray, cell: Cell = TETRA10) -> np.ndarray:
    """Return the faces of solid cells, or the edges of plane ones, that belong to one of them only, (f, s)."""
    _, facets, counts = sides_of([Block(cell, np.arange(len(cells)), cells)])
    return facets[counts == 1]


def outer_facets(mesh: MeshRecord) -> np.ndarray:
    """Return the facets of the boundary of a solid, (f, s), smaller ones filled by their last node, see `Surface`."""
    _, facets, counts = sides_of(cell_blocks(mesh))
    return facets[counts == 1]


def mirrored(cell: Cell) -> list[int]:
    """Return the order of a cell's nodes in which its mirror image is numbered rightly."""
    corners = MIRRORED_CORNERS[cell.shape]
    node_of = {frozenset(around): len(corners) + k for k, around in enumerate(cell.centres)}
    return corners + [node_of[frozenset(corners[k] for k in around)] for around in cell.centres]


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
    return np.where(against[:, None], triangles[:, mirrored(TRIANGLE6)], triangles)


def boundary_facets(blocks: Sequence[Block], path: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the cell of each boundary facet (f,) and its nodes (f, s), corners first, outward.

    Raises:
        InputError: a face belongs to more than two cells; `path` is their file.
    """
    owners, facets, shared = sides_of(blocks)
    if shared.max() > 2:
        count = round(float((1 / shared[shared > 2]).sum()))
        raise InputError(f"{path}: {count} faces belong to more than two cells; allowed: two")
    return owners[shared == 1], facets[shared == 1]
