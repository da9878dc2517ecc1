"""Integrals of 1/R over pairs of panels: analytic over the source, by a rule on the target; compiled.

The potential of a flat facet of unit density is ∫ 1/R dS = Σ_e t_e ln((R₁ + R₂ + l)/(R₁ + R₂ − l)) − |z| Ω, with the
distance t_e of the point's foot from edge e of length l, R₁ and R₂ those from its ends, height z and solid angle Ω
(Wilton, Rao, Glisson, Schaubert, Al-Bundak, Butler, IEEE Trans. Antennas Propag. 32, 1984; Ω by Van Oosterom,
Strackee, IEEE Trans. Biomed. Eng. 30, 1983). It is exact at any distance, so thin gaps need no rule of their own. Over
the target panel, the smaller of the two, near pairs use a rule of seven points that divides facets until it agrees with
itself; far pairs use the second moments of both panels.
"""

import math
from typing import NamedTuple

import numpy as np

from gudgeon.solver.compiled import entry, inner

FAR = 3.0
"""Distance of centres over the sum of the radii from which two panels interact by their moments."""
MIDDLE = 1.2
"""The same ratio from which a facet's rule of seven points is not divided."""
AGREEMENT = 1e-5
"""Difference of the rule on a facet and on its four parts, relative to the pair's integral, at which it is kept."""
DEEPEST = 6
"""Most divisions of a facet."""
_S = math.sqrt(15.0)
POINTS = np.array(
    [[1 / 3, 1 / 3]]
    + [[a, b] for r in ((6 - _S) / 21, (6 + _S) / 21) for a, b in ((r, r), (1 - 2 * r, r), (r, 1 - 2 * r))]
)
"""Of a triangle, exact to degree five: the last two of the three area coordinates."""
WEIGHTS = np.array([9 / 40] + [(155 - _S) / 1200] * 3 + [(155 + _S) / 1200] * 3)
"""Of the points; the sum is 1."""


class Group(NamedTuple):
    """Panels as the compiled functions take them."""

    facets: np.ndarray
    """Corners of the flat facets [m], (facets, 9)."""
    first: np.ndarray
    """First facet of each panel and the end, (panels + 1,)."""
    areas: np.ndarray
    """[m²], (panels,)"""
    centres: np.ndarray
    """[m], (panels, 3)"""
    moments: np.ndarray
    """Mean squares about the centre, xx, yy, zz, xy, xz, yz [m²], (panels, 6)."""
    radii: np.ndarray
    """Largest distance of a corner from the centre [m], (panels,)."""


@inner
def facet_potential(point, corners):  # type: ignore[no-untyped-def]
    """Return ∫ 1/R dS [m] of a flat facet, (9,), at a point, three numbers."""
    a = (corners[0] - point[0], corners[1] - point[1], corners[2] - point[2])
    b = (corners[3] - point[0], corners[4] - point[1], corners[5] - point[2])
    c = (corners[6] - point[0], corners[7] - point[1], corners[8] - point[2])
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    normal = (nx / size, ny / size, nz / size)
    ra, rb, rc = math.sqrt(_dot(a, a)), math.sqrt(_dot(b, b)), math.sqrt(_dot(c, c))
    total = _edge(a, b, normal, ra, rb) + _edge(b, c, normal, rb, rc) + _edge(c, a, normal, rc, ra)
    height = _dot(a, normal)
    across = ra * rb * rc + _dot(a, b) * rc + _dot(b, c) * ra + _dot(c, a) * rb
    return total - abs(height) * 2.0 * math.atan2(abs(height) * size, across)


@inner
def _dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inner
def _edge(a, b, normal, ra, rb):  # type: ignore[no-untyped-def]
    """Return t ln((R₁ + R₂ + l)/(R₁ + R₂ − l)) of the edge from a to b; 0 for a point on it."""
    ex, ey, ez = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    length = math.sqrt(ex * ex + ey * ey + ez * ez)
    rest = ra + rb - length
    if rest <= 1e-15 * length:
        return 0.0
    outward = (ey * normal[2] - ez * normal[1], ez * normal[0] - ex * normal[2], ex * normal[1] - ey * normal[0])
    return _dot(a, outward) / length * math.log((ra + rb + length) / rest)


@inner
def _panel_potential(point, source, j):  # type: ignore[no-untyped-def]
    """Return ∫ 1/R dS [m] of a panel at a point."""
    total = 0.0
    for f in range(source.first[j], source.first[j + 1]):
        total += facet_potential(point, source.facets[f])
    return total


@inner
def _rule(t, source, j):  # type: ignore[no-untyped-def]
    """Return the seven-point rule of a panel's potential on a triangle t of corners (9,), times its area."""
    ux, uy, uz = t[3] - t[0], t[4] - t[1], t[5] - t[2]
    vx, vy, vz = t[6] - t[0], t[7] - t[1], t[8] - t[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    total = 0.0
    for k in range(len(WEIGHTS)):
        a, b = POINTS[k, 0], POINTS[k, 1]
        point = (t[0] + a * ux + b * vx, t[1] + a * uy + b * vy, t[2] + a * uz + b * vz)
        total += WEIGHTS[k] * _panel_potential(point, source, j)
    return 0.5 * math.sqrt(nx * nx + ny * ny + nz * nz) * total


@inner
def _divide(t, parts):  # type: ignore[no-untyped-def]
    """Put the four parts of a triangle (9,) between its corners and the middles of its sides into (4, 9)."""
    for k in range(3):
        a, b, c = t[k], t[3 + k], t[6 + k]
        d, e, f = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        parts[0, k], parts[0, 3 + k], parts[0, 6 + k] = a, d, f
        parts[1, k], parts[1, 3 + k], parts[1, 6 + k] = d, b, e
        parts[2, k], parts[2, 3 + k], parts[2, 6 + k] = f, e, c
        parts[3, k], parts[3, 3 + k], parts[3, 6 + k] = e, f, d


@inner
def _divided(facet, source, j, limit, work):  # type: ignore[no-untyped-def]
    """Return the integral over a facet by a rule that divides it where the rule and its parts disagree.

    Args:
        limit: Difference that is allowed on the whole facet [m³]; half of it at each division, since the parts along a
            source's side, where rules are poor, double in number.
        work: Stack: triangles (4 · (DEEPEST + 2), 9) and their integrals and depths (…, 2).
    """
    triangles, values = work
    for k in range(9):
        triangles[0, k] = facet[k]
    values[0, 0], values[0, 1] = _rule(facet, source, j), 0.0
    top, total = 1, 0.0
    while top > 0:
        top -= 1
        whole, depth = values[top, 0], values[top, 1]
        parts = triangles[top : top + 4]
        own = triangles[len(triangles) - 1]
        for k in range(9):
            own[k] = triangles[top, k]
        _divide(own, parts)
        fine = 0.0
        for k in range(4):
            values[top + k, 0] = _rule(parts[k], source, j)
            values[top + k, 1] = depth + 1.0
            fine += values[top + k, 0]
        if abs(fine - whole) <= limit * 0.5**depth or depth + 1.0 >= DEEPEST:
            total += fine
        else:
            top += 4
    return total


@inner
def _moments(target, i, source, j, away):  # type: ignore[no-untyped-def]
    """Return the pair's integral from areas and second moments: 1/r and half their sum with ∇∇(1/r)."""
    dx, dy, dz = away
    r2 = dx * dx + dy * dy + dz * dz
    r = math.sqrt(r2)
    m, n = target.moments[i], source.moments[j]
    trace = m[0] + n[0] + m[1] + n[1] + m[2] + n[2]
    along = (m[0] + n[0]) * dx * dx + (m[1] + n[1]) * dy * dy + (m[2] + n[2]) * dz * dz
    along += 2.0 * ((m[3] + n[3]) * dx * dy + (m[4] + n[4]) * dx * dz + (m[5] + n[5]) * dy * dz)
    return target.areas[i] * source.areas[j] / r * (1.0 + 0.5 * (3.0 * along / r2 - trace) / r2)


@inner
def pair(target, i, source, j, work):  # type: ignore[no-untyped-def]
    """Return ∬ 1/R dS dS [m³] of two panels."""
    if source.areas[j] < target.areas[i]:
        return _ordered_pair(source, j, target, i, work)
    return _ordered_pair(target, i, source, j, work)


@inner
def _ordered_pair(target, i, source, j, work):  # type: ignore[no-untyped-def]
    dx = target.centres[i, 0] - source.centres[j, 0]
    dy = target.centres[i, 1] - source.centres[j, 1]
    dz = target.centres[i, 2] - source.centres[j, 2]
    reach = target.radii[i] + source.radii[j]
    distance2 = dx * dx + dy * dy + dz * dz
    if distance2 >= FAR * FAR * reach * reach:
        return _moments(target, i, source, j, (dx, dy, dz))
    near = distance2 < MIDDLE * MIDDLE * reach * reach
    limit = AGREEMENT * target.areas[i] * source.areas[j] / reach
    total = 0.0
    for f in range(target.first[i], target.first[i + 1]):
        if near:
            total += _divided(target.facets[f], source, j, limit, work)
        else:
            total += _rule(target.facets[f], source, j)
    return total


@entry
def fill_symmetric(target, source, factor, rows, matrix, work):  # type: ignore[no-untyped-def]
    """Add a factor times the integrals of a group and itself, or its mirror image, to a symmetric matrix [m³].

    Args:
        rows: First row to be filled and the end, (2,); with them the columns of the same numbers, up to the diagonal.
    """
    for i in range(rows[0], rows[1]):
        for j in range(i + 1):
            value = factor * pair(target, i, source, j, work)
            matrix[i, j] += value
            if j < i:
                matrix[j, i] += value


@entry
def fill(target, source, factor, matrix, work):  # type: ignore[no-untyped-def]
    """Add a factor times the integrals of two groups to a matrix [m³], (target's panels, source's panels)."""
    for i in range(len(target.areas)):
        for j in range(len(source.areas)):
            matrix[i, j] += factor * pair(target, i, source, j, work)


@entry
def crossing(first, second, found):  # type: ignore[no-untyped-def]
    """Put the numbers of two panels that cross into `found` (2,), or leave it: a side of one goes through the other."""
    for i in range(len(first.areas)):
        for j in range(len(second.areas)):
            reach, gap2 = first.radii[i] + second.radii[j], 0.0
            for k in range(3):
                gap2 += (first.centres[i, k] - second.centres[j, k]) ** 2
            if gap2 > reach * reach:
                continue
            for f in range(first.first[i], first.first[i + 1]):
                for g in range(second.first[j], second.first[j + 1]):
                    if _pierces(first.facets[f], second.facets[g]) or _pierces(second.facets[g], first.facets[f]):
                        found[0], found[1] = i, j
                        return


@inner
def _pierces(sides, facet):  # type: ignore[no-untyped-def]
    """Return whether a side of a triangle (9,) meets a facet (9,), by the signs of five volumes."""
    a, b, c = facet[0:3], facet[3:6], facet[6:9]
    for k in range(3):
        first = 3 * ((k + 1) % 3)
        p, q = sides[3 * k : 3 * k + 3], sides[first : first + 3]
        if _volume(a, b, c, p) * _volume(a, b, c, q) > 0.0:
            continue
        ab, bc, ca = _volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)
        one_sign = (ab >= 0.0 and bc >= 0.0 and ca >= 0.0) or (ab <= 0.0 and bc <= 0.0 and ca <= 0.0)
        if one_sign and (ab != 0.0 or bc != 0.0 or ca != 0.0):
            return True
    return False


@inner
def _volume(a, b, c, d):  # type: ignore[no-untyped-def]
    """Return six times the signed volume of a tetrahedron [m³]."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    wx, wy, wz = d[0] - a[0], d[1] - a[1], d[2] - a[2]
    return (uy * vz - uz * vy) * wx + (uz * vx - ux * vz) * wy + (ux * vy - uy * vx) * wz


def workspace() -> tuple[np.ndarray, np.ndarray]:
    """Return work arrays of the divided rule."""
    depth = 4 * (DEEPEST + 2)
    return np.empty((depth, 9)), np.empty((depth, 2))
