"""Contact points of a named surface, and integrals over its curved facets.

On quadratic triangles the consistent weight of a corner is zero, so the contact points are the mid-side nodes: under a
uniform pressure p each has the force p·a, a = Σ ∫ N dA over its facets. On the edges of plane parts a corner has a
sixth of each edge, and all nodes are contact points.
"""

from dataclasses import dataclass, field

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.modaldb.records.modes import InterfaceModes
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.reference import reference, rule, shape_functions
from gudgeon.pipeline.geometry.cells import LINE3, TRIANGLE6
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, cylindrical, find_surface, true_surface
from gudgeon.pipeline.scenes.interface import Interface

ON_A_LINE = 1e-6
"""Extent of points across a line over the extent along it; below, one coordinate is enough,
and the rotation about the line is undetermined."""


@dataclass(frozen=True)
class ContactPoints:
    """Points, outward normals and tributary areas on the true surface; see InterfaceModes."""

    nodes: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    areas: np.ndarray
    edge: np.ndarray
    facets: np.ndarray = field(default_factory=lambda: np.empty((0, 3), np.int64))

    def modes(self, rows: np.ndarray) -> InterfaceModes:
        """Return the record with the points' displacement rows per coordinate, (c, m)."""
        return InterfaceModes(self.nodes, self.points, self.normals, self.areas, self.edge, rows, facets=self.facets)


def contact_points(mesh: MeshRecord, interface: Interface, key: str) -> ContactPoints:
    """Return the contact points of an interface; `key` is its key in the scene, for messages.

    Raises:
        InputError: the mesh has no such surface, or no contact point lies within its sector and height.
    """
    surface = find_surface(mesh, interface.surface, f"{key}.surface")
    if surface.areas is not None:
        return _of_nodes(mesh, interface, surface, key)
    if surface.facets.shape[1] == 1:
        shape = surface.shape
        normal, area = np.array([shape["normal"]]), np.array([shape["area"]])
        return ContactPoints(surface.facets.ravel(), np.array([shape["origin"]]), normal, area, np.zeros(1, bool))
    nodes, areas, vectors = surface_weights(mesh, surface)
    # On quadratic triangles the mid-side nodes have the weights; on edges, all nodes.
    bearing = surface.facets[:, 3:] if surface.facets.shape[1] == 6 else surface.facets
    weighted = np.isin(nodes, bearing)
    nodes, areas, vectors = nodes[weighted], areas[weighted], vectors[weighted]
    normals = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    points = mesh.nodes[nodes]
    if "kind" in surface.shape:
        points, normals = true_surface(points, normals, surface.shape)
    keep = _inside(points, interface, surface.shape, key)
    if not keep.any():
        raise InputError(f"{key}: no contact point of surface '{interface.surface}' lies in its sector and height")
    edge = np.isin(nodes[keep], bearing[np.isin(bearing, nodes[~keep]).any(axis=1)])
    point_id = np.full(len(mesh.nodes), -1)
    point_id[nodes[keep]] = np.arange(int(keep.sum()))
    facets = point_id[bearing]
    return ContactPoints(nodes[keep], points[keep], normals[keep], areas[keep], edge, facets[(facets >= 0).all(axis=1)])


def _of_nodes(mesh: MeshRecord, interface: Interface, surface: Surface, key: str) -> ContactPoints:
    """Return the nodes of a set that stand for an area as contact points; none of them is marked as an edge."""
    refuse_unknown_normals(surface, interface.surface, key)
    assert surface.areas is not None
    assert surface.normals is not None
    bearing = surface.areas > 0
    nodes, areas, normals = surface.facets.ravel()[bearing], surface.areas[bearing], surface.normals[bearing]
    points = mesh.nodes[nodes]
    if "kind" in surface.shape:
        points, normals = true_surface(points, normals, surface.shape)
    keep = _inside(points, interface, surface.shape, key)
    if not keep.any():
        raise InputError(f"{key}: no node of set '{interface.surface}' lies in its sector and height")
    return ContactPoints(nodes[keep], points[keep], normals[keep], areas[keep], np.zeros(int(keep.sum()), bool))


def refuse_unknown_normals(surface: Surface, name: str, key: str) -> None:
    """Refuse a set of nodes without normals; `key` is the key of the interface on it.

    Raises:
        InputError: it is one.
    """
    if surface.areas is not None and surface.normals is None:
        raise InputError(
            f"{key}.surface: '{name}' given, a set of nodes that are not on one plane and bound no element; state"
            " its shape in geometry.surfaces"
        )


def surface_coordinates(points: np.ndarray, shape: SurfaceRule) -> np.ndarray:
    """Return smooth coordinates of the points of a surface, each scaled to [−1, 1], (c, 2), or (c, 1) along a line.

    Arc and height on a cylinder, the two principal directions of the points on other shapes.
    """
    if shape.get("kind") == "cylinder":
        radius, angle, height = cylindrical(points, shape)
        middle = np.angle(np.exp(1j * angle).mean())
        pair = np.column_stack([np.angle(np.exp(1j * (angle - middle))) * radius.mean(), height])
    else:
        centred = points - points.mean(axis=0)
        pair = centred @ np.linalg.svd(centred, full_matrices=False)[2][:2].T
    if pair.shape[1] > 1 and np.ptp(pair[:, 1]) <= ON_A_LINE * np.ptp(pair[:, 0]):
        pair = pair[:, :1]
    low, span = pair.min(axis=0), np.ptp(pair, axis=0)
    return 2 * (pair - low) / np.where(span > 0, span, 1.0) - 1


def facet_points(nodes: np.ndarray, surface: Surface, pieces: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return quadrature points of curved facets, exact to degree 4 on straight ones.

    Args:
        nodes: [m], (n, 3).
        surface: Of facets (f, 6) on a solid, (f, 3) on a plane part, on their left, or nodes (f, 1).
        pieces: Into how many parts each edge is divided: pieces² triangles a facet, each with its own rule.

    Returns:
        Shape functions N (a, q), points [m] (f, q, 3) and outward vectors of area [m^2] (f, q, 3).
    """
    corners = nodes[surface.facets]
    if surface.areas is not None:
        normals = np.zeros((len(corners), 3)) if surface.normals is None else surface.normals
        return np.ones((1, 1)), corners, (surface.areas[:, None] * normals)[:, None]
    if corners.shape[1] == 1:
        return np.ones((1, 1)), corners, surface.shape["area"] * np.array(surface.shape["normal"])[None, None]
    if corners.shape[1] == 3:
        N, dN, W = reference(LINE3, 4)
        along = np.einsum("fai,aq->fqi", corners, dN[:, 0]) * (surface.shape.get("thickness", 1.0) * W)[:, None]
        return N, np.einsum("fai,aq->fqi", corners, N), np.cross(along, [0.0, 0.0, 1.0])
    X, W = rule(TRIANGLE6, 4)
    upward = [(i, j) for i in range(pieces) for j in range(pieces - i)]
    downward = [(i, j) for i in range(1, pieces) for j in range(1, pieces - i + 1)]
    starts = np.array([(i, j, 1) for i, j in upward] + [(i, j, -1) for i, j in downward], float)
    X = ((starts[:, :2] + starts[:, 2:] * X.T[:, None]) / pieces).reshape(-1, 2).T
    W = np.repeat(W, len(starts)) / pieces**2
    N, dN = shape_functions(TRIANGLE6, X)
    tangents = np.einsum("fai,akq->fqki", corners, dN)
    vectors = np.cross(tangents[:, :, 0], tangents[:, :, 1]) * W[:, None]
    return N, np.einsum("fai,aq->fqi", corners, N), vectors


def surface_weights(mesh: MeshRecord, surface: Surface) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the nodes of a surface (k,), ∫ N dA of each [m^2] (k,) and ∫ N n dA of each [m^2] (k, 3), n outward."""
    if surface.areas is not None:
        normals = 0.0 if surface.normals is None else surface.normals
        return (
            surface.facets.ravel(),
            surface.areas,
            surface.areas[:, None] * np.broadcast_to(normals, (len(surface.areas), 3)),
        )
    N, _, elements = facet_points(mesh.nodes, surface)
    nodes, slot = np.unique(surface.facets, return_inverse=True)
    areas = np.einsum("aq,fq->fa", N, np.linalg.norm(elements, axis=2))
    vectors = np.einsum("aq,fqi->fai", N, elements).reshape(-1, 3)
    summed = [np.bincount(slot.ravel(), values, len(nodes)) for values in (areas.ravel(), *vectors.T)]
    return nodes, summed[0], np.column_stack(summed[1:])


def _inside(points: np.ndarray, interface: Interface, shape: SurfaceRule, key: str) -> np.ndarray:
    keep = np.ones(len(points), bool)
    if interface.sector_deg is None and interface.height is None:
        return keep
    if shape.get("kind") != "cylinder":
        raise InputError(
            f"{key}: sector_deg and height need a cylinder, '{interface.surface}' is none; a cylinder of a mesh file"
            " must be declared in geometry.surfaces"
        )
    _, angle, height = cylindrical(points, shape)
    if interface.sector_deg is not None:
        low, high = np.radians(interface.sector_deg)
        keep &= np.mod(angle - low, 2 * np.pi) <= high - low
    if interface.height is not None:
        keep &= (height >= interface.height[0]) & (height <= interface.height[1])
    return keep
