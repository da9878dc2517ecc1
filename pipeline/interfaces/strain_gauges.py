"""Strain gauges on the surface of a solid or plane part: the mean normal strain along a direction over a grid.

The strain of an element is recovered at its nodes and interpolated, as of other gauges; over the length of the grid its
mean is that of three points of Gauss, or the value at the point of a gauge without length.
"""

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.reference import shape_functions
from gudgeon.pipeline.fem.elements.shapes import CORNERS
from gudgeon.pipeline.geometry.cells import (
    FLAT,
    QUADRANGLE4,
    TRIANGLE,
    TRIANGLE3,
    cell_of,
    facet_blocks,
    outer_facets,
    quadratic_basis,
)
from gudgeon.pipeline.interfaces.stress_recovery import interpolation
from gudgeon.pipeline.scenes.gauge import Gauge

OFF = 0.02
"""Distance from the surface, over the size of the nearest facet, within which a gauge is on it: meshes of curved
surfaces deviate from them by less."""
TILT = 5.0
"""Angle by which a gauge's direction may leave the surface [deg]."""
FAR = 0.01
"""Distance outside the box of a solid part, over its largest extent, from which on a place is not on the part."""
LINES = np.array([[0, 1], [1, 2], [2, 0]])
LEVELS = 4
"""How often a facet is divided around its nearest place, eight times along each edge: chords are then 1e-7 off it."""
PARTS = np.array(
    [[[i, j], [i + 1, j], [i, j + 1]] for i in range(8) for j in range(8 - i)]
    + [[[i + 1, j], [i + 1, j + 1], [i, j + 1]] for i in range(7) for j in range(7 - i)]
) / 8  # fmt: skip
"""Corners s, t of the 64 parts of a triangle, (64, 3, 2), which run as its own."""


def along(direction: np.ndarray) -> np.ndarray:
    """Return the normal component along a unit vector of a tensor xx, yy, zz, xy, yz, zx, (1, 6)."""
    x, y, z = direction
    return np.array([[x * x, y * y, z * z, 2 * x * y, 2 * y * z, 2 * z * x]])


def grid_rows(mesh: MeshRecord, gauge: Gauge, key: str) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Return the nodes around a strain gauge (k,), and their share in the mean over its grid, (1, k).

    Raises:
        InputError: the gauge is not on the surface, or its grid leaves the part.
    """
    assert gauge.direction is not None
    point, line = np.array(gauge.point), np.array(gauge.direction) / np.linalg.norm(gauge.direction)
    _refuse_off(mesh, point, line, key)
    if gauge.length is None:
        nodes, N = interpolation(mesh, point, f"{key}.point")
        return nodes, sparse.csr_matrix(N[None])
    abscissae, weights = np.polynomial.legendre.leggauss(3)
    weights_by_node: dict[int, float] = {}
    for x, weight in zip(abscissae, weights / 2, strict=True):
        position = point + 0.5 * gauge.length * x * line
        try:
            nodes, N = interpolation(mesh, position, f"{key}.length")
        except InputError:
            raise InputError(f"{key}.length: {gauge.length:g} m given, the grid then leaves the part at"
                             f" {np.round(position, 9).tolist()}; shorten it or move its point") from None  # fmt: skip
        for node, node_weight in zip(nodes.tolist(), weight * N, strict=True):
            weights_by_node[node] = weights_by_node.get(node, 0.0) + float(node_weight)
    nodes = np.array(sorted(weights_by_node))
    return nodes, sparse.csr_matrix([[weights_by_node[node] for node in nodes.tolist()]])


def _refuse_off(mesh: MeshRecord, point: np.ndarray, line: np.ndarray, key: str) -> None:
    """Refuse a gauge that is not on the surface of its part, or whose direction leaves it."""
    if cell_of(mesh).dimension == 2:
        if abs(line[2]) > np.sin(np.radians(TILT)):
            raise InputError(f"{key}.direction: it leaves the plane of the part; allowed: directions in x and y")
        return
    nearest, distance, corners, size = _nearest(_curved_triangles(mesh), point)
    if distance > OFF * size:
        raise InputError(f"{key}.point: {point.tolist()} given, it lies {distance:.4g} m off the surface of the part;"
                         f" its nearest point is {(np.round(nearest, 9) + 0.0).tolist()}")  # fmt: skip
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    tilt = float(np.degrees(np.arcsin(min(1.0, abs(normal @ line) / float(np.linalg.norm(normal))))))
    if tilt > TILT:
        outward = np.round(normal / np.linalg.norm(normal), 6) + 0.0
        raise InputError(f"{key}.direction: {line.tolist()} given, it leaves the surface there by {tilt:.3g} degrees,"
                         f" allowed: {TILT:g}; the outward normal is {outward.tolist()}")  # fmt: skip


def refuse_far(mesh: MeshRecord, point: np.ndarray, key: str) -> None:
    """Refuse a place that moves with a rigid solid part but is none of it; those in its bores and hollows are.

    Raises:
        InputError: the place [m], (3,), is outside of the part's box; its key `key`, and the nearest place.
    """
    if not cell_of(mesh).solid:
        return
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    if (np.maximum(low - point, point - high) <= FAR * (high - low).max()).all():
        return
    nearest, distance, *_ = _nearest(_curved_triangles(mesh), point)
    raise InputError(f"{key}: {point.tolist()} given, it lies {distance:.4g} m off the part; its nearest point is"
                     f" {(np.round(nearest, 9) + 0.0).tolist()}")  # fmt: skip


def _curved_triangles(mesh: MeshRecord) -> np.ndarray:
    """Return the boundary of a solid as triangles of six nodes [m], (t, 6, 3); quadrilaterals are cut along 0-2."""
    triangles = []
    for cell, _, nodes in facet_blocks(outer_facets(mesh)):
        for corners in FLAT[TRIANGLE3 if cell.shape is TRIANGLE else QUADRANGLE4]:
            X = np.array(CORNERS[cell.shape], float)[corners]
            N, _ = shape_functions(cell, np.concatenate([X, 0.5 * (X + np.roll(X, -1, axis=0))]).T)
            triangles.append(np.einsum("ap,fai->fpi", N, mesh.nodes[nodes]))
    return np.concatenate(triangles)


def _nearest(facets: np.ndarray, point: np.ndarray) -> tuple[np.ndarray, float, np.ndarray, float]:
    """Return the nearest place of curved facets (f, 6, 3) to a point [m], its distance, three points on the facet
    around it, (3, 3), which run as its corners, and the facet's longest edge [m]."""
    corners = facets[:, :3]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    sag = np.linalg.norm(facets[:, 3:] - 0.5 * (corners + np.roll(corners, -1, axis=1)), axis=2).max(axis=1)
    nearest, distance, best = nearest_on(corners, point)
    candidates = np.linalg.norm(corners.mean(axis=1) - point, axis=1) - edges - 2 * sag <= distance + 2 * sag.max()
    around = corners[best]
    facets, edges = facets[candidates], edges[candidates]
    facet_ids = np.repeat(np.arange(len(facets)), len(PARTS))
    coordinates = np.tile(PARTS, (len(facets), 1, 1))
    for _ in range(LEVELS):
        L = np.concatenate([1 - coordinates[..., :1] - coordinates[..., 1:], coordinates], axis=-1)
        flat = np.einsum("pka,pax->pkx", quadratic_basis(L)[0], facets[facet_ids])
        nearest, distance, best = nearest_on(flat, point)
        around, facet_ids = flat[best], np.full(len(PARTS), facet_ids[best])
        weights = np.stack([1 - PARTS.sum(axis=2), PARTS[..., 0], PARTS[..., 1]], axis=2)
        coordinates = weights @ coordinates[best]
    return nearest, distance, around, float(edges[facet_ids[0]])


def nearest_on(corners: np.ndarray, point: np.ndarray) -> tuple[np.ndarray, float, int]:
    """Return the nearest place of triangles (f, 3, 3) to a point [m], its distance, and the number of its triangle."""
    a, b, c = np.moveaxis(corners, 1, 0)
    ab, ac, ap = b - a, c - a, point - a
    g = np.array([[np.einsum("fi,fi->f", u, v) for v in (ab, ac)] for u in (ab, ac)])
    r = np.array([np.einsum("fi,fi->f", u, ap) for u in (ab, ac)])
    det = np.maximum(g[0, 0] * g[1, 1] - g[0, 1] ** 2, np.finfo(float).tiny)
    s, t = (g[1, 1] * r[0] - g[0, 1] * r[1]) / det, (g[0, 0] * r[1] - g[0, 1] * r[0]) / det
    interior = (s >= 0) & (t >= 0) & (s + t <= 1)
    best = a + s[:, None] * ab + t[:, None] * ac
    far = np.where(interior, np.linalg.norm(best - point, axis=1), np.inf)
    for i, j in LINES:
        edge = corners[:, j] - corners[:, i]
        fraction = np.einsum("fi,fi->f", point - corners[:, i], edge) / np.einsum("fi,fi->f", edge, edge)
        position = corners[:, i] + np.clip(fraction, 0.0, 1.0)[:, None] * edge
        distance = np.linalg.norm(position - point, axis=1)
        best = np.where((distance < far)[:, None], position, best)
        far = np.minimum(far, distance)
    triangle = int(far.argmin())
    return best[triangle], float(far[triangle]), triangle
