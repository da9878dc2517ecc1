"""Where a component is touched or loaded, and the contact points of a named surface.

On quadratic triangles the consistent weight of a corner is zero, so contact lives on mid-side nodes: a uniform
pressure p gives each the force p·a, a = Σ ∫ N dA over its facets. On the edges of plane parts corners have a sixth of
an edge each, and all nodes are contact points.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.surfaces import cylindrical, true_surface
from gudgeon.pipeline.scenes.interface import Interface

ON_A_LINE = 1e-6
"""Extent of points across a line over that along it: below, they have one coordinate only."""


@dataclass(frozen=True)
class ContactPoints:
    """Points, outward normals and tributary areas on the true surface; see InterfaceModes."""

    nodes: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    areas: np.ndarray
    edge: np.ndarray


def contact_points(mesh: MeshRecord, interface: Interface, where: str) -> ContactPoints:
    """Find the contact points of an interface.

    Args:
        where: The interface's key in the scene, for messages.

    Raises:
        InputError: the mesh has no such surface, or nothing of it is left.
    """
    surface = named_surface(mesh, interface, where)
    if surface.facets.shape[1] == 1:
        shape = surface.shape
        normal, area = np.array([shape["normal"]]), np.array([shape["area"]])
        return ContactPoints(surface.facets.ravel(), np.array([shape["origin"]]), normal, area, np.zeros(1, bool))
    nodes, areas, normals = _weighted_nodes(mesh.nodes, surface)
    points = mesh.nodes[nodes]
    if "kind" in surface.shape:
        points, normals = true_surface(points, normals, surface.shape)
    keep = _inside(points, interface, surface.shape, where)
    if not keep.any():
        raise InputError(f"{where}: no contact point of surface '{interface.surface}' lies in its sector and height")
    edge = np.isin(nodes[keep], _neighbours(surface.facets, nodes[~keep]))
    return ContactPoints(nodes[keep], points[keep], normals[keep], areas[keep], edge)


def named_surface(mesh: MeshRecord, interface: Interface, where: str) -> Surface:
    """Return the surface of an interface.

    Raises:
        InputError: the mesh has no such surface.
    """
    if interface.surface not in mesh.surfaces:
        have = ", ".join(sorted(mesh.surfaces)) or "none"
        raise InputError(f"{where}.surface: the mesh has no surface '{interface.surface}', it has {have}")
    return mesh.surfaces[interface.surface]


def surface_coordinates(points: np.ndarray, shape: dict[str, Any]) -> np.ndarray:
    """Return smooth coordinates over a patch of points, each scaled to [−1, 1], (c, 2), or (c, 1) along a line.

    Arc and height on a cylinder; the two principal directions of the points anywhere else.
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


def thickness_of(surface: Surface) -> float:
    """Return the thickness of a plane part [m], 1 of a solid."""
    return float(surface.shape.get("thickness", 1.0))


def facet_points(
    nodes: np.ndarray, facets: np.ndarray, pieces: int = 1, *, thickness: float = 1.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return quadrature points of curved facets, exact to degree 4 on straight ones.

    Args:
        nodes: [m], (n, 3).
        facets: Node numbers, corners first, (f, 6) of a solid, (f, 3) of a plane part, which lies on their left.
        pieces: Into how many parts each edge is divided: pieces² triangles a facet, each with a rule of its own.
        thickness: Of a plane part [m].

    Returns:
        Shape functions N (6, q) or (3, q), points [m] (f, q, 3) and outward vectors of area [m^2] (f, q, 3).
    """
    from skfem import ElementLineP2, ElementTriP2
    from skfem.quadrature import get_quadrature

    if facets.shape[1] == 3:
        line = ElementLineP2()
        X, W = get_quadrature(type(line).refdom, 4)
        N, dN = (np.array([np.squeeze(line.lbasis(X, a)[k]) for a in range(3)]) for k in (0, 1))
        along = np.einsum("fai,aq->fqi", nodes[facets], dN) * (thickness * W)[:, None]
        return N, np.einsum("fai,aq->fqi", nodes[facets], N), np.cross(along, [0.0, 0.0, 1.0])
    element = ElementTriP2()
    X, W = get_quadrature(type(element).refdom, 4)
    upward = [(i, j) for i in range(pieces) for j in range(pieces - i)]
    downward = [(i, j) for i in range(1, pieces) for j in range(1, pieces - i + 1)]
    starts = np.array([(i, j, 1) for i, j in upward] + [(i, j, -1) for i, j in downward], float)
    X = ((starts[:, :2] + starts[:, 2:] * X.T[:, None]) / pieces).reshape(-1, 2).T
    W = np.repeat(W, len(starts)) / pieces**2
    basis = [element.lbasis(X, a) for a in range(6)]
    N, dN = np.array([b[0] for b in basis]), np.array([b[1] for b in basis])
    corners = nodes[facets]
    tangents = np.einsum("fai,akq->fqki", corners, dN)
    vectors = np.cross(tangents[:, :, 0], tangents[:, :, 1]) * W[:, None]
    return N, np.einsum("fai,aq->fqi", corners, N), vectors


def _first_weighted(facets: np.ndarray) -> int:
    """Return the first of a facet's nodes with a weight of its own: the first mid-side node, on edges any node."""
    return 3 if facets.shape[1] == 6 else 0


def _weighted_nodes(nodes: np.ndarray, surface: Surface) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the numbers of the nodes that carry weight (k,), their areas (k,) and mean outward normals (k, 3)."""
    facets, first = surface.facets, _first_weighted(surface.facets)
    N, _, elements = facet_points(nodes, facets, thickness=thickness_of(surface))
    numbers, slot = np.unique(facets[:, first:], return_inverse=True)
    vectors, areas = np.zeros((len(numbers), 3)), np.zeros(len(numbers))
    np.add.at(vectors, slot.ravel(), np.einsum("aq,fqi->fai", N[first:], elements).reshape(-1, 3))
    np.add.at(areas, slot.ravel(), np.einsum("aq,fq->fa", N[first:], np.linalg.norm(elements, axis=2)).ravel())
    return numbers, areas, vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _neighbours(facets: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Return all nodes that carry weight of the facets that hold one of `nodes`."""
    own = facets[:, _first_weighted(facets) :]
    return np.unique(own[np.isin(own, nodes).any(axis=1)])


def _inside(points: np.ndarray, interface: Interface, shape: dict[str, Any], where: str) -> np.ndarray:
    keep = np.ones(len(points), bool)
    if interface.sector_deg is None and interface.height is None:
        return keep
    if shape.get("kind") != "cylinder":
        raise InputError(f"{where}: sector_deg and height need a cylindrical surface, '{interface.surface}' is none")
    _, angle, height = cylindrical(points, shape)
    if interface.sector_deg is not None:
        low, high = np.radians(interface.sector_deg)
        keep &= np.mod(angle - low, 2 * np.pi) <= high - low
    if interface.height is not None:
        keep &= (height >= interface.height[0]) & (height <= interface.height[1])
    return keep
