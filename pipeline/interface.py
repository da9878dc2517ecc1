"""Where a component is touched or loaded, and the contact points of a named surface.

On quadratic triangles the consistent weight of a corner is zero, so contact lives on mid-side nodes: a uniform
pressure p gives each the force p·a, a = Σ ∫ N dA over its facets. On the edges of plane parts corners have a sixth of
an edge each, and all nodes are contact points.
"""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from modaldb.schema import MeshRecord, Surface
from modaldb.traction import cross_axes
from pipeline.errors import InputError
from pipeline.settings import is_absent

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Span = tuple[Finite, Finite]
ON_A_LINE = 1e-6
"""Extent of points across a line over that along it: below, they have one coordinate only."""


def _pair(value: Any) -> Any:
    return (value, value) if isinstance(value, int | float) and not isinstance(value, bool) else value


class Interface(BaseModel):
    """Where a component may be touched or loaded."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    surface: str = Field(description="Name of a surface of the mesh")
    kind: Literal["points", "traction", "mean", "pressure", "patch", "tie"] = Field(
        default="points",
        description="points: contact points; traction: smooth tractions for points of another body that slide over"
        " the surface; mean: the mean displacement of the surface, for joints and forces; pressure: a uniform pressure;"
        " patch: one contact row, the mean normal displacement of a flat surface; tie: the surface hangs on a reference"
        " point, see tie",
    )
    sector_deg: Span | None = Field(
        default=None, description="Only what lies between two angles [deg]; a traction space on a cylinder needs it"
    )
    height: Span | None = Field(default=None, description="Only what lies between two heights along the axis [m]")
    spacing: Annotated[tuple[Positive, Positive], BeforeValidator(_pair)] | None = Field(
        default=None,
        description="Largest knot spacing of a traction space across and along [m], or one number for both",
    )
    along: tuple[Finite, Finite, Finite] | None = Field(
        default=None, description="Direction in which bodies slide over a traction space on a plane"
    )
    extent: tuple[Span, Span] | None = Field(
        default=None,
        description="Least and largest coordinate of a traction space on a plane, across and along, from the plane's"
        " origin [m]; all of the surface by default",
    )
    tie: Literal["rbe2", "rbe3"] | None = Field(
        default=None,
        exclude_if=is_absent,
        description="How a surface hangs on its reference point. rbe2: it moves as a rigid body with the point; rbe3:"
        " the point moves as the surface does on the mean, which stays as flexible as it is",
    )
    point: tuple[Finite, Finite, Finite] | None = Field(
        default=None,
        exclude_if=is_absent,
        description="Reference point of a tie [m]; the surface's centroid by default",
    )

    @model_validator(mode="after")
    def _consistent(self) -> "Interface":
        spans = [("sector_deg", self.sector_deg), ("height", self.height)]
        spans += [("extent", span) for span in self.extent or ()]
        for name, span in spans:
            if span is not None and span[0] >= span[1]:
                raise ValueError(f"{name} is {list(span)}, the first value must be below the second")
        if self.kind == "traction" and self.spacing is None:
            raise ValueError("kind 'traction' needs spacing [m]")
        for name in ("spacing", "along", "extent"):
            if self.kind != "traction" and getattr(self, name) is not None:
                raise ValueError(f"{name} is for kind 'traction', the kind is '{self.kind}'")
        if self.kind == "tie" and self.tie is None:
            raise ValueError("kind 'tie' needs tie, 'rbe2' or 'rbe3'")
        for name in ("tie", "point"):
            if self.kind != "tie" and getattr(self, name) is not None:
                raise ValueError(f"{name} is for kind 'tie', the kind is '{self.kind}'")
        for name in ("sector_deg", "height"):
            if self.kind in ("mean", "pressure", "patch", "tie") and getattr(self, name) is not None:
                raise ValueError(f"{name} is for kinds 'points' and 'traction', '{self.kind}' takes the whole surface")
        return self


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


def cylindrical(points: np.ndarray, shape: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return radius [m], angle [rad] and height [m] of points (k, 3) about a shape's axis.

    The angle is counted from the x axis (from z, if the axis is x) by the right hand.
    """
    axis = np.asarray(shape["axis"], float)
    axis = axis / np.linalg.norm(axis)
    first, second = cross_axes(axis)
    arm = points - np.asarray(shape["origin"], float)
    a, b = arm @ first, arm @ second
    return np.hypot(a, b), np.arctan2(b, a), arm @ axis


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


def radial_directions(points: np.ndarray, shape: dict[str, Any]) -> np.ndarray:
    """Return unit vectors (k, 3) from a shape's axis to the points."""
    axis = np.asarray(shape["axis"], float)
    axis = axis / np.linalg.norm(axis)
    arm = points - np.asarray(shape["origin"], float)
    radial = arm - np.outer(arm @ axis, axis)
    return radial / np.linalg.norm(radial, axis=1, keepdims=True)


def true_surface(points: np.ndarray, outward: np.ndarray, shape: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Move points (k, 3) onto a surface's true shape and return them with its normals on the `outward` side.

    Nodes of a surface that a profile moved stand on their true surface already.
    """
    origin = np.asarray(shape["origin"], float)
    if shape["kind"] == "plane":
        normal = np.asarray(shape["normal"], float) / np.linalg.norm(shape["normal"])
        moved = points - np.outer((points - origin) @ normal, normal)
        normals = np.broadcast_to(normal, points.shape).copy()
    elif shape["kind"] == "sphere":
        normals = (points - origin) / np.linalg.norm(points - origin, axis=1, keepdims=True)
        moved = origin + shape["radius"] * normals
    else:
        radial = radial_directions(points, shape)
        radius, _, _ = cylindrical(points, shape)
        moved = points if shape.get("profiled") else points + radial * (shape["radius"] - radius)[:, None]
        normals = radial
    side = np.sign(np.einsum("ki,ki->k", normals, outward))
    return moved, normals * side[:, None]


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
