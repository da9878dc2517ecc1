"""Edges of plane parts whose meshes do not match: what each point of one meets on the edges of the other.

All nodes of a quadratic edge are contact points. The pressure is p = Σ pᵢ ψᵢ with the functions that are dual to the
shape functions, ∫ψᵢ Nⱼ ds = δᵢⱼ ∫Nᵢ ds (Wohlmuth 2000), which sum to one, so that point i carries λᵢ = pᵢ ∫Nᵢ ds. The
other part takes the consistent load fⱼ = Σᵢ Gᵢⱼ λᵢ, Gᵢⱼ = ∫ψᵢ Nⱼ ds / ∫Nᵢ ds, integrated over what edges share.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gudgeon.solver.contact.facets import BEYOND, FACING, INSIDE, Pairing, collocated

MASS = np.array([[4.0, -1.0, 2.0], [-1.0, 4.0, 2.0], [2.0, 2.0, 16.0]]) / 30
"""∫ N Nᵀ of the ends and the middle of an edge of unit length."""
SHARES = np.array([1.0, 1.0, 4.0]) / 6
"""∫ N of them."""
DUAL = SHARES[:, None] * np.linalg.inv(MASS)
"""ψ as sums of N."""
GAUSS = np.array([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)]), np.array([5.0, 8.0, 5.0]) / 18
"""Places and weights of the quadrature on an interval of unit length, exact to degree 5."""


@dataclass(frozen=True)
class Edges:
    """Quadratic edges of a plane part, by ends and middle."""

    numbers: np.ndarray
    """Of the points of each, (f, 3)."""
    points: np.ndarray
    """All points [m], (c, 3)."""
    normals: np.ndarray
    """Outward unit normals at all points, (c, 3)."""

    @property
    def start(self) -> np.ndarray:
        """First end of each [m], (f, 3)."""
        return self.points[self.numbers[:, 0]]

    @property
    def along(self) -> np.ndarray:
        """From the first to the second end [m], (f, 3)."""
        return self.points[self.numbers[:, 1]] - self.start

    @property
    def outward(self) -> np.ndarray:
        """Unit normals of the chords, (f, 3)."""
        along = self.along / np.linalg.norm(self.along, axis=1, keepdims=True)
        middle = self.normals[self.numbers[:, 2]]
        across = middle - np.einsum("fi,fi->f", middle, along)[:, None] * along
        return across / np.linalg.norm(across, axis=1, keepdims=True)


def are_edges(numbers: np.ndarray, points: np.ndarray, normals: np.ndarray) -> bool:
    """Return whether facets, (f, 3), are edges of a plane part: three nodes whose plane has the normals in it."""
    a, b, c = points[numbers].transpose(1, 0, 2)
    twice = np.cross(b - a, c - a)
    along = np.abs(np.einsum("fi,fi->f", twice, normals[numbers[:, 0]])).sum()
    return along < 0.1 * (np.linalg.norm(b - a, axis=1) ** 2).sum()


def functions(s: np.ndarray) -> np.ndarray:
    """Return N of ends and middle at places 0 to 1 of an edge, (…,), (…, 3)."""
    return np.stack([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)], axis=-1)


def paired_edges(near_side: Edges, far_side: Edges) -> Pairing:
    """Return what the points of one part meet on the edges of another, both in the same axes."""
    gap, edge, position = _met(near_side, far_side)
    return collocated(
        _mortar(near_side, far_side, gap), gap, far_side.numbers, edge, lambda points: functions(position[points])
    )


def _met(near_side: Edges, far_side: Edges) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what points meet along their normals: distance [m], edge, and place in it; ∞, −1 and 0 where they miss."""
    start, along, outward = far_side.start, far_side.along, far_side.outward
    facing = near_side.normals @ outward.T
    deepest = -INSIDE * float(np.linalg.norm(np.ptp(near_side.points, axis=0)))
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (np.einsum("fi,fi->f", start, outward) - near_side.points @ outward.T) / facing
    row, edge = np.nonzero((facing < FACING) & (far > deepest))
    hit = near_side.points[row] + far[row, edge, None] * near_side.normals[row] - start[edge]
    s = np.einsum("pi,pi->p", hit, along[edge]) / np.einsum("pi,pi->p", along[edge], along[edge])
    interior = (s >= -BEYOND) & (s <= 1 + BEYOND)
    row, edge, s = row[interior], edge[interior], s[interior]
    offsets = far_side.points[far_side.numbers[edge]] - near_side.points[row, None]
    gaps = np.einsum("pa,pai,pi->p", functions(s), offsets, near_side.normals[row])
    order = np.lexsort((np.abs(gaps), row))
    best = order[np.unique(row[order], return_index=True)[1]]
    c = len(near_side.points)
    distance, edges, positions = np.full(c, np.inf), np.full(c, -1), np.zeros(c)
    distance[row[best]], edges[row[best]], positions[row[best]] = gaps[best], edge[best], s[best]
    return distance, edges, positions


def _mortar(near_side: Edges, far_side: Edges, gap: np.ndarray) -> sparse.csr_matrix:
    """Return G over all points, (c, k), of edges of which some point meets the other part."""
    length = np.linalg.norm(near_side.along, axis=1)
    along, outward = near_side.along / length[:, None], near_side.outward
    gaps = np.where(np.isfinite(gap), gap, np.nan)[near_side.numbers]
    met = np.flatnonzero(np.isfinite(gaps).any(axis=1))
    ends = [far_side.start, far_side.start + far_side.along]
    spans = [
        np.einsum("afi,ai->af", end[None] - near_side.start[met, None], along[met]) / length[met, None] for end in ends
    ]
    heights = np.einsum("afi,ai->af", far_side.start[None] - near_side.start[met, None], outward[met])
    sizes = length[met, None] + np.linalg.norm(far_side.along, axis=1)[None]
    close = np.abs(heights - np.nanmean(gaps[met], axis=1)[:, None]) <= 2 * sizes
    low, high = np.clip(np.minimum(*spans), 0, 1), np.clip(np.maximum(*spans), 0, 1)
    near_edges, far_edges = np.nonzero(close & (outward[met] @ far_side.outward.T < FACING) & (high > low))
    points = low[near_edges, far_edges, None] + (high - low)[near_edges, far_edges, None] * GAUSS[0]
    start, end = (s[near_edges, far_edges, None] for s in spans)
    mine = functions(points) @ DUAL.T
    theirs = functions((points - start) / (end - start))
    weight = (high - low)[near_edges, far_edges, None] * GAUSS[1] * length[met[near_edges], None]
    overlap = np.einsum("pq,pqi,pqj->pij", weight, mine, theirs)
    covered = (high - low)[near_edges, far_edges] * length[met[near_edges]]
    rows, columns = near_side.numbers[met[near_edges]], far_side.numbers[far_edges]
    shape = (len(near_side.points), len(far_side.points))
    G = sparse.csr_matrix((overlap.ravel(), (np.repeat(rows, 3, axis=1).ravel(), np.tile(columns, 3).ravel())), shape)
    total, lengths = np.zeros(shape[0]), np.zeros(shape[0])
    np.add.at(total, rows.ravel(), np.repeat(covered, 3))
    np.add.at(lengths, near_side.numbers.ravel(), np.repeat(length, 3))
    sums = np.asarray(G.sum(axis=1)).ravel()
    # Where little of its edges is covered, a point's own function has no mean of a certain sign.
    covered_rows = (total >= 0.9 * lengths) & (sums > 0)
    return sparse.csr_matrix(sparse.diags_array(np.where(covered_rows, 1 / np.where(covered_rows, sums, 1.0), 0.0)) @ G)
