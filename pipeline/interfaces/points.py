"""Contact points of a named surface, and integrals over its curved facets.

On quadratic triangles the consistent weight of a corner is zero, so the contact points are the mid-side nodes: under a
uniform pressure p each has the force p·a, a = Σ ∫ N dA over its facets. On quadrilaterals of 8 nodes that weight is
negative, a twelfth of the facet; the two mid-side nodes beside the corner take it, which keeps linear fields exact. On
linear facets, on quadrilaterals of 9 nodes and on the edges of plane parts all nodes are contact points.
"""

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.modaldb.records.modes import InterfaceModes
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.reference import reference, rule, shape_functions
from gudgeon.pipeline.fem.elements.solid import mass_properties
from gudgeon.pipeline.geometry.cells import (
    FACETS,
    LINE3,
    NODES,
    QUADRANGLE8,
    TRIANGLE,
    TRIANGLE6,
    Block,
    Cell,
    cell_of,
    facet_blocks,
)
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, cylindrical, find_surface, true_surface
from gudgeon.pipeline.scenes.interface import Interface

ON_A_LINE = 1e-6
"""Extent of points across a line over the extent along it; below, one coordinate is enough,
and the rotation about the line is undetermined."""
PAIRED = ([TRIANGLE6], [LINE3])
"""Types of facets, alone on a surface, whose points can face those of another mesh at other places, see
`solver.contact.facets`; points of others face points."""


@dataclass(frozen=True)
class ContactPoints:
    """Points, outward normals and tributary areas on the true surface; see InterfaceModes."""

    nodes: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    areas: np.ndarray
    edge: np.ndarray
    facets: np.ndarray = field(default_factory=lambda: np.empty((0, 3), np.int64))
    outline: np.ndarray | None = None

    def modes(self, rows: np.ndarray) -> InterfaceModes:
        """Return the record with the points' displacement rows per coordinate, (c, m)."""
        return InterfaceModes(
            self.nodes, self.points, self.normals, self.areas, self.edge, rows, facets=self.facets, outline=self.outline
        )


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
    nodes, areas, vectors = surface_weights(mesh, surface, bearing=True)
    normals = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    points = mesh.nodes[nodes]
    if "kind" in surface.shape:
        points, normals = true_surface(points, normals, surface.shape)
    keep = _inside(points, interface, surface.shape, key)
    if not keep.any():
        raise InputError(f"{key}: no contact point of surface '{interface.surface}' lies in its sector and height")
    blocks = [(block.cell, block.nodes[:, _bearing(block.cell)]) for block in facet_blocks(surface.facets)]
    bordering = [rows[np.isin(rows, nodes[~keep]).any(axis=1)].ravel() for _, rows in blocks]
    edge = np.isin(nodes[keep], np.concatenate(bordering))
    point_id = np.full(len(mesh.nodes), -1)
    point_id[nodes[keep]] = np.arange(int(keep.sum()))
    facets = point_id[blocks[0][1]] if [cell for cell, _ in blocks] in PAIRED else np.empty((0, 3), np.int64)
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


class FacetPoints(NamedTuple):
    """Quadrature points of the curved facets of one type of a surface."""

    rows: np.ndarray
    """Numbers of the facets in the surface, (f,)."""
    nodes: np.ndarray
    """Their nodes, (f, a)."""
    N: np.ndarray
    """Shape functions, (a, q)."""
    points: np.ndarray
    """[m], (f, q, 3)."""
    vectors: np.ndarray
    """Outward vectors of area [m^2], (f, q, 3)."""


def facet_points(nodes: np.ndarray, surface: Surface, pieces: int = 1) -> list[FacetPoints]:
    """Return quadrature points of curved facets by their type, exact to degree 4 on straight ones.

    Args:
        nodes: [m], (n, 3).
        surface: Of facets of a solid, of edges (f, 3) of a plane part, on their left, or of nodes (f, 1).
        pieces: Into how many parts each edge is divided: pieces² parts of a facet, each with its own rule.
    """
    return [_points_of(nodes, surface, block, pieces) for block in facet_blocks(surface.facets)]


def surface_points(nodes: np.ndarray, surface: Surface, pieces: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return the points [m] and outward vectors of area [m^2] of all facets, (p, 3) each, as of `facet_points`."""
    blocks = facet_points(nodes, surface, pieces)
    points = np.concatenate([block.points.reshape(-1, 3) for block in blocks])
    return points, np.concatenate([block.vectors.reshape(-1, 3) for block in blocks])


def _points_of(nodes: np.ndarray, surface: Surface, block: Block, pieces: int) -> FacetPoints:
    """Return the quadrature points of facets of one type."""
    cell, rows, facets = block
    corners = nodes[facets]
    if surface.areas is not None:
        normals = np.zeros((len(corners), 3)) if surface.normals is None else surface.normals
        return FacetPoints(rows, facets, np.ones((1, 1)), corners, (surface.areas[:, None] * normals)[:, None])
    if cell is NODES:
        vector = surface.shape["area"] * np.array(surface.shape["normal"])[None, None]
        return FacetPoints(rows, facets, np.ones((1, 1)), corners, vector)
    if cell is LINE3:
        N, dN, W = reference(LINE3, 4)
        along = np.einsum("fai,aq->fqi", corners, dN[:, 0]) * (surface.shape.get("thickness", 1.0) * W)[:, None]
        return FacetPoints(rows, facets, N, np.einsum("fai,aq->fqi", corners, N), np.cross(along, [0.0, 0.0, 1.0]))
    X, W = rule(cell, 4)
    starts = _piece_starts(cell, pieces)
    X = ((starts[:, :2] + starts[:, 2:] * X.T[:, None]) / pieces).reshape(-1, 2).T
    W = np.repeat(W, len(starts)) / pieces**2
    N, dN = shape_functions(cell, X)
    tangents = np.einsum("fai,akq->fqki", corners, dN)
    vectors = np.cross(tangents[:, :, 0], tangents[:, :, 1]) * W[:, None]
    return FacetPoints(rows, facets, N, np.einsum("fai,aq->fqi", corners, N), vectors)


def _piece_starts(cell: Cell, pieces: int) -> np.ndarray:
    """Return corner and sense (±1) of the parts of a reference facet, in lengths of parts, (p, 3)."""
    if cell.shape is not TRIANGLE:
        return np.array([(i, j, 1) for i in range(pieces) for j in range(pieces)], float)
    upward = [(i, j, 1) for i in range(pieces) for j in range(pieces - i)]
    downward = [(i, j, -1) for i in range(1, pieces) for j in range(1, pieces - i + 1)]
    return np.array(upward + downward, float)


class ShapeErrors(NamedTuple):
    """What the mass of a solid mesh of uniform density is above that within its true surfaces."""

    volume: float
    """Volume and mass, over those of the mesh [1]."""
    inertia: float
    """Of a principal moment of inertia over it, or of the place of the centre over the radius of gyration, the larger
    size [1]."""


def shape_errors(mesh: MeshRecord) -> ShapeErrors:
    """Return the errors of a solid mesh by the region between its facets and its true surfaces.

    That region has the volume ∫ d·n dA with d from a point of a facet to the surface, and is taken to lie at d/2.
    """
    if not cell_of(mesh).solid or mesh.system is not None:
        return ShapeErrors(0.0, 0.0)
    positions, volumes, counted = [np.zeros((0, 3))], [np.zeros(0)], set[tuple[int, ...]]()
    for surface in mesh.surfaces.values():
        if surface.areas is not None or surface.shape.get("kind") in (None, "plane"):
            continue
        keys = [tuple(nodes) for nodes in np.sort(surface.facets, axis=1).tolist()]
        new = np.array([key not in counted for key in keys], bool)
        counted.update(keys)
        if new.any():
            points, vectors = surface_points(mesh.nodes, replace(surface, facets=surface.facets[new]))
            offsets = true_surface(points, vectors, surface.shape)[0] - points
            volumes.append(-np.einsum("...i,...i->...", offsets, vectors).ravel())
            positions.append((points + 0.5 * offsets).reshape(-1, 3))
    excess, x = np.concatenate(volumes), np.concatenate(positions)
    if not excess.any():
        return ShapeErrors(0.0, 0.0)
    properties = mass_properties(mesh, 1.0)
    moments, axes = np.linalg.eigh(properties.inertia)
    along = ((x - properties.centre) @ axes) ** 2
    changes = excess @ (along.sum(axis=1)[:, None] - along) / moments
    shift = (
        np.linalg.norm(excess @ (x - properties.centre))
        / properties.mass
        / np.sqrt(moments.sum() / (2 * properties.mass))
    )
    return ShapeErrors(float(excess.sum()) / properties.mass, max(float(np.abs(changes).max()), float(shift)))


def surface_weights(
    mesh: MeshRecord, surface: Surface, *, bearing: bool = False
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the nodes of a surface (k,), ∫ N dA of each [m^2] (k,) and ∫ N n dA of each [m^2] (k, 3), n outward.

    Args:
        bearing: Of contact points alone: corners of quadratic facets give their weights to the mid-side nodes.
    """
    if surface.areas is not None:
        normals = 0.0 if surface.normals is None else surface.normals
        return (
            surface.facets.ravel(),
            surface.areas,
            surface.areas[:, None] * np.broadcast_to(normals, (len(surface.areas), 3)),
        )
    numbers, weights = [], []
    for facets in facet_points(mesh.nodes, surface):
        areas = np.einsum("aq,fq->fa", facets.N, np.linalg.norm(facets.vectors, axis=2))
        vectors = np.einsum("aq,fqi->fai", facets.N, facets.vectors)
        local, cell = np.concatenate([areas[:, :, None], vectors], axis=2), FACETS.get(facets.nodes.shape[1])
        columns = slice(None)
        if bearing and cell is not None:
            columns = _bearing(cell)
            if cell is QUADRANGLE8:
                local[:, 4:] += 0.5 * (local[:, :4] + np.roll(local[:, :4], -1, axis=1))
        numbers.append(facets.nodes[:, columns].ravel())
        weights.append(local[:, columns].reshape(-1, 4))
    nodes, slot = np.unique(np.concatenate(numbers), return_inverse=True)
    summed = [np.bincount(slot, column, len(nodes)) for column in np.concatenate(weights).T]
    return nodes, summed[0], np.column_stack(summed[1:])


def _bearing(cell: Cell) -> slice:
    """Return the nodes of a facet that are contact points."""
    return slice(cell.shape.corners, None) if cell in (TRIANGLE6, QUADRANGLE8) else slice(None)


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
