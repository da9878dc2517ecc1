"""A body cut open: its skin on one side of a plane, and the cut face of its cells, as weights of the nodes.

The cut is made once, in the undeformed body, so that a deformed one is still drawn by one product.
"""

import numpy as np
from scipy import sparse

from gudgeon.pipeline.plots.base.surface import Skin

PARTS = np.array(
    [[0, 4, 6, 7], [4, 1, 5, 8], [6, 5, 2, 9], [7, 8, 9, 3], [4, 9, 6, 5], [4, 9, 5, 8], [4, 9, 8, 7], [4, 9, 7, 6]]
)
"""Flat tetrahedra that make up a tet10 in meshio's order."""
TINY = 1e-9
"""Of the body's size: nodes closer to the plane are moved off it, so that no cut passes through a node."""


def cut(skin: Skin, nodes: np.ndarray, cells: np.ndarray, origin: np.ndarray, keep: np.ndarray) -> Skin:
    """Return what stands on one side of a plane, closed by its cut face.

    Args:
        nodes: (n, 3)
        cells: tet10, (e, 10)
        origin: A point of the plane, (3,).
        keep: Unit normal of the plane, towards what is kept, (3,).
    """
    size = float(np.ptp(nodes, axis=0).max())
    skin_weights, triangles, rim = _cut_skin(skin, _distance(skin.weights @ nodes, origin, keep, size))
    edge_weights, segments = _cut_lines(skin, _distance(skin.edge_weights @ nodes, origin, keep, size))
    face_weights, face = _cut_cells(nodes, cells, _distance(nodes, origin, keep, size), keep)
    rim_points, rim = _numbered(rim)
    return Skin(
        _stack([skin_weights, face_weights]),
        np.concatenate([triangles, face + skin_weights.shape[0]]),
        _stack([edge_weights, skin_weights[rim_points]]),
        np.concatenate([segments, rim + edge_weights.shape[0]]),
    )


def used_nodes(skin: Skin) -> np.ndarray:
    """Return the numbers of the nodes that a skin depends on, ascending."""
    parts = [weights.indices[weights.data != 0] for weights in (skin.weights, skin.edge_weights)]
    return np.unique(np.concatenate(parts))


def on_nodes(skin: Skin, numbers: np.ndarray) -> Skin:
    """Return the same skin on some of the nodes, which must be all that it depends on."""
    columns = [sparse.csr_matrix(weights[:, numbers]) for weights in (skin.weights, skin.edge_weights)]
    return Skin(columns[0], skin.triangles, columns[1], skin.segments)


def _distance(points: np.ndarray, origin: np.ndarray, keep: np.ndarray, size: float) -> np.ndarray:
    distance = (points - origin) @ keep
    return np.where(np.abs(distance) < TINY * size, TINY * size, distance)


def _cut_skin(skin: Skin, distance: np.ndarray) -> tuple[sparse.csr_matrix, np.ndarray, np.ndarray]:
    """Return weights and triangles of the kept part, and the segments along the cut."""
    kept = distance[skin.triangles] >= 0
    count = kept.sum(axis=1)
    crossings = _Crossings(distance)
    a, b, c = _turned(skin.triangles[count == 1], np.argmax(kept[count == 1], axis=1)).T
    ab, ac = crossings.add(a, b), crossings.add(a, c)
    p, q, r = _turned(skin.triangles[count == 2], np.argmin(kept[count == 2], axis=1)).T
    pq, pr = crossings.add(p, q), crossings.add(p, r)
    parts = [(a, ab, ac), (pq, q, r), (pq, r, pr)]
    triangles = np.concatenate([skin.triangles[count == 3], *(np.column_stack(part) for part in parts)])
    rim = np.concatenate([np.column_stack([ab, ac]), np.column_stack([pq, pr])])
    triangles, rim = crossings.merged(triangles), crossings.merged(rim)
    used, numbers = _numbered(np.append(triangles, rim))
    weights = crossings.weights(skin.weights)[used]
    return weights, numbers[: triangles.size].reshape(-1, 3), numbers[triangles.size :].reshape(-1, 2)


def _cut_lines(skin: Skin, distance: np.ndarray) -> tuple[sparse.csr_matrix, np.ndarray]:
    """Return weights and segments of the kept part."""
    kept = distance[skin.segments] >= 0
    crossing = kept.any(axis=1) & ~kept.all(axis=1)
    pairs = np.where(kept[crossing, :1], skin.segments[crossing], skin.segments[crossing][:, ::-1])
    crossings = _Crossings(distance)
    ends = crossings.add(pairs[:, 0], pairs[:, 1])
    segments = np.concatenate([skin.segments[kept.all(axis=1)], np.column_stack([pairs[:, 0], ends])])
    used, segments = _numbered(segments)
    return crossings.weights(skin.edge_weights)[used], segments


def _cut_cells(
    nodes: np.ndarray, cells: np.ndarray, distance: np.ndarray, keep: np.ndarray
) -> tuple[sparse.csr_matrix, np.ndarray]:
    """Return weights and triangles of the cut face, which look away from what is kept."""
    tets = cells[:, PARTS].reshape(-1, 4)
    kept = distance[tets] >= 0
    count = kept.sum(axis=1)
    crossings = _Crossings(distance)
    found = []
    for lonely in (1, 3):
        sides = kept[count == lonely] == (lonely == 1)
        a, *others = _turned(tets[count == lonely], np.argmax(sides, axis=1)).T
        found.append(np.column_stack([crossings.add(a, other) for other in others]))
    order = np.argsort(~kept[count == 2], axis=1, kind="stable")
    a, b, c, d = np.take_along_axis(tets[count == 2], order, axis=1).T
    ac, ad, bd, bc = (crossings.add(*pair) for pair in ((a, c), (a, d), (b, d), (b, c)))
    found += [np.column_stack([ac, ad, bd]), np.column_stack([ac, bd, bc])]
    used, triangles = _numbered(crossings.merged(np.concatenate(found)))
    weights = crossings.weights(sparse.csr_matrix(sparse.identity(len(nodes))))[used]
    p, q, r = ((weights @ nodes)[triangles[:, k]] for k in range(3))
    facing = np.cross(q - p, r - p) @ keep > 0
    triangles[facing] = triangles[facing][:, ::-1]
    return weights, triangles


class _Crossings:
    """Points where lines between two points cross the plane, numbered after the points themselves."""

    def __init__(self, distance: np.ndarray) -> None:
        self._distance = distance
        self._pairs: list[np.ndarray] = [np.zeros((0, 2), int)]
        self._count = len(distance)

    def add(self, i: np.ndarray, j: np.ndarray) -> np.ndarray:
        """Return the numbers of the crossings between points i and j, (k,)."""
        self._pairs.append(np.sort(np.column_stack([i, j]), axis=1))
        first, self._count = self._count, self._count + len(i)
        return np.arange(first, self._count)

    def merged(self, numbers: np.ndarray) -> np.ndarray:
        """Return numbers of points where each crossing has one only."""
        _, first, inverse = np.unique(np.concatenate(self._pairs), axis=0, return_index=True, return_inverse=True)
        own = np.arange(len(self._distance))
        return np.append(own, len(own) + first[inverse.ravel()])[numbers]

    def weights(self, of_points: sparse.csr_matrix) -> sparse.csr_matrix:
        """Return the weights of the nodes in all points, crossings behind, given those in the points."""
        i, j = np.concatenate(self._pairs).T
        share = self._distance[i] / (self._distance[i] - self._distance[j])
        between = sparse.diags(1 - share) @ of_points[i] + sparse.diags(share) @ of_points[j]
        return _stack([of_points, between])


def _numbered(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which numbers occur, ascending, and the place of each among them."""
    used, place = np.unique(numbers, return_inverse=True)
    return used, place.reshape(numbers.shape)


def _turned(rows: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return rows turned so that the given column stands first."""
    count = rows.shape[1]
    return np.take_along_axis(rows, (first[:, None] + np.arange(count)) % count, axis=1)


def _stack(parts: list[sparse.csr_matrix]) -> sparse.csr_matrix:
    return sparse.csr_matrix(sparse.vstack(parts))
