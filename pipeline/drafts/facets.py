"""Which facets of two parts are near each other and face each other: trees of their centres, bounded by their sizes."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.interfaces.points import facet_points

FACING = -0.3
"""Largest cosine between the outward normals of facets that can meet, as in `solver.contact.facets`."""


@dataclass(frozen=True)
class Boundary:
    """The f facets of all named surfaces of a part, placed in the scene."""

    names: list[str]
    owner: np.ndarray
    """Number of the surface of each, (f,)."""
    centres: np.ndarray
    """[m], (f, 3)."""
    normals: np.ndarray
    """Outward unit normals, (f, 3)."""
    radii: np.ndarray
    """Largest distance of a node from the centre [m], (f,)."""

    @classmethod
    def of(cls, mesh: MeshRecord, turn: np.ndarray, position: np.ndarray) -> "Boundary":
        """Return the boundary of a part that is turned, then moved [m]; surfaces without normals are left out."""
        names, owner, centres, normals, radii = list[str](), list[np.ndarray](), [], [], []
        for name, surface in sorted(mesh.surfaces.items()):
            if surface.areas is not None or surface.facets.shape[1] == 1 or not len(surface.facets):
                continue
            for block in facet_points(mesh.nodes, surface):
                vectors, corners = block.vectors.sum(axis=1), mesh.nodes[block.nodes]
                middle = corners.mean(axis=1)
                owner.append(np.full(len(corners), len(names)))
                centres.append(middle)
                normals.append(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
                radii.append(np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1))
            names.append(name)
        empty = np.empty((0, 3))
        return cls(
            names, np.concatenate([np.empty(0, np.int64), *owner]),
            np.vstack([empty, *centres]) @ turn.T + position, np.vstack([empty, *normals]) @ turn.T,
            np.concatenate([np.empty(0), *radii]),
        )  # fmt: skip


@dataclass(frozen=True)
class Near:
    """Two surfaces that are near each other."""

    own: str
    other: str
    facets: tuple[int, int]
    """How many facets of each are near the other."""
    gaps: tuple[float, float]
    """Least and largest distance of the centres of those facets along normals [m]."""


def near(boundary_a: Boundary, boundary_b: Boundary, within: float) -> list[Near]:
    """Return the surfaces of two parts that face each other within a distance [m], those with most facets first.

    A surface whose near facets all belong to one found before is left out.
    """
    pairs, gaps = _pairs(boundary_a, boundary_b, within)
    if not len(pairs):
        return []
    key = boundary_a.owner[pairs[:, 0]] * len(boundary_b.names) + boundary_b.owner[pairs[:, 1]]
    surfaces, taken = list[Near](), np.zeros((2, max(len(boundary_a.centres), len(boundary_b.centres))), np.bool_)
    groups = {int(k): np.flatnonzero(key == k) for k in np.unique(key)}
    for surface_pair, group in sorted(groups.items(), key=lambda item: (-len(np.unique(pairs[item[1], 0])), item[0])):
        mine, theirs = (_places(boundary, pairs[group, side]) for side, boundary in enumerate((boundary_a, boundary_b)))
        if taken[0, mine].all() and taken[1, theirs].all():
            continue
        taken[0, mine] = taken[1, theirs] = True
        a, b = divmod(surface_pair, len(boundary_b.names))
        facets = len(np.unique(mine)), len(np.unique(theirs))
        surfaces.append(
            Near(boundary_a.names[a], boundary_b.names[b], facets, (float(gaps[group].min()), float(gaps[group].max())))
        )
    return surfaces


def apart(a: Boundary, b: Boundary) -> float:
    """Return the least distance of facets of two parts that face each other [m]; infinite where none do."""
    size = float(np.linalg.norm(np.ptp(np.vstack([a.centres, b.centres]), axis=0)))
    _, gaps = _pairs(a, b, size)
    return float(gaps[gaps >= 0].min(initial=np.inf))


def _places(boundary: Boundary, numbers: np.ndarray) -> np.ndarray:
    """Return the first facet at the place of each: surfaces may share facets."""
    return KDTree(boundary.centres).query(boundary.centres[numbers])[1]


def _pairs(a: Boundary, b: Boundary, within: float) -> tuple[np.ndarray, np.ndarray]:
    """Return pairs of facets that face each other, (p, 2), and their distances along the normal of the first [m]."""
    if not len(a.centres) or not len(b.centres):
        return np.empty((0, 2), np.int64), np.empty(0)
    radius = within + a.radii + b.radii.max()
    listed = KDTree(b.centres).query_ball_point(a.centres, radius)
    i = np.repeat(np.arange(len(a.centres)), [len(js) for js in listed])
    j = np.concatenate([np.empty(0, np.int64), *(np.asarray(js, np.int64) for js in listed)])
    offset = b.centres[j] - a.centres[i]
    gap = np.einsum("pi,pi->p", offset, a.normals[i])
    aside = np.linalg.norm(offset - gap[:, None] * a.normals[i], axis=1)
    faces = np.einsum("pi,pi->p", a.normals[i], b.normals[j]) < FACING
    # Facets inside the other part by more than their size are those of its far side.
    facing = faces & (gap <= within) & (gap >= -np.minimum(within, a.radii[i]))
    facing &= aside <= a.radii[i] + b.radii[j]
    return np.column_stack([i, j])[facing], gap[facing]
