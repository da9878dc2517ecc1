"""What the points of a contact meet on another body: points of an equal mesh, or facets of any."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.modes import InterfaceModes
from gudgeon.solver.bodies.small_motion import FlexibleBody, named
from gudgeon.solver.contact.edges import Edges, are_edges, paired_edges
from gudgeon.solver.contact.facets import Facets, Pairing, paired
from gudgeon.solver.contact.shares import chosen, shared
from gudgeon.solver.errors import SceneError
from gudgeon.solver.scene.contact import OtherBody
from gudgeon.solver.scene.scene import Scene

ASIDE = 0.02
"""Largest offset of paired points across the normal, relative to their gap and to the size of the bodies."""
OPPOSITE = 0.99
"""Least cosine between the normal of a point and that against the normal of the point that it is paired with."""
MATCHING = 1e-6
"""Offset of points of two facetted surfaces, relative to the size of the bodies, below which their meshes match."""
ROUND_OFF = 1e-9
"""Offset relative to the points' coordinates that is round-off."""
SLIVER = 1e-6
"""Least part of a point's area that meets another surface."""
MISSES = 1e3
"""Gap of points that meet nothing, over the size of the bodies."""


@dataclass(frozen=True)
class OtherBlock:
    """The other body of a contact, its points in the order of the first's."""

    body: str
    interface: str
    rows: np.ndarray
    """∂g/∂q over its own coordinates, (c, r + m)."""
    tangents: np.ndarray
    """(c, r + m)"""
    points: np.ndarray
    """Where the forces act on it, in its design position [m], (c, 3)."""
    share: sparse.csr_matrix
    """Of the k points of the record in each, (c, k)."""
    areas: np.ndarray | None = None
    """Of the points, by what of their facets the other body covers [m^2], (c,); None where facets are not cut."""
    met: tuple[float, float] = (0.0, 0.0)
    """Area of the points that meet the other body, and what it covers of all facets [m^2]; 0 where none is cut."""


def faced(
    scene: Scene, name: str, sides: tuple[FlexibleBody, FlexibleBody], placed: np.ndarray
) -> tuple[OtherBlock, np.ndarray]:
    """Return what the points of a contact meet on the other body, and the gaps to it [m], (c,).

    Args:
        sides: The body of the contact, and the other one.
        placed: The points in the scene [m], (c, 3).

    Raises:
        SceneError: the interfaces neither pair nor have facets, or do not face each other.
    """
    contact, (body, master) = scene.contact[name], sides
    against = contact.against
    assert isinstance(against, OtherBody)
    interface = named(
        master.modal.interfaces, against.interface, f"contact.{name}.against.interface: body '{master.name}' has no"
    )
    surface, points = body.modal.interfaces[contact.interface], master.morph.points[against.interface]
    there = points + np.asarray(scene.body[master.name].position)
    if master is body:
        both = (placed, surface.normals), (there, interface.normals)
        _refuse_neighbours(name, contact.interface, against.interface, *both)
    position = np.asarray(scene.body[body.name].position)
    radius = max(_reach(body, placed - position), _reach(master, points))
    facets = [s.facets is not None and len(s.facets) > 0 for s in (surface, interface)]
    if len(there) == len(placed):
        order, gap, beside = _facing(placed, surface.normals, there)
        single = len(set(order.tolist())) == len(order)
        if not all(facets) or (single and beside.max() <= MATCHING * radius):
            _refuse_apart(scene, name, (surface, interface), (order, gap, beside), (placed, radius))
            rows = np.column_stack([master.rigid_rows(points[order], surface.normals), -interface.rows[order]])
            weights = chosen(order, len(points))
            return OtherBlock(master.name, against.interface, rows, np.zeros_like(rows), points[order], weights), gap
    if not all(facets):
        raise SceneError(_unpaired(scene, name, (surface, interface), (len(placed), len(there))))
    return _on_facets(scene, name, (surface, interface), master, (placed, radius))


def _refuse_neighbours(name: str, near_name: str, far_name: str, *surfaces: tuple[np.ndarray, np.ndarray]) -> None:
    """Raise a SceneError where two surfaces of a body, points and normals, (c, 3) each, share points: are one skin."""
    (placed, normals), (there, facing) = surfaces
    nearest = _nearest(there, placed)
    same = np.linalg.norm(there[nearest] - placed, axis=1) <= MATCHING * float(np.ptp(placed, axis=0).max())
    shared_points = same & (np.einsum("ci,ci->c", facing[nearest], normals) > -OPPOSITE)
    if shared_points.any():
        raise SceneError(
            f"contact.{name}.against.interface: '{far_name}' shares {int(shared_points.sum())} points with"
            f" '{near_name}', so that they are one skin of the body; a body meets itself where two surfaces face each"
            " other"
        )


def _nearest(points: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Return which of some points (k, 3) is nearest to each place (n, 3), (n,)."""
    if not len(targets):
        return np.empty(0, np.int64)
    from scipy.spatial import (
        KDTree,
    )  # Late: surfaces that cover each other need none, and it takes a tenth of a second.

    return KDTree(points).query(targets)[1].astype(np.int64)


def _on_facets(
    scene: Scene,
    name: str,
    surfaces: tuple[InterfaceModes, InterfaceModes],
    master: FlexibleBody,
    placement: tuple[np.ndarray, float],
) -> tuple[OtherBlock, np.ndarray]:
    """Return what points meet on the facets of the other body; place: the points in the scene, and the bodies' size."""
    against, (near_surface, interface), (placed, radius) = scene.contact[name].against, surfaces, placement
    assert isinstance(against, OtherBody)
    position, points = np.asarray(scene.body[master.name].position), master.morph.points[against.interface]
    sides = [(_numbers(s, name), x, s.normals) for s, x in ((near_surface, placed), (interface, points + position))]
    flat = [are_edges(*side) for side in sides]
    if flat[0] != flat[1]:
        raise SceneError(f"contact.{name}.against: a plane part and a solid have no facets that meet")
    pairing = (
        paired_edges(*(Edges(*side) for side in sides)) if flat[0] else paired(*(Facets.of(*side) for side in sides))
    )
    if not pairing.meets.any():
        raise SceneError(
            f"contact.{name}.against: interface '{against.interface}' does not face"
            f" '{scene.contact[name].interface}': no outward normal of a point of one meets the other"
        )
    # Points that meet nothing cannot close, whatever they are a share of.
    missed = np.flatnonzero(~pairing.meets)
    nearest = _nearest(points + position, placed[missed])
    spare = sparse.csr_matrix((np.ones(len(missed)), (missed, nearest)), pairing.weights.shape)
    weights = sparse.csr_matrix(pairing.weights + spare)
    gap = np.where(pairing.meets, pairing.gap, MISSES * radius)
    foot = placed - position + np.where(pairing.meets, pairing.gap, 0.0)[:, None] * near_surface.normals
    rows = np.column_stack([master.rigid_rows(foot, near_surface.normals), -shared(weights, interface.rows)])
    areas, met = _shared_areas(pairing, near_surface.areas)
    return (
        OtherBlock(master.name, against.interface, rows, np.zeros_like(rows), foot, weights, areas=areas, met=met),
        gap,
    )


def _shared_areas(pairing: Pairing, point_areas: np.ndarray) -> tuple[np.ndarray | None, tuple[float, float]]:
    """Return the areas of points that meet another surface, in sum what it covers [m^2], (c,), and `OtherBlock.met`.

    What is covered of facets whose points meet nothing counts to those that do, which carry its force.
    """
    meets = pairing.meets
    if pairing.areas is None or not pairing.areas[meets].any():
        return None, (0.0, 0.0)
    covered = np.where(meets, pairing.areas, 0.0)
    areas = covered * float(pairing.areas.sum() / covered.sum())
    # Those of points that meet nothing carry no force, and no share of a law.
    return np.maximum(areas, SLIVER * point_areas), (
        float(point_areas[meets].sum()),
        float(pairing.areas.sum()),
    )


def _numbers(surface: InterfaceModes, name: str) -> np.ndarray:
    """Return the points of each facet, (f, 3); a SceneError where a number is no point's."""
    assert surface.facets is not None
    if surface.facets.min() < 0 or surface.facets.max() >= len(surface.normals):
        raise SceneError(f"contact.{name}: facets of an interface name points that it does not have; make modes anew")
    return surface.facets


def _unpaired(scene: Scene, name: str, surfaces: tuple[InterfaceModes, InterfaceModes], counts: tuple[int, int]) -> str:
    """Return the complaint about interfaces of which one has no facets; counts: of their points."""
    contact = scene.contact[name]
    assert isinstance(contact.against, OtherBody)
    bodies = (contact.body, contact.interface), (contact.against.body, contact.against.interface)
    body, interface = next(
        who for who, surface in zip(bodies, surfaces, strict=True) if surface.facets is None or not len(surface.facets)
    )
    return (
        f"contact.{name}.against.interface: has {counts[1]} points, {counts[0]} face them; the numbers must be equal,"
        f" since interface '{interface}' of body '{body}' has no facets, as points of rigid bodies have none; let these"
        " meet an interface of kind 'patch', or of kind 'traction' with shape = 'surface'; points of a named surface of"
        " a mesh have facets, with modes that `gudgeon modes SCENE` makes"
    )


def _refuse_apart(
    scene: Scene,
    name: str,
    surfaces: tuple[InterfaceModes, InterfaceModes],
    facing: tuple[np.ndarray, np.ndarray, np.ndarray],
    placement: tuple[np.ndarray, float],
) -> None:
    """Refuse points that do not pair one by one.

    Args:
        facing: Order, gap and offset of `_facing`.
        placement: The points in the scene [m], and the size of the bodies.

    Raises:
        SceneError: two face the same, they do not face each other, or are offset across the normal.
    """
    contact, (surface, interface), (order, gap, beside), (placed, radius) = (
        scene.contact[name],
        surfaces,
        facing,
        placement,
    )
    against, key = contact.against, f"contact.{name}.against"
    assert isinstance(against, OtherBody)
    if len(set(order.tolist())) < len(order):
        raise SceneError(f"{key}.interface: two points face the same point; mesh both faces alike, or use a 'patch'")
    if np.einsum("ci,ci->c", interface.normals[order], surface.normals).max() > -OPPOSITE:
        raise SceneError(f"{key}: interface '{against.interface}' does not face '{contact.interface}'")
    tolerance = ASIDE * max(float(np.abs(gap).max()), radius)
    if beside.max() > tolerance + ROUND_OFF * float(np.abs(placed).max()):
        raise SceneError(
            f"{key}: the points are offset by {beside.max():.3g} m across the contact normal; a contact of two bodies"
            " acts along the line through its points, so move the bodies or their interfaces"
            + (", or use interfaces of kind 'points', which press where they meet" if len(placed) == 1 else "")
        )


def _reach(body: FlexibleBody, points: np.ndarray) -> float:
    """Return the largest distance of points from a body's centre of mass [m]."""
    return float(np.linalg.norm(points - body.morph.centre, axis=1).max())


def _facing(placed: np.ndarray, normals: np.ndarray, there: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the number of the point of another body that faces each point, their gap and their offset [m], (c,) each.

    Args:
        placed: Points [m], (c, 3).
        normals: Their outward normals, (c, 3).
        there: Points of the other body [m], (k, 3).
    """
    far = there[None] - placed[:, None]
    along = np.einsum("abi,ai->ab", far, normals)
    aside = np.linalg.norm(far - along[..., None] * normals[:, None], axis=2)
    order = aside.argmin(axis=1)
    rows = np.arange(len(placed))
    return order, along[rows, order], aside[rows, order]
