"""Edges and corners of a surface of six-node triangles: where the charge density is singular."""

from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.geometry.cells import EDGES, quadratic_basis

SHARP = np.cos(np.radians(20.0))
"""Cosine of the angle between normals from which the side of two triangles is an edge."""
STRAIGHT = np.cos(np.radians(30.0))
"""Cosine of the turn of an edge from which a node on it is a corner."""
_SIDE_MIDDLES = np.array([[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]])


class Features(NamedTuple):
    """Edges and corners of a surface."""

    sides: np.ndarray
    """Whether each side of each triangle is an edge, (t, 3); sides 01, 12, 20."""
    on_edge: np.ndarray
    """Whether each corner of each triangle lies on an edge, (t, 3)."""
    at_corner: np.ndarray
    """Whether each corner of each triangle is a corner of the surface, (t, 3)."""
    open_sides: int
    """Sides that belong to one triangle only."""


def features(nodes: np.ndarray, facets: np.ndarray) -> Features:
    """Find edges and corners.

    Args:
        nodes: [m], (n, 3).
        facets: Six-node triangles, (t, 6), corners first.
    """
    ends = facets[:, EDGES[2]]
    _, side, count = np.unique(np.sort(ends.reshape(-1, 2), axis=1), axis=0, return_inverse=True, return_counts=True)
    side = side.ravel()
    tangents = np.einsum("kna,tnx->tkax", quadratic_basis(_SIDE_MIDDLES)[1], nodes[facets])
    normals = np.cross(tangents[:, :, 0], tangents[:, :, 1]).reshape(-1, 3)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # Of two triangles of one sense, the side runs forwards in one and backwards in the other.
    forwards = np.where((ends[:, :, 0] < ends[:, :, 1]).ravel(), 1.0, -1.0)
    order = np.argsort(side, kind="stable")
    first_side = order[np.searchsorted(side[order], np.arange(len(count)))]
    sense = -forwards * forwards[first_side[side]]
    smooth = sense * np.einsum("si,si->s", normals, normals[first_side[side]]) > SHARP
    smooth[first_side] = True
    edge = np.bincount(side, ~smooth, minlength=len(count)) > 0
    edge |= count != 2
    is_edge = edge[side].reshape(-1, 3)
    on_edge = np.zeros(len(nodes), dtype=bool)
    on_edge[ends[is_edge].ravel()] = True
    at_corner = on_edge & _turns(nodes, facets, ends, first_side[edge])
    return Features(is_edge, on_edge[facets[:, :3]], at_corner[facets[:, :3]], int((count == 1).sum()))


def _turns(nodes: np.ndarray, facets: np.ndarray, ends: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return whether the edges turn, end or meet at each node, (n,); `chosen` are the sides that are edges."""
    pairs = ends.reshape(-1, 2)[chosen]
    middles = nodes[facets[:, 3:].reshape(-1)[chosen]]
    a, b = nodes[pairs[:, 0]], nodes[pairs[:, 1]]
    away = np.concatenate([4 * middles - 3 * a - b, 4 * middles - 3 * b - a])
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    node = np.concatenate([pairs[:, 0], pairs[:, 1]])
    degree = np.bincount(node, minlength=len(nodes))
    total = np.stack([np.bincount(node, x, minlength=len(nodes)) for x in away.T], axis=1)
    # Two unit vectors of opposite sense cancel: |u + v|² = 2 + 2 cos.
    return (degree != 2) | (np.einsum("ni,ni->n", total, total) > 2 - 2 * STRAIGHT)
