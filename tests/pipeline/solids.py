"""Meshes of every type of solid cell, alone and together: a box of hexahedra that are split, raised and bent."""

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.fem.elements.reference import shape_functions
from gudgeon.pipeline.fem.elements.shapes import reference_nodes
from gudgeon.pipeline.geometry.cells import (
    HEXAHEDRON,
    HEXAHEDRON8,
    HEXAHEDRON20,
    HEXAHEDRON27,
    MIXED,
    PYRAMID,
    PYRAMID5,
    PYRAMID13,
    PYRAMID14,
    TETRA4,
    TETRA10,
    TETRAHEDRON,
    WEDGE,
    WEDGE6,
    WEDGE15,
    WEDGE18,
    Cell,
    Polytope,
    joined,
    outer_facets,
)

CORNER_CELLS = {TETRAHEDRON: TETRA4, HEXAHEDRON: HEXAHEDRON8, WEDGE: WEDGE6, PYRAMID: PYRAMID5}
FAMILIES = {
    "linear": [TETRA4, HEXAHEDRON8, WEDGE6, PYRAMID5],
    "serendipity": [TETRA10, HEXAHEDRON20, WEDGE15, PYRAMID13],
    "full": [TETRA10, HEXAHEDRON27, WEDGE18, PYRAMID14],
}
"""Cells that share faces in one mesh."""
PYRAMIDS = [[*side[::-1], 8] for side in HEXAHEDRON.sides]
KUHN = [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]]
SPLITS: dict[Polytope | None, list[tuple[Polytope, list[int]]]] = {
    HEXAHEDRON: [(HEXAHEDRON, list(range(8)))],
    WEDGE: [(WEDGE, [0, 1, 2, 4, 5, 6]), (WEDGE, [0, 2, 3, 4, 6, 7])],
    PYRAMID: [(PYRAMID, corners) for corners in PYRAMIDS],
    TETRAHEDRON: [(TETRAHEDRON, corners) for corners in KUHN],
    # Of pyramids with tetrahedra instead of the lowest one.
    None: [(PYRAMID, corners) for corners in PYRAMIDS[1:]]
    + [(TETRAHEDRON, [0, 1, 2, 8]), (TETRAHEDRON, [0, 2, 3, 8])],
}  # fmt: skip
"""Cells, by their shape, of a hexahedron with its centre as node 8."""
FACES = {"left": (0, 0), "right": (0, 1), "front": (1, 0), "back": (1, 1), "bottom": (2, 0), "top": (2, 1)}


def box(
    family: Sequence[Cell],
    counts: tuple[int, int, int],
    sizes: tuple[float, float, float],
    bend: Callable[[np.ndarray], np.ndarray] = lambda x: x,
) -> MeshRecord:
    """Return a box of one type of cell, or of several, with its faces as surfaces.

    Args:
        bend: From places in the box [m], (n, 3), to those of the nodes.
    """
    kinds = {cell.shape: cell for cell in family}
    grid = np.array(list(product(*(range(count + 1) for count in counts))), float)
    strides = np.array([(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1])
    offsets = np.array(reference_nodes(HEXAHEDRON8), int)
    places = list(grid)
    rows: dict[Polytope, list[list[int]]] = {shape: [] for shape in kinds}
    for corner in product(*(range(count) for count in counts)):
        around = [*((np.array(corner) + offsets) @ strides).tolist(), len(places)]
        shape = _split(corner, list(kinds))
        if shape in (PYRAMID, None):
            places.append(np.array(corner) + 0.5)
        for kind, corners in SPLITS[shape]:
            rows[kind].append([around[k] for k in corners])
    corners = {shape: np.array(cells) for shape, cells in rows.items() if cells}
    nodes, cells = raised(np.array(places) / counts * sizes, corners, kinds)
    name = family[0].name if len(family) == 1 else MIXED.name
    mesh = MeshRecord(nodes, joined(cells), name, {})
    facets = outer_facets(mesh)
    surfaces = {
        face: Surface(facets[np.abs(nodes[facets][..., axis] - side * sizes[axis]).max(axis=1) < 1e-9], {})
        for face, (axis, side) in FACES.items()
    }
    return MeshRecord(bend(nodes), mesh.cells, name, surfaces)


def raised(
    nodes: np.ndarray, corners: dict[Polytope, np.ndarray], kinds: dict[Polytope, Cell]
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return nodes and cells of each kind from their corners, shared nodes once."""
    numbers: dict[tuple[float, ...], int] = {}
    cells = []
    for shape, rows in corners.items():
        N, _ = shape_functions(CORNER_CELLS[shape], reference_nodes(kinds[shape]).T)
        positions = np.einsum("ab,eai->ebi", N, nodes[rows])
        keys = [tuple(np.round(x, 9) + 0.0) for x in positions.reshape(-1, 3)]
        cells.append(np.array([numbers.setdefault(key, len(numbers)) for key in keys]).reshape(positions.shape[:2]))
    return np.array(list(numbers)), cells


def _split(corner: tuple[int, ...], shapes: list[Polytope]) -> Polytope | None:
    """Return the shape of a hexahedron's cells: columns of wedges, one of pyramids, one of these and tetrahedra."""
    if len(shapes) == 1:
        return shapes[0]
    if corner[1] % 2 == 1:
        return WEDGE
    return {0: None, 1: PYRAMID}.get(corner[0], HEXAHEDRON) if sum(corner[1:]) == 0 else HEXAHEDRON
