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


def functions(place: np.ndarray) -> np.ndarray:
    """Return N of ends and middle at places 0 to 1 of an edge, (…,), (…, 3)."""
    s = place
    return np.stack([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)], axis=-1)


def paired_edges(own: Edges, other: Edges) -> Pairing:
    """Return what the points of one part meet on the edges of another, both in the same axes."""
    gap, edge, position = _met(own, other)
    return collocated(_mortar(own, other, gap), gap, other.numbers, edge, lambda points: functions(position[points]))


def _met(own: Edges, other: Edges) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what points meet along their normals: distance [m], edge, and place in it; ∞, −1 and 0 where they miss."""
    start, along, outward = other.start, other.along, other.outward
    facing = own.normals @ outward.T
    deepest = -INSIDE * float(np.linalg.norm(np.ptp(own.points, axis=0)))
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (np.einsum("fi,fi->f", start, outward) - own.points @ outward.T) / facing
    row, edge = np.nonzero((facing < FACING) & (far > deepest))
    hit = own.points[row] + far[row, edge, None] * own.normals[row] - start[edge]
    place = np.einsum("pi,pi->p", hit, along[edge]) / np.einsum("pi,pi->p", along[edge], along[edge])
    inside = (place >= -BEYOND) & (place <= 1 + BEYOND)
    row, edge, place = row[inside], edge[inside], place[inside]
    reach = other.points[other.numbers[edge]] - own.points[row, None]
    gaps = np.einsum("pa,pai,pi->p", functions(place), reach, own.normals[row])
    order = np.lexsort((np.abs(gaps), row))
    best = order[np.unique(row[order], return_index=True)[1]]
    c = len(own.points)
    found, edges, places = np.full(c, np.inf), np.full(c, -1), np.zeros(c)
    found[row[best]], edges[row[best]], places[row[best]] = gaps[best], edge[best], place[best]
    return found, edges, places


def _mortar(own: Edges, other: Edges, gap: np.ndarray) -> sparse.csr_matrix:
    """Return G over all points, (c, k), of edges of which some point meets the other part."""
    length = np.linalg.norm(own.along, axis=1)
    along, outward = own.along / length[:, None], own.outward
    apart = np.where(np.isfinite(gap), gap, np.nan)[own.numbers]
    met = np.flatnonzero(np.isfinite(apart).any(axis=1))
    ends = [other.start, other.start + other.along]
    places = [np.einsum("afi,ai->af", end[None] - own.start[met, None], along[met]) / length[met, None] for end in ends]
    heights = np.einsum("afi,ai->af", other.start[None] - own.start[met, None], outward[met])
    sizes = length[met, None] + np.linalg.norm(other.along, axis=1)[None]
    near = np.abs(heights - np.nanmean(apart[met], axis=1)[:, None]) <= 2 * sizes
    low, high = np.clip(np.minimum(*places), 0, 1), np.clip(np.maximum(*places), 0, 1)
    first, second = np.nonzero(near & (outward[met] @ other.outward.T < FACING) & (high > low))
    at = low[first, second, None] + (high - low)[first, second, None] * GAUSS[0]
    begin, end = (one[first, second, None] for one in places)
    mine = functions(at) @ DUAL.T
    theirs = functions((at - begin) / (end - begin))
    weight = (high - low)[first, second, None] * GAUSS[1] * length[met[first], None]
    share = np.einsum("pq,pqi,pqj->pij", weight, mine, theirs)
    covered = (high - low)[first, second] * length[met[first]]
    rows, columns = own.numbers[met[first]], other.numbers[second]
    shape = (len(own.points), len(other.points))
    found = sparse.csr_matrix((share.ravel(), (np.repeat(rows, 3, axis=1).ravel(), np.tile(columns, 3).ravel())), shape)
    total, whole = np.zeros(shape[0]), np.zeros(shape[0])
    np.add.at(total, rows.ravel(), np.repeat(covered, 3))
    np.add.at(whole, own.numbers.ravel(), np.repeat(length, 3))
    sums = np.asarray(found.sum(axis=1)).ravel()
    # Where little of its edges is covered, a point's own function has no mean of a certain sign.
    kept = (total >= 0.9 * whole) & (sums > 0)
    return sparse.csr_matrix(sparse.diags_array(np.where(kept, 1 / np.where(kept, sums, 1.0), 0.0)) @ found)
