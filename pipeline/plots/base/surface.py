"""The skin of a solid for drawing: curved facets divided into flat triangles, split where the surface has an edge.

A point of the skin is Σ N_a(ξ) x_a over the six nodes of its facet. The weights stand in one sparse matrix, so a
frame is drawn by one product, and smooth shading stays within smooth patches.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from gudgeon.modaldb.records.mesh import MeshRecord, Surface

FACES = np.array([[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [0, 3, 2, 7, 9, 6]])
"""Faces of a tet10 in meshio's order, outward, corners first."""
EDGES = ((0, 1, 3), (1, 2, 4), (2, 0, 5))
"""First corner, second corner, mid-side node of each edge of a facet."""
SHARP = np.cos(np.radians(25))
"""Normals of two facets at their common mid-side node are further apart than this at an edge of the part."""
MERGE = 0.7390851e-6
"""Points of one patch closer than this times the part's size are one; no round number, so that no coordinate lies
between two cells of the rounding."""
LEVELS = (6, 4, 3, 2)
"""Parts that the edge of a facet may be divided into."""


@dataclass(frozen=True)
class Skin:
    """Flat triangles of a body's surface and the sharp edges between them."""

    weights: sparse.csr_matrix
    """Weight of each node in each point, (p, n)."""
    triangles: np.ndarray
    """(t, 3)"""
    edge_weights: sparse.csr_matrix
    """Weight of each node in each point of the edges, (q, n)."""
    segments: np.ndarray
    """(s, 2), points of the edges."""

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Return unit normals at points (p, 3) of this skin, averaged by area."""
        a, b, c = (points[self.triangles[:, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        corners = self.triangles.ravel()
        owners = np.repeat(np.arange(len(self.triangles)), 3)
        summed = sparse.csr_matrix((np.ones(len(corners)), (corners, owners)), (len(points), len(normal))) @ normal
        length = np.linalg.norm(summed, axis=1, keepdims=True)
        return summed / np.where(length > 0, length, 1.0)


def boundary_facets(cells: np.ndarray) -> np.ndarray:
    """Return the faces of tet10 cells (e, 10) that belong to one cell only, outward, (f, 6)."""
    faces = cells[:, FACES].reshape(-1, 6)
    _, first, count = np.unique(np.sort(faces[:, :3], axis=1), axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[count == 1])]


def surface_of(mesh: MeshRecord, nodes: np.ndarray) -> Surface | None:
    """Return the named surface that holds all the nodes of an interface, the one with the fewest facets."""
    holders = [s for s in mesh.surfaces.values() if np.isin(nodes, s.facets).all()]
    return min(holders, key=lambda surface: len(surface.facets), default=None)


def make_skin(nodes: np.ndarray, facets: np.ndarray, triangles: int) -> Skin:
    """Divide curved facets (f, 6) of a body with nodes (n, 3) into at most so many triangles, if that is enough."""
    level = next((level for level in LEVELS if level**2 * len(facets) <= triangles), 1)
    grid, corners = _lattice(level)
    N = _shape_functions(grid)
    points = np.einsum("pa,fai->fpi", N, nodes[facets]).reshape(-1, 3)
    patch, sharp = _patches(nodes, facets)
    cell = np.round(points / (MERGE * np.ptp(points, axis=0).max())).astype(np.int64)
    keys = np.column_stack([np.repeat(patch, len(grid)), cell])
    _, kept, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    facet, local = np.divmod(kept, len(grid))
    weights = _matrix(N[local], facets[facet], len(nodes))
    flat = number.reshape(len(facets), len(grid))[:, corners].reshape(-1, 3)
    s = np.linspace(0, 1, level + 1)
    along = np.column_stack([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)])
    edge_weights = _matrix(np.tile(along, (len(sharp), 1)), np.repeat(sharp, level + 1, axis=0), len(nodes))
    start = (np.arange(len(sharp))[:, None] * (level + 1) + np.arange(level)).ravel()
    return Skin(weights, flat, edge_weights, np.column_stack([start, start + 1]))


def _matrix(weights: np.ndarray, nodes: np.ndarray, count: int) -> sparse.csr_matrix:
    rows = np.repeat(np.arange(len(weights)), weights.shape[1])
    return sparse.csr_matrix((weights.ravel(), (rows, nodes.ravel())), (len(weights), count))


def _lattice(level: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the points of a triangle divided `level` times along each edge, and its small triangles."""
    number = {(i, j): 0 for j in range(level + 1) for i in range(level + 1 - j)}
    number = {pair: k for k, pair in enumerate(number)}
    triangles = [[number[i, j], number[i + 1, j], number[i, j + 1]] for i, j in number if i + j < level]
    triangles += [[number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]] for i, j in number if i + j < level - 1]
    return np.array(list(number)) / level, np.array(triangles)


def _shape_functions(xi: np.ndarray) -> np.ndarray:
    """Return the six quadratic shape functions at points (p, 2) of the unit triangle, (p, 6)."""
    b, c = xi.T
    a = 1 - b - c
    return np.column_stack([a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * c * a])


def _patches(nodes: np.ndarray, facets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the smooth patch of each facet (f,), and the sharp or open edges as first, last, middle node (k, 3)."""
    edges = np.concatenate([facets[:, list(edge)] for edge in EDGES])
    owner = np.tile(np.arange(len(facets)), 3)
    normal = np.concatenate([_normal(nodes[facets], k) for k in range(3)])
    order = np.argsort(edges[:, 2], kind="stable")
    edges, owner, normal = edges[order], owner[order], normal[order]
    same = np.flatnonzero(edges[1:, 2] == edges[:-1, 2])
    smooth = same[np.einsum("ki,ki->k", normal[same], normal[same + 1]) > SHARP]
    links = sparse.coo_matrix((np.ones(len(smooth)), (owner[smooth], owner[smooth + 1])), (len(facets),) * 2)
    _, patch = connected_components(links, directed=False)
    plain = np.zeros(len(edges), bool)
    plain[smooth] = plain[smooth + 1] = True
    plain[same + 1] = True
    return patch, edges[~plain]


def _normal(corners: np.ndarray, edge: int) -> np.ndarray:
    """Return unit normals of facets (f, 6, 3) at the mid-side node of an edge, (f, 3)."""
    b, c = ((0.5, 0.0), (0.5, 0.5), (0.0, 0.5))[edge]
    a = 1 - b - c
    by_b = np.array([1 - 4 * a, 4 * b - 1, 0, 4 * (a - b), 4 * c, -4 * c])
    by_c = np.array([1 - 4 * a, 0, 4 * c - 1, -4 * b, 4 * b, 4 * (a - c)])
    normal = np.cross(np.einsum("a,fai->fi", by_b, corners), np.einsum("a,fai->fi", by_c, corners))
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)
