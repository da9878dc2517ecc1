"""The boundary of elements of several kinds, and what each of its nodes stands for of a named surface.

On tet10 alone a surface keeps its curved facets. On other elements it is a set of nodes with areas ∫ N dA and mean
normals. The consistent areas of the corners of eight-node facets are negative, a third of those of the others: there
the area is shared by ∫ N² dA instead, which is positive (Hinton, Rock & Zienkiewicz 1976, for the mass).
"""

from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.geometry.cells import quadratic_basis
from gudgeon.pipeline.geometry.decks.model import Block

CORNERS = {3: 3, 4: 4, 6: 3, 8: 4}
"""Corners of a facet by its number of nodes."""


class Facets(NamedTuple):
    """Boundary facets with one number of nodes."""

    nodes: np.ndarray
    """(f, a)"""
    owners: np.ndarray
    """Label of the element and number of its face, (f, 2)."""


def boundary(blocks: list[Block]) -> list[Facets]:
    """Return the facets that belong to one element only.

    Args:
        blocks: Elements whose `nodes` count from 0.
    """
    every: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}
    for block in blocks:
        for face_id, face in enumerate(block.cell.faces):
            owners = np.column_stack([block.labels, np.full(len(block.labels), face_id)])
            every.setdefault(len(face), []).append((block.nodes[:, face], owners))
    skin = []
    for corners in (3, 4):
        sizes = [size for size in every if CORNERS[size] == corners]
        if not sizes:
            continue
        keys = np.concatenate([np.sort(nodes[:, :corners], axis=1) for size in sizes for nodes, _ in every[size]])
        _, inverse, count = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
        once, start = count[inverse.ravel()] == 1, 0
        for size in sizes:
            nodes, owners = (np.concatenate(arrays) for arrays in zip(*every[size], strict=True))
            mine = once[start : start + len(nodes)]
            start += len(nodes)
            skin.append(Facets(nodes[mine], owners[mine]))
    return skin


def nodal_areas(points: np.ndarray, facets: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return the area [m^2], (n,), and the outward vector of area [m^2], (n, 3), of each node on chosen facets.

    Args:
        points: [m], (n, 3).
        facets: Node numbers, (f, a) each.
    """
    areas, vectors = np.zeros(len(points)), np.zeros((len(points), 3))
    for some in facets:
        N, dN, W = _rule(some.shape[1])
        corners = points[some]
        tangents = np.einsum("fai,akq->fqki", corners, dN)
        elements = np.cross(tangents[:, :, 0], tangents[:, :, 1]) * W[:, None]
        sizes = np.linalg.norm(elements, axis=2)
        if some.shape[1] == 8:
            nodal_sizes = np.einsum("aq,fq->fa", N**2, sizes)
            nodal_sizes *= (sizes.sum(axis=1) / nodal_sizes.sum(axis=1))[:, None]
            nodal_vectors = nodal_sizes[:, :, None] * (elements.sum(axis=1) / sizes.sum(axis=1)[:, None])[:, None]
        else:
            nodal_sizes = np.einsum("aq,fq->fa", N, sizes)
            nodal_vectors = np.einsum("aq,fqi->fai", N, elements)
        np.add.at(areas, some.ravel(), nodal_sizes.ravel())
        np.add.at(vectors, some.ravel(), nodal_vectors.reshape(-1, 3))
    return areas, vectors


def _rule(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return shape functions N (a, q), their derivatives (a, 2, q) and weights (q,) of a facet of `count` nodes."""
    if CORNERS[count] == 3:
        a, b = (6 - np.sqrt(15)) / 21, (6 + np.sqrt(15)) / 21
        third, inner, outer = [[1 / 3, 1 / 3]], [[a, a], [1 - 2 * a, a], [a, 1 - 2 * a]], []
        outer = [[b, b], [1 - 2 * b, b], [b, 1 - 2 * b]]
        x, y = np.array(third + inner + outer).T
        W = np.array([9 / 80, *[(155 - np.sqrt(15)) / 2400] * 3, *[(155 + np.sqrt(15)) / 2400] * 3])
        L = np.array([1 - x - y, x, y])
        if count == 3:
            return L, np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])[:, :, None] * np.ones(len(W)), W
        N, dN = quadratic_basis(L.T)
        return np.ascontiguousarray(N.T), np.ascontiguousarray(dN.transpose(1, 2, 0)), W
    abscissae, weights = np.polynomial.legendre.leggauss(3)
    x, y = (grid.ravel() for grid in np.meshgrid(abscissae, abscissae, indexing="ij"))
    W = np.outer(weights, weights).ravel()
    s, t = np.array([[-1.0], [1.0], [1.0], [-1.0]]), np.array([[-1.0], [-1.0], [1.0], [1.0]])
    if count == 4:
        N = 0.25 * (1 + s * x) * (1 + t * y)
        return N, np.stack([0.25 * s * (1 + t * y), 0.25 * t * (1 + s * x)], axis=1), W
    corner = 0.25 * (1 + s * x) * (1 + t * y) * (s * x + t * y - 1)
    by_x = 0.25 * s * (1 + t * y) * (2 * s * x + t * y)
    by_y = 0.25 * t * (1 + s * x) * (s * x + 2 * t * y)
    middle = [0.5 * (1 - x**2) * (1 - y), 0.5 * (1 + x) * (1 - y**2), 0.5 * (1 - x**2) * (1 + y),
              0.5 * (1 - x) * (1 - y**2)]  # fmt: skip
    middle_x = [-x * (1 - y), 0.5 * (1 - y**2), -x * (1 + y), -0.5 * (1 - y**2)]
    middle_y = [-0.5 * (1 - x**2), -y * (1 + x), 0.5 * (1 - x**2), -y * (1 - x)]
    N = np.concatenate([corner, middle])
    return N, np.stack([np.concatenate([by_x, middle_x]), np.concatenate([by_y, middle_y])], axis=1), W
