"""From the triangles of a conductor's surface to panels of uniform charge density, graded towards edges and corners.

The density is singular at edges: with the distance d it grows as d^(−1/2) on a sheet and as d^(−1/3) on a box. Each
triangle that touches an edge is therefore cut into strips along it, which end at (k/m)^β of its height, and triangles
at corners are divided towards them before. A panel is a group of flat facets: several where the surface is curved.
Panels make coarse panels of the same grading, four by four. The coarse space is part of the fine one, so that its
capacitance comes from the same matrix and tells the error.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.applications.electrostatics.edges import Features, features
from gudgeon.pipeline.geometry.cells import quadratic_basis

FLAT = 1e-9
"""Distance of a middle node from the middle of its side, relative to the side, up to which a triangle is flat."""
FACET_SHARE = 0.01
"""Estimated effect of flat facets, as a distance over the rise of the surface above them; 0.004 on a sphere."""
HALVES = 0.5 * np.array(
    [
        [[2, 0, 0], [1, 1, 0], [1, 0, 1]],
        [[1, 1, 0], [0, 2, 0], [0, 1, 1]],
        [[1, 0, 1], [0, 1, 1], [0, 0, 2]],
        [[0, 1, 1], [1, 0, 1], [1, 1, 0]],
    ]
)
"""The four parts of a triangle, in area coordinates: part, corner, coordinate."""


class Grading(NamedTuple):
    """How panels are graded."""

    strips: int = 4
    """Coarse strips of a triangle at an edge; panels have twice as many."""
    exponent: float = 4.0
    """β"""
    corner_divisions: int = 3
    """Divisions of triangles towards corners."""
    curved_divisions: int = 1
    """Divisions of a panel of a curved surface into facets."""


class Group(NamedTuple):
    """Panels as `panels.cpp` takes them."""

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


@dataclass(frozen=True)
class Panels:
    """Panels of one or more conductors, sorted by coarse panel."""

    facets: np.ndarray
    """Corners of the flat facets [m], of a solid ordered as seen from outside, (facets, 3, 3)."""
    panel: np.ndarray
    """Panel of each facet, ascending, (facets,)."""
    coarse: np.ndarray
    """Coarse panel of each panel, ascending, (panels,)."""
    conductor: np.ndarray
    """Conductor of each panel, (panels,)."""
    deviation: np.ndarray
    """Estimated distance of the panels from the true surface, where it is not known [m], (panels,)."""

    def __len__(self) -> int:
        return len(self.coarse)

    def group(self) -> Group:
        """Return areas, centres and moments beside the facets."""
        corners = self.facets
        facet_areas = 0.5 * np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        areas = np.bincount(self.panel, facet_areas)
        middles = corners.mean(axis=1)
        centres = np.stack([np.bincount(self.panel, facet_areas * x) for x in middles.T], axis=1) / areas[:, None]
        off = corners - centres[self.panel][:, None]
        # ∫ x xᵀ over a triangle is its area times (Σ x_c x_cᵀ + 9 x̄ x̄ᵀ) / 12.
        mean = off.mean(axis=1)
        squares = (np.einsum("fci,fcj->fij", off, off) + 9 * np.einsum("fi,fj->fij", mean, mean)) / 12
        pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
        moments = np.stack([np.bincount(self.panel, facet_areas * squares[:, i, j]) for i, j in pairs], axis=1)
        radii = np.zeros(len(self))
        np.maximum.at(radii, self.panel, np.linalg.norm(off, axis=2).max(axis=1))
        first_facet = np.searchsorted(self.panel, np.arange(len(self) + 1))
        return Group(
            np.ascontiguousarray(corners.reshape(-1, 9)), first_facet, areas, centres, moments / areas[:, None], radii
        )


Onto = Callable[[np.ndarray], np.ndarray]
"""Moves points (k, 3) onto a surface."""


class Skin(NamedTuple):
    """The surface of a conductor."""

    nodes: np.ndarray
    """[m], (n, 3)"""
    facets: np.ndarray
    """Six-node triangles, (t, 6), corners first."""
    shapes: Sequence[Onto | None] = ()
    """True surfaces by number; None for one that is known by its nodes only."""
    shape: np.ndarray | None = None
    """Number of the true surface of each triangle, (t,); None where no surface is known."""


def panels_of(skin: Skin, grading: Grading, conductor: int = 0) -> Panels:
    """Cut the surface of a conductor into panels; `conductor` is its number."""
    nodes, facets = skin.nodes, skin.facets
    triangles = _towards_corners(_one_edge_each(features(nodes, facets)), grading.corner_divisions)
    corners = nodes[facets]
    chords = np.linalg.norm(corners[:, :3] - np.roll(corners[:, :3], -1, axis=1), axis=2)
    curved = (_rise(corners) / chords).max(axis=1) > FLAT
    shape = np.full(len(facets), -1) if skin.shape is None else skin.shape
    unknown = [n for n, onto in enumerate(skin.shapes) if onto is None]
    deviation = np.where(np.isin(shape, [-1, *unknown]), _deviation(corners), 0.0)
    deviation += curved * FACET_SHARE * _rise(corners).max(axis=1) / 4 ** (1 + grading.curved_divisions)
    groups, panels, coarse = [], 0, 0
    for kind in range(3):
        for bent in (False, True):
            chosen = (triangles.on_edge.sum(axis=1) == kind) & (curved[triangles.parent] == bent)
            if not chosen.any():
                continue
            turned, parent = (
                _edge_first(triangles.coordinates[chosen], triangles.on_edge[chosen]),
                triangles.parent[chosen],
            )
            template = _template(kind, grading, grading.curved_divisions if bent else 0)
            coordinates = np.einsum("fck,pkl->pfcl", template.facets, turned)
            points = np.einsum("pfcn,pnx->pfcx", quadratic_basis(coordinates)[0], corners[parent])
            if bent:
                points = _bent(coordinates, corners[parent], shape[parent], skin.shapes)
            each = np.arange(len(parent))[:, None]
            groups.append(
                (points.reshape(-1, 3, 3), (panels + each * len(template.coarse) + template.panel).ravel(),
                 (coarse + each * (template.coarse[-1] + 1) + template.coarse).ravel(),
                 np.repeat(deviation[parent], len(template.coarse)))
            )  # fmt: skip
            panels += len(parent) * len(template.coarse)
            coarse += len(parent) * (template.coarse[-1] + 1)
    columns = [np.concatenate(column) for column in zip(*groups, strict=True)]
    return Panels(columns[0], columns[1], columns[2], np.full(panels, conductor), columns[3])


def joined(all_panels: Sequence[Panels]) -> Panels:
    """Return the panels of several conductors as one group, in order."""
    panels = np.cumsum([0, *(len(p) for p in all_panels)])
    coarse = np.cumsum([0, *(p.coarse[-1] + 1 for p in all_panels)])
    return Panels(
        np.concatenate([p.facets for p in all_panels]),
        np.concatenate([p.panel + shift for p, shift in zip(all_panels, panels, strict=False)]),
        np.concatenate([p.coarse + shift for p, shift in zip(all_panels, coarse, strict=False)]),
        np.concatenate([p.conductor for p in all_panels]),
        np.concatenate([p.deviation for p in all_panels]),
    )


_PLACES = np.concatenate([np.eye(3), 0.5 * (np.eye(3) + np.roll(np.eye(3), -1, axis=0))])
"""Corners of a triangle, and middles of its sides; a third of the weight on each middle is exact to degree two."""


def _bent(coordinates: np.ndarray, corners: np.ndarray, shape: np.ndarray, shapes: Sequence[Onto | None]) -> np.ndarray:
    """Return flat facets of curved triangles, (p, f, 3, 3), moved to their mean distance 0 from the surface.

    Facets between points of the surface lie on one side of it, which would be an error of the first order of their
    distance.

    Args:
        coordinates: Area coordinates of the facets' corners in their triangles, (p, f, 3, 3).
        corners: Six nodes of each triangle, (p, 6, 3).
        shape: Number of each triangle's true surface, (p,); −1 for none.
    """
    there = np.einsum("kc,pfcl->pfkl", _PLACES, coordinates)
    points = np.einsum("pfkn,pnx->pfkx", quadratic_basis(there)[0], corners)
    for n, onto in enumerate(shapes):
        chosen = shape == n
        if onto is not None and chosen.any():
            points[chosen] = onto(points[chosen].reshape(-1, 3)).reshape(points[chosen].shape)
    flat = points[:, :, :3]
    off = points[:, :, 3:] - np.einsum("kc,pfcx->pfkx", _PLACES[3:], flat)
    return flat + off.mean(axis=2)[:, :, None]


def _rise(corners: np.ndarray) -> np.ndarray:
    """Return the distance of middle nodes from the middles of their chords [m], (t, 3)."""
    ends = corners[:, :3]
    return np.linalg.norm(corners[:, 3:] - 0.5 * (ends + np.roll(ends, -1, axis=1)), axis=2)


def _deviation(corners: np.ndarray) -> np.ndarray:
    """Return the estimated distance of six-node triangles (t, 6, 3) from a smooth surface through their nodes [m].

    A parabola through three points of an arc of radius R over the angle 2α lies up to R α⁴/8 beside it, with a rise of
    its middle s = R α²/2: that is s²/2R = 4 s³/l² for a chord l.
    """
    ends, rise = corners[:, :3], _rise(corners)
    chord = np.linalg.norm(ends - np.roll(ends, -1, axis=1), axis=2)
    return (4 * rise**3 / chord**2).max(axis=1)


class _Parts(NamedTuple):
    """Triangles within those of the surface."""

    parent: np.ndarray
    """(p,)"""
    coordinates: np.ndarray
    """Area coordinates of the corners in the parent, (p, 3, 3)."""
    on_edge: np.ndarray
    """Whether each corner lies on an edge, (p, 3)."""
    at_corner: np.ndarray
    """Whether each corner is a corner of the surface, (p, 3)."""
    sides: np.ndarray
    """Whether each side is an edge, (p, 3); sides 01, 12, 20."""


def _one_edge_each(features_: Features) -> _Parts:
    """Divide triangles until each has at most one edge, and corners on an edge at the ends of it only.

    A side between two edges is halved, in both triangles that have it; a triangle of several edges is cut at its
    middle.
    """
    triangles = []
    across = ~features_.sides & features_.on_edge[:, [0, 1, 2]] & features_.on_edge[:, [1, 2, 0]]
    for t in range(len(features_.sides)):
        coordinates = np.eye(3)
        # Outline: corners, and middles of the sides that are halved.
        outline, marks = [], []
        for k in range(3):
            outline.append(coordinates[k])
            marks.append((features_.on_edge[t, k], features_.at_corner[t, k], features_.sides[t, k]))
            if across[t, k]:
                outline.append(0.5 * (coordinates[k] + coordinates[(k + 1) % 3]))
                marks.append((False, False, False))
        for chosen in _triangles([m[2] for m in marks]):
            on, at_corner, side = zip(*(marks[i] if i >= 0 else (False, False, False) for i in chosen), strict=True)
            corners = [outline[i] if i >= 0 else np.full(3, 1 / 3) for i in chosen]
            n = len(outline)
            following = (*chosen[1:], chosen[0])
            along = [s and i >= 0 and j == (i + 1) % n for s, i, j in zip(side, chosen, following, strict=True)]
            triangles.append((t, corners, on, at_corner, along))
    parent, corners, on, at_corner, along = zip(*triangles, strict=True)
    return _Parts(np.array(parent), np.array(corners), np.array(on), np.array(at_corner), np.array(along))


def _triangles(edges: Sequence[bool]) -> list[tuple[int, int, int]]:
    """Return triangles of an outline's points by number, −1 for the middle; `edges` tells which sides are edges."""
    n = len(edges)
    if n == 3 and sum(edges) <= 1:
        return [(0, 1, 2)]
    return [(i, (i + 1) % n, -1) for i in range(n)]


def _towards_corners(triangles: _Parts, divisions: int) -> _Parts:
    """Divide triangles at corners in four, and the part at the corner again."""
    done, at_corners = [], triangles
    for _ in range(divisions):
        chosen = at_corners.at_corner.any(axis=1)
        done.append(_Parts(*(column[~chosen] for column in at_corners)))
        at_corners = _divided(_Parts(*(column[chosen] for column in at_corners)))
    done.append(at_corners)
    return _Parts(*(np.concatenate(column) for column in zip(*done, strict=True)))


def _divided(triangles: _Parts) -> _Parts:
    """Divide triangles in four."""
    coordinates = np.einsum("qck,pkl->pqcl", HALVES, triangles.coordinates).reshape(-1, 3, 3)
    count = len(triangles.parent)
    on, at_corner, side = (np.zeros((count, 4, 3), dtype=bool) for _ in range(3))
    for k in range(3):
        after, before = (k + 1) % 3, (k + 2) % 3
        on[:, k, k], at_corner[:, k, k] = triangles.on_edge[:, k], triangles.at_corner[:, k]
        # The middle of an edge lies on it: a corner of two of the outer parts and of the inner one.
        on[:, k, after] = triangles.sides[:, k]
        on[:, after, k] = triangles.sides[:, k]
        on[:, 3, before] = triangles.sides[:, k]
        side[:, k, k] = triangles.sides[:, k]
        side[:, after, k] = triangles.sides[:, k]
    return _Parts(
        np.repeat(triangles.parent, 4), coordinates, on.reshape(-1, 3), at_corner.reshape(-1, 3), side.reshape(-1, 3)
    )


def _edge_first(coordinates: np.ndarray, on_edge: np.ndarray) -> np.ndarray:
    """Return the corners turned so that those on an edge come first, (p, 3, 3)."""
    count = on_edge.sum(axis=1)
    start = np.where(count == 2, (np.argmin(on_edge, axis=1) + 1) % 3, np.argmax(on_edge, axis=1))
    order = (start[:, None] + np.arange(3)) % 3
    return np.take_along_axis(coordinates, order[:, :, None], axis=1)


class _Template(NamedTuple):
    """Panels of one triangle."""

    facets: np.ndarray
    """Area coordinates of the facets' corners, (f, 3, 3)."""
    panel: np.ndarray
    """(f,)"""
    coarse: np.ndarray
    """(panels,)"""


def _template(corners_on_edge: int, grading: Grading, divisions: int) -> _Template:
    """Return the panels of a triangle with none, the first, or the first two corners on an edge."""
    if corners_on_edge == 0:
        facets, panel, coarse = HALVES, np.arange(4), np.zeros(4, dtype=int)
    else:
        facets, panel, coarse = _strips(corners_on_edge, grading)
    for _ in range(divisions):
        facets = np.einsum("qck,fkl->fqcl", HALVES, facets).reshape(-1, 3, 3)
        panel = np.repeat(panel, 4)
    return _Template(facets, panel, coarse)


def _strips(corners_on_edge: int, grading: Grading) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return facets, their panels, and the coarse panels of a triangle at an edge, by the level d of its strips."""
    levels = (np.arange(2 * grading.strips + 1) / (2 * grading.strips)) ** grading.exponent

    def at(d: float, s: float) -> np.ndarray:
        if corners_on_edge == 2:
            return (1 - d) * np.array([1 - s, s, 0]) + d * np.eye(3)[2]
        return (1 - d) * np.eye(3)[0] + d * np.array([0, 1 - s, s])

    facets, panel, coarse = [], [], []
    for k in range(2 * grading.strips):
        for s in (0.0, 0.5):
            a, b = at(levels[k], s), at(levels[k], s + 0.5)
            c, d = at(levels[k + 1], s + 0.5), at(levels[k + 1], s)
            for facet in ((a, b, c), (a, c, d)):
                if abs(turn := np.linalg.det(np.array(facet))) > 1e-14:
                    facets.append(facet if turn > 0 else facet[::-1])
                    panel.append(len(coarse))
            coarse.append(k // 2)
    return np.array(facets), np.array(panel), np.array(coarse)
