"""Surfaces whose meshes do not match: what each point of one meets on the facets of the other.

The contact points are mid-side nodes of quadratic triangles. The pressure is p = Σ pᵢ ψᵢ; each ψᵢ is linear on a facet,
1 at one of its mid-side nodes and 0 at the others (Crouzeix & Raviart 1973). They sum to one, and are orthogonal, so
that point i carries λᵢ = pᵢ ∫ψᵢ dA. The other surface, with functions ψⱼ of its own, takes

    fⱼ = Σᵢ Gᵢⱼ λᵢ,   Gᵢⱼ = ∫ψᵢ ψⱼ dA / ∫ψᵢ dA,

which is the consistent load of a uniform pressure where λ is: corners of quadratic facets carry none. The displacement
that meets point i is Σⱼ Gᵢⱼ uⱼ, the transpose, as of mortar methods (Wohlmuth, SIAM J. Numer. Anal. 38, 2000, 989).
Rows of G sum to one and have their mean place at the point that faces i. Integrals are exact: facets are cut by each
other in the plane of the first.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

FACING = -0.3
"""Largest cosine between the outward normals of facets that can meet."""
BEYOND = 0.02
"""How far outside of a facet, in its own coordinates, a point may lie that faces it: curved facets are cut straight."""
INSIDE = 0.25
"""Largest penetration that is looked for, over the extent of the surface."""
CHUNK = 2_000_000
"""Pairs of points and facets at once."""
COVERED = 0.5
"""Share of the facets of a point that the other surface must cover for the point's own function to weight it."""


@dataclass(frozen=True)
class Facets:
    """Triangles of a surface, by the mid-side nodes of their sides."""

    numbers: np.ndarray
    """Of the points of each, (f, 3)."""
    middles: np.ndarray
    """[m], (f, 3, 3)."""
    points: np.ndarray
    """All points [m], (c, 3)."""
    normals: np.ndarray
    """Outward unit normals at all points, (c, 3)."""

    @classmethod
    def of(cls, numbers: np.ndarray, points: np.ndarray, normals: np.ndarray) -> "Facets":
        """Return the facets of points [m], (c, 3), with outward normals, (c, 3)."""
        return cls(numbers, points[numbers], points, normals)

    @property
    def corners(self) -> np.ndarray:
        """Corners of the straight triangles [m], (f, 3, 3): the k-th is between sides k and k − 1."""
        return self.middles + np.roll(self.middles, 1, axis=1) - np.roll(self.middles, -1, axis=1)

    @property
    def vectors(self) -> np.ndarray:
        """Outward vectors of area of the straight triangles [m^2], (f, 3)."""
        a, b, c = self.middles.transpose(1, 0, 2)
        return 2.0 * np.cross(b - a, c - a)

    @property
    def outward(self) -> np.ndarray:
        """Outward unit normals of the straight triangles, (f, 3)."""
        return self.vectors / np.linalg.norm(self.vectors, axis=1, keepdims=True)

    @property
    def radii(self) -> np.ndarray:
        """Largest distance of a corner from the centre of its triangle [m], (f,)."""
        return np.linalg.norm(self.corners - self.middles.mean(axis=1, keepdims=True), axis=2).max(axis=1)


@dataclass(frozen=True)
class Pairing:
    """What the c points of one surface meet on the k points of another."""

    weights: sparse.csr_matrix
    """G, (c, k); rows of points that meet nothing are empty."""
    gap: np.ndarray
    """Distance along the point's normal to the other surface [m], (c,); infinite where there is none."""

    @property
    def meets(self) -> np.ndarray:
        """Which points meet the other surface, (c,)."""
        return np.isfinite(self.gap)


def paired(own: Facets, other: Facets) -> Pairing:
    """Return what the points of one surface meet on another, both in the same axes."""
    gap, facet, barycentric = _met(own, other)
    weights = _mortar(own, other, gap)
    return collocated(weights, gap, other.numbers, facet, lambda points: _places(barycentric[points]))


def collocated(
    weights: sparse.csr_matrix,
    gap: np.ndarray,
    numbers: np.ndarray,
    facet: np.ndarray,
    functions: Callable[[np.ndarray], np.ndarray],
) -> Pairing:
    """Return the pairing by mortar weights, (c, k), and by values of functions for points that have none.

    Args:
        gap: Distance along each point's normal to the other surface [m], (c,); infinite where there is none.
        numbers: Points of each facet or edge of the other surface, (f, 3).
        facet: Which of these each point meets, (c,).
        functions: Returns the values of the other surface's functions where p points meet it, (p,) → (p, 3).
    """
    meets, weighted = np.isfinite(gap), np.diff(weights.indptr) > 0
    # Points of facets that are cut off by the border of their interface have no function of their own.
    points = np.flatnonzero(meets & ~weighted)
    entries = (np.repeat(points, 3), numbers[facet[points]].ravel())
    values = sparse.csr_matrix((functions(points).ravel(), entries), weights.shape)
    return Pairing(sparse.csr_matrix(sparse.diags_array((meets & weighted).astype(float)) @ weights + values), gap)


def _places(place: np.ndarray) -> np.ndarray:
    """Return ψ of the sides of triangles at barycentric coordinates, (p, 3) each."""
    # The function of side k, between corners k and k + 1, vanishes at the middle of the other two sides.
    return 1.0 - 2.0 * np.roll(place, -2, axis=1)


def _met(own: Facets, other: Facets) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what points meet along their normals: distance [m], facet, and place in it; ∞, −1 and 0 where they miss.

    Shapes (c,), (c,), and barycentric coordinates (c, 3).
    """
    c = len(own.points)
    found, facet, place = np.full(c, np.inf), np.full(c, -1), np.zeros((c, 3))
    corners, outward = other.corners, other.outward
    edges, size = (corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), np.linalg.norm(other.vectors, axis=1)
    deepest = -INSIDE * float(np.linalg.norm(np.ptp(own.points, axis=0)))
    at_once = max(CHUNK // max(len(corners), 1), 1)
    for first in range(0, len(found), at_once):
        x, n = own.points[first : first + at_once], own.normals[first : first + at_once]
        along = n @ outward.T
        far = np.einsum("fi,fi->f", corners[:, 0], outward) - x @ outward.T
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.where(along < FACING, far / along, np.inf)
        near = np.argwhere((t > deepest) & np.isfinite(t))
        hit = x[near[:, 0]] + t[near[:, 0], near[:, 1], None] * n[near[:, 0]] - corners[near[:, 1], 0]
        u, v = (
            np.einsum("pi,pi->p", np.cross(one, two), outward[near[:, 1]]) / (2.0 * size[near[:, 1]])
            for one, two in ((hit, edges[1][near[:, 1]]), (edges[0][near[:, 1]], hit))
        )
        inside = np.minimum(np.minimum(u, v), 1.0 - u - v) >= -BEYOND
        near, at = near[inside], np.column_stack([1.0 - u - v, u, v])[inside]
        gaps = _smooth(other, near[:, 1], at, (x[near[:, 0]], n[near[:, 0]]))
        order = np.lexsort((np.abs(gaps), near[:, 0]))
        rows, begin = np.unique(near[order, 0], return_index=True)
        best = order[begin]
        found[first + rows], facet[first + rows], place[first + rows] = gaps[best], near[best, 1], at[best]
    return found, facet, place


def _smooth(other: Facets, facet: np.ndarray, place: np.ndarray, line: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return the distances of points to the surface through mid-side nodes and normals [m], (p,).

    The mean of the linear interpolation and that of the tangent planes is exact where the surface is quadratic.

    Args:
        facet: Numbers of the facets that they meet, (p,).
        place: Barycentric coordinates there, (p, 3).
        line: The points [m], and the directions in which distances are measured, (p, 3) each.
    """
    x, n = line
    weights = _places(place)
    numbers = other.numbers[facet]
    reach = other.points[numbers] - x[:, None]
    tangents = other.normals[numbers]
    slopes = np.einsum("pai,pi->pa", tangents, n)
    chord = np.einsum("pa,pai,pi->p", weights, reach, n)
    touching = np.einsum("pa,pa->p", weights, np.einsum("pai,pai->pa", reach, tangents) / slopes)
    return 0.5 * (chord + np.where((slopes < FACING).all(axis=1), touching, chord))


def _mortar(own: Facets, other: Facets, gap: np.ndarray) -> sparse.csr_matrix:
    """Return G over all points, (c, k), of facets of which some point meets the other surface."""
    pairs = _near(own, other, gap)
    first, second, shape = *pairs.T, (len(own.points), len(other.points))
    share, plain, area = _overlaps(own, other, pairs)
    rows, columns = own.numbers[first], other.numbers[second]
    at = (np.repeat(rows, 3, axis=1).ravel(), np.tile(columns, (1, 3)).ravel())
    with_own = sparse.csr_matrix((share.ravel(), at), shape)
    covering = sparse.csr_matrix((np.repeat(plain, 3, axis=0).ravel(), at), shape)
    supports, covered = np.zeros(shape[0]), np.zeros(shape[0])
    np.add.at(supports, own.numbers.ravel(), np.repeat(np.linalg.norm(own.vectors, axis=1), 3))
    np.add.at(covered, rows.ravel(), np.repeat(area, 3))
    total = np.asarray(with_own.sum(axis=1)).ravel()
    whole = (covered >= COVERED * supports) & (total >= COVERED * supports / 3)
    # Where little of its facets is covered, a point's own function has no mean of a certain sign: all of it counts.
    found = sparse.diags_array(whole.astype(float)) @ with_own + sparse.diags_array((~whole).astype(float)) @ covering
    found = sparse.csr_matrix(found)
    found.eliminate_zeros()
    sums = np.asarray(found.sum(axis=1)).ravel()
    kept = sums > 0
    return sparse.csr_matrix(sparse.diags_array(np.where(kept, 1.0 / np.where(kept, sums, 1.0), 0.0)) @ found)


def _near(own: Facets, other: Facets, gap: np.ndarray) -> np.ndarray:
    """Return the numbers of facets that may face each other, (p, 2)."""
    middles, centres = own.middles.mean(axis=1), other.middles.mean(axis=1)
    held = np.where(np.isfinite(gap), gap, np.nan)[own.numbers]
    met = np.flatnonzero(np.isfinite(held).any(axis=1))
    apart, outward, found = np.nanmean(held[met], axis=1), own.outward[met], [np.empty((0, 2), np.int64)]
    at_once = max(CHUNK // max(len(centres), 1), 1)
    for begin in range(0, len(met), at_once):
        some, n = met[begin : begin + at_once], outward[begin : begin + at_once]
        reach = centres[None] - middles[some, None]
        along = np.einsum("afi,ai->af", reach, n)
        aside = np.linalg.norm(reach - along[..., None] * n[:, None], axis=2)
        sizes = own.radii[some, None] + other.radii[None]
        facing = n @ other.outward.T < FACING
        close = np.abs(along - apart[begin : begin + at_once, None]) <= 2.0 * sizes
        pairs = np.argwhere(facing & close & (aside <= sizes))
        found.append(np.column_stack([some[pairs[:, 0]], pairs[:, 1]]))
    return np.concatenate(found)


def _overlaps(own: Facets, other: Facets, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return ∫ψᵢψⱼ dA (p, 3, 3), ∫ψⱼ dA (p, 3) and the area (p,) [m^2] of what pairs of facets share."""
    corners = own.corners[pairs[:, 0]]
    along = corners[:, 1] - corners[:, 0]
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(own.outward[pairs[:, 0]], along)
    flat = np.stack([along, across], axis=2)
    near = np.einsum("pci,pik->pck", corners - corners[:, :1], flat)
    far = np.einsum("pci,pik->pck", other.corners[pairs[:, 1]] - corners[:, :1], flat)
    polygon, count = _cut(far[:, ::-1], near)
    share, plain, area = np.zeros((len(pairs), 3, 3)), np.zeros((len(pairs), 3)), np.zeros(len(pairs))
    for k in range(1, polygon.shape[1] - 1):
        here = np.flatnonzero(count > k + 1)
        fan = polygon[here][:, [0, k, k + 1]]
        twice = _cross(fan[:, 1] - fan[:, 0], fan[:, 2] - fan[:, 0])
        middles = 0.5 * (fan + np.roll(fan, -1, axis=1))
        mine, theirs = (_functions(one[here], middles) for one in (near, far))
        share[here] += np.einsum("p,pqi,pqj->pij", twice / 6, mine, theirs)
        plain[here] += np.einsum("p,pqj->pj", twice / 6, theirs)
        area[here] += twice / 2
    return share, plain, area


def _functions(corners: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return ψ of the sides of triangles in a plane, (p, 3, 2), at some points of each, (p, q, 2); (p, q, 3)."""
    twice = _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    places = []
    for k in range(3):
        # Of the corner that side k does not touch.
        a, b = corners[:, k], corners[:, (k + 1) % 3]
        places.append(_cross((b - a)[:, None], at - a[:, None]) / twice[:, None])
    return 1.0 - 2.0 * np.stack(places, axis=2)


def _cut(subject: np.ndarray, window: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what triangles share with others, all counter-clockwise, by the method of Sutherland and Hodgman.

    Args:
        subject, window: Corners, (p, 3, 2) each.

    Returns:
        Corners of the polygons, (p, 7, 2), and how many each has, (p,).
    """
    p = len(subject)
    polygon, count, every = np.zeros((p, 7, 2)), np.full(p, 3), np.arange(p)
    polygon[:, :3] = subject
    for k in range(3):
        a, edge = window[:, k], window[:, (k + 1) % 3] - window[:, k]
        side = _cross(edge[:, None], polygon - a[:, None])
        kept, found = np.zeros(p, np.int64), np.zeros_like(polygon)
        for i in range(6):
            here = count > i
            after = np.where(i + 1 < count, i + 1, 0)
            one, two = side[:, i], side[every, after]
            inside = here & (one >= 0)
            found[every[inside], kept[inside]] = polygon[inside, i]
            kept += inside
            crosses = here & ((one >= 0) != (two >= 0))
            share = np.divide(one, one - two, out=np.zeros(p), where=crosses)
            point = polygon[:, i] + share[:, None] * (polygon[every, after] - polygon[:, i])
            found[every[crosses], kept[crosses]] = point[crosses]
            kept += crosses
        polygon, count = found, kept
    return polygon, count


def _cross(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Return the cross products of vectors in a plane, (…, 2), (…,)."""
    return one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]
