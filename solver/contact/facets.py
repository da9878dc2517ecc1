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
from dataclasses import dataclass, replace

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
    areas: np.ndarray | None = None
    """What of the facets of each point the other surface covers, a third of each [m^2], (c,); None where all of it."""

    @property
    def meets(self) -> np.ndarray:
        """Which points meet the other surface, (c,)."""
        return np.isfinite(self.gap)


def paired(near_side: Facets, far_side: Facets) -> Pairing:
    """Return what the points of one surface meet on another, both in the same axes."""
    gap, facet, barycentric = _met(near_side, far_side)
    weights, covered = _mortar(near_side, far_side, gap)
    pairing = collocated(weights, gap, far_side.numbers, facet, lambda points: _places(barycentric[points]))
    return replace(pairing, areas=covered / 3)


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


def _places(barycentric: np.ndarray) -> np.ndarray:
    """Return ψ of the sides of triangles at barycentric coordinates, (p, 3) each."""
    # The function of side k, between corners k and k + 1, vanishes at the middle of the other two sides.
    return 1.0 - 2.0 * np.roll(barycentric, -2, axis=1)


def _met(near_side: Facets, far_side: Facets) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what points meet along their normals: distance [m], facet, and place in it; ∞, −1 and 0 where they miss.

    Shapes (c,), (c,), and barycentric coordinates (c, 3).
    """
    c = len(near_side.points)
    distance, facet, barycentric = np.full(c, np.inf), np.full(c, -1), np.zeros((c, 3))
    corners, outward = far_side.corners, far_side.outward
    edges = (corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(far_side.vectors, axis=1)
    deepest = -INSIDE * float(np.linalg.norm(np.ptp(near_side.points, axis=0)))
    at_once = max(CHUNK // max(len(corners), 1), 1)
    for start in range(0, len(distance), at_once):
        x, n = near_side.points[start : start + at_once], near_side.normals[start : start + at_once]
        along = n @ outward.T
        far = np.einsum("fi,fi->f", corners[:, 0], outward) - x @ outward.T
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.where(along < FACING, far / along, np.inf)
        pairs = np.argwhere((t > deepest) & np.isfinite(t))
        hit = x[pairs[:, 0]] + t[pairs[:, 0], pairs[:, 1], None] * n[pairs[:, 0]] - corners[pairs[:, 1], 0]
        u, v = (
            np.einsum("pi,pi->p", np.cross(a, b), outward[pairs[:, 1]]) / (2.0 * size[pairs[:, 1]])
            for a, b in ((hit, edges[1][pairs[:, 1]]), (edges[0][pairs[:, 1]], hit))
        )
        interior = np.minimum(np.minimum(u, v), 1.0 - u - v) >= -BEYOND
        pairs, weights = pairs[interior], np.column_stack([1.0 - u - v, u, v])[interior]
        gaps = _smooth(far_side, pairs[:, 1], weights, (x[pairs[:, 0]], n[pairs[:, 0]]))
        order = np.lexsort((np.abs(gaps), pairs[:, 0]))
        rows, starts = np.unique(pairs[order, 0], return_index=True)
        best = order[starts]
        rows += start
        distance[rows], facet[rows], barycentric[rows] = gaps[best], pairs[best, 1], weights[best]
    return distance, facet, barycentric


def _smooth(
    surface: Facets, facet: np.ndarray, barycentric: np.ndarray, line: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Return the distances of points to the surface through mid-side nodes and normals [m], (p,).

    The mean of the linear interpolation and that of the tangent planes is exact where the surface is quadratic.

    Args:
        facet: Numbers of the facets that they meet, (p,).
        barycentric: Barycentric coordinates there, (p, 3).
        line: The points [m], and the directions in which distances are measured, (p, 3) each.
    """
    x, n = line
    weights = _places(barycentric)
    numbers = surface.numbers[facet]
    offsets = surface.points[numbers] - x[:, None]
    tangents = surface.normals[numbers]
    slopes = np.einsum("pai,pi->pa", tangents, n)
    chord = np.einsum("pa,pai,pi->p", weights, offsets, n)
    touching = np.einsum("pa,pa->p", weights, np.einsum("pai,pai->pa", offsets, tangents) / slopes)
    return 0.5 * (chord + np.where((slopes < FACING).all(axis=1), touching, chord))


def _mortar(near_side: Facets, far_side: Facets, gap: np.ndarray) -> tuple[sparse.csr_matrix, np.ndarray]:
    """Return G over all points, (c, k), of facets of which some point meets the other surface, and the area of each
    point's facets that this covers [m^2], (c,)."""
    pairs = _near(near_side, far_side, gap)
    near_facets, far_facets, shape = *pairs.T, (len(near_side.points), len(far_side.points))
    overlap, plain, area = _overlaps(near_side, far_side, pairs)
    rows, columns = near_side.numbers[near_facets], far_side.numbers[far_facets]
    entries = (np.repeat(rows, 3, axis=1).ravel(), np.tile(columns, (1, 3)).ravel())
    with_own = sparse.csr_matrix((overlap.ravel(), entries), shape)
    covering = sparse.csr_matrix((np.repeat(plain, 3, axis=0).ravel(), entries), shape)
    supports, covered = np.zeros(shape[0]), np.zeros(shape[0])
    np.add.at(supports, near_side.numbers.ravel(), np.repeat(np.linalg.norm(near_side.vectors, axis=1), 3))
    np.add.at(covered, rows.ravel(), np.repeat(area, 3))
    total = np.asarray(with_own.sum(axis=1)).ravel()
    fully_covered = (covered >= COVERED * supports) & (total >= COVERED * supports / 3)
    # Where little of its facets is covered, a point's own function has no mean of a certain sign: all of it counts.
    full, partial = (sparse.diags_array(rows.astype(float)) for rows in (fully_covered, ~fully_covered))
    G = sparse.csr_matrix(full @ with_own + partial @ covering)
    G.eliminate_zeros()
    sums = np.asarray(G.sum(axis=1)).ravel()
    positive = sums > 0
    scale = sparse.diags_array(np.where(positive, 1.0 / np.where(positive, sums, 1.0), 0.0))
    return sparse.csr_matrix(scale @ G), covered


def _near(near_side: Facets, far_side: Facets, gap: np.ndarray) -> np.ndarray:
    """Return the numbers of facets that may face each other, (p, 2)."""
    middles, centres = near_side.middles.mean(axis=1), far_side.middles.mean(axis=1)
    corner_gaps = np.where(np.isfinite(gap), gap, np.nan)[near_side.numbers]
    # Facets of which no point meets the other surface may still be covered in part: at the distance of the others.
    met, meets = np.arange(len(corner_gaps)), np.isfinite(corner_gaps).any(axis=1)
    mean_gap, outward = np.full(len(met), np.nanmean(corner_gaps) if meets.any() else np.nan), near_side.outward
    mean_gap[meets] = np.nanmean(corner_gaps[meets], axis=1)
    candidates = [np.empty((0, 2), np.int64)]
    at_once = max(CHUNK // max(len(centres), 1), 1)
    for start in range(0, len(met), at_once):
        some, n = met[start : start + at_once], outward[start : start + at_once]
        offsets = centres[None] - middles[some, None]
        along = np.einsum("afi,ai->af", offsets, n)
        aside = np.linalg.norm(offsets - along[..., None] * n[:, None], axis=2)
        sizes = near_side.radii[some, None] + far_side.radii[None]
        facing = n @ far_side.outward.T < FACING
        close = np.abs(along - mean_gap[start : start + at_once, None]) <= 2.0 * sizes
        pairs = np.argwhere(facing & close & (aside <= sizes))
        candidates.append(np.column_stack([some[pairs[:, 0]], pairs[:, 1]]))
    return np.concatenate(candidates)


def _overlaps(near_side: Facets, far_side: Facets, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return ∫ψᵢψⱼ dA (p, 3, 3), ∫ψⱼ dA (p, 3) and the area (p,) [m^2] of what pairs of facets share."""
    corners = near_side.corners[pairs[:, 0]]
    along = corners[:, 1] - corners[:, 0]
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(near_side.outward[pairs[:, 0]], along)
    flat = np.stack([along, across], axis=2)
    near_corners = np.einsum("pci,pik->pck", corners - corners[:, :1], flat)
    far_corners = np.einsum("pci,pik->pck", far_side.corners[pairs[:, 1]] - corners[:, :1], flat)
    polygon, count = _cut(far_corners[:, ::-1], near_corners)
    overlap, plain, area = np.zeros((len(pairs), 3, 3)), np.zeros((len(pairs), 3)), np.zeros(len(pairs))
    for k in range(1, polygon.shape[1] - 1):
        active = np.flatnonzero(count > k + 1)
        fan = polygon[active][:, [0, k, k + 1]]
        twice = _cross(fan[:, 1] - fan[:, 0], fan[:, 2] - fan[:, 0])
        middles = 0.5 * (fan + np.roll(fan, -1, axis=1))
        mine, theirs = (_functions(c[active], middles) for c in (near_corners, far_corners))
        overlap[active] += np.einsum("p,pqi,pqj->pij", twice / 6, mine, theirs)
        plain[active] += np.einsum("p,pqj->pj", twice / 6, theirs)
        area[active] += twice / 2
    return overlap, plain, area


def _functions(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return ψ of the sides of triangles in a plane, (p, 3, 2), at some points of each, (p, q, 2); (p, q, 3)."""
    twice = _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    barycentric = []
    for k in range(3):
        # Of the corner that side k does not touch.
        a, b = corners[:, k], corners[:, (k + 1) % 3]
        barycentric.append(_cross((b - a)[:, None], points - a[:, None]) / twice[:, None])
    return 1.0 - 2.0 * np.stack(barycentric, axis=2)


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
        corner_count, clipped = np.zeros(p, np.int64), np.zeros_like(polygon)
        for i in range(6):
            active = count > i
            after = np.where(i + 1 < count, i + 1, 0)
            distance, next_distance = side[:, i], side[every, after]
            interior = active & (distance >= 0)
            clipped[every[interior], corner_count[interior]] = polygon[interior, i]
            corner_count += interior
            crosses = active & ((distance >= 0) != (next_distance >= 0))
            fraction = np.divide(distance, distance - next_distance, out=np.zeros(p), where=crosses)
            point = polygon[:, i] + fraction[:, None] * (polygon[every, after] - polygon[:, i])
            clipped[every[crosses], corner_count[crosses]] = point[crosses]
            corner_count += crosses
        polygon, count = clipped, corner_count
    return polygon, count


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the cross products of vectors in a plane, (…, 2), (…,)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
