"""One contact row for a flat surface: its mean outward normal displacement, ∫ n·u dA / A.

The force conjugate to it is a uniform pressure of unit resultant, with the consistent weights ∫ N dA / A of the
facets, which are almost zero at the corners of quadratic ones.
"""

from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.spatial import ConvexHull

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.modaldb.records.traction import cross_axes
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.surfaces import find_surface
from gudgeon.pipeline.interfaces.points import (
    ContactPoints,
    contact_points,
    refuse_unknown_normals,
    surface_points,
    surface_weights,
)
from gudgeon.pipeline.scenes.interface import Interface

FLATNESS = 1e-6
"""Largest difference of normals, and distance from the plane over the surface's size: far above round-off."""


def patch_point(mesh: MeshRecord, interface: Interface, key: str) -> ContactPoints:
    """Return the centroid of a flat surface with its normal and area as the only contact point.

    Raises:
        InputError: the mesh has no such surface, or it is not flat.
    """
    surface = find_surface(mesh, interface.surface, f"{key}.surface")
    refuse_unknown_normals(surface, interface.surface, key)
    if surface.areas is not None:
        surface = replace(surface, facets=surface.facets[(bearing := surface.areas > 0)], areas=surface.areas[bearing],
                          normals=None if surface.normals is None else surface.normals[bearing])  # fmt: skip
    elif surface.facets.shape[1] == 1:
        return contact_points(mesh, interface, key)
    positions, elements = surface_points(mesh.nodes, surface)
    areas = np.linalg.norm(elements, axis=1)
    area = float(areas.sum())
    normal = elements.sum(axis=0)
    normal = normal / max(float(np.linalg.norm(normal)), np.finfo(float).tiny)
    centroid = areas @ positions / area
    bend = float(np.abs(elements / areas[:, None] - normal).max())
    bulge = float(np.abs((positions - centroid) @ normal).max()) / np.sqrt(area)
    if max(bend, bulge) > FLATNESS:
        raise InputError(
            f"{key}.surface: '{interface.surface}' given, kind 'patch' needs a flat surface; its normals differ by"
            f" {bend:.2g}, its points lie {bulge:.2g} of its size off a plane"
        )
    nodes = np.unique(surface.facets)
    nearest = nodes[[int(np.linalg.norm(mesh.nodes[nodes] - centroid, axis=1).argmin())]]
    return ContactPoints(
        nearest, centroid[None], normal[None], np.array([area]), np.zeros(1, bool),
        outline=outline(mesh.nodes[nodes], normal),
    )  # fmt: skip


def outline(points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return the corners of the convex hull of points of a plane [m], (h, 3), or the ends of points along a line.

    Args:
        points: [m], (n, 3).
        normal: Of the plane, (3,).
    """
    across = cross_axes(normal)
    arms = points - points.mean(axis=0)
    plane = arms @ np.array(across).T
    lengths, axes = np.linalg.svd(plane, full_matrices=False)[1:]
    if lengths[-1] <= FLATNESS * lengths[0]:
        along = plane @ axes[0]
        return points[[int(along.argmin()), int(along.argmax())]]
    return points[ConvexHull(plane).vertices]


def normal_rows(model: FEModel, interface: Interface, points: ContactPoints) -> sparse.csr_matrix:
    """Return the outward normal displacement of contact points as rows over the dofs, (c, dofs); of a patch its mean.

    Args:
        points: The points of the interface, as found by `POINT_FINDERS`.
    """
    if interface.kind == "points":
        return model.rows(points.nodes, points.normals)
    nodes, areas, _ = surface_weights(model.mesh, find_surface(model.mesh, interface.surface, "interface"))
    return model.weighted(nodes, ((areas / areas.sum())[:, None] * points.normals[0])[None])


POINT_FINDERS = {"points": contact_points, "patch": patch_point}
"""Contact points of an interface by its kind."""
