"""Node order of tet10 and six-node triangles, as in meshio and VTK, and the boundary of a mesh."""

import numpy as np

from gudgeon.pipeline.errors import InputError

EDGES = {
    1: np.array([[0, 1]]),
    2: np.array([[0, 1], [1, 2], [2, 0]]),
    3: np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]]),
}
"""Corners at the ends of each edge of lines, triangles, tetrahedra, in the order of the mid-side nodes."""
FACES = np.array([[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [0, 3, 2, 7, 9, 6]])
"""Outward faces of a tet10 of positive volume, corners first."""
GMSH_ORDER = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]
"""gmsh numbers the last two edges of a tet10 the other way round."""
MIRRORED_TETRA = [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]
MIRRORED_TRIANGLE = [0, 2, 1, 5, 4, 3]


def compacted(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the points that cells use, the cells renumbered, and the new number of each old point, -1 if unused."""
    used, numbers = np.unique(cells, return_inverse=True)
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    return points[used], numbers.reshape(cells.shape), number


def side_counts(cells: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Return how many elements share each side of each element, (e, k); 1 on the boundary.

    Args:
        sides: Local node numbers of the k sides, (k, s), of which the first k − 1 are corners.
    """
    corners = np.sort(cells[:, sides[:, : len(sides) - 1]].reshape(-1, len(sides) - 1), axis=1)
    _, inverse, count = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
    return count[inverse.reshape(-1, len(sides))]


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
    sides = FACES if cells.shape[1] == 10 else FACES[:, :3]
    shared = side_counts(cells, sides)
    if shared.max() > 2:
        count = round(float((1 / shared[shared > 2]).sum()))
        raise InputError(f"{path}: {count} faces belong to more than two tetrahedra; allowed: two")
    return np.argwhere(shared == 1), cells[:, sides][shared == 1]
