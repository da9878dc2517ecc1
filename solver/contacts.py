"""The rows of one contact: where points are, how their gaps move, and what another body's surface adds."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from modaldb.schema import InterfaceModes, TractionModes
from modaldb.traction import along_direction, chart_coordinates, inside, spline_weights
from solver.body import FlexibleBody
from solver.errors import SceneError
from solver.obstacles import Bore, Plane
from solver.scene import Contact, MasterSurface, Scene

FACING = 0.99
"""Cosine between a surface's normal and the line to its obstacle, below which rows along the normal mislead."""


@dataclass(frozen=True)
class ContactBlock:
    """One contact's rows on the body that has the points, c of them."""

    name: str
    body: str
    interface: str
    rows: np.ndarray
    """∂g/∂q over the body's own coordinates, (c, r + m)."""
    gap: np.ndarray
    residual: np.ndarray
    """R [m/N], (c, c)."""
    layer: np.ndarray
    """Compliance of the surface layer [m/N], (c,)."""
    dashpot: np.ndarray
    points: np.ndarray
    directions: np.ndarray
    areas: np.ndarray | None
    edge: np.ndarray


@dataclass(frozen=True)
class SlidingBlock:
    """What the traction space of another body adds to one contact: F functions in the order along, across."""

    body: str
    interface: str
    rows: np.ndarray
    """Inward displacement ∂e/∂q over the master's own coordinates, (F, r + m)."""
    residual: np.ndarray
    """R [m/N], (F, F)."""
    order: np.ndarray
    """Number of each function in the record, (F,)."""
    counts: tuple[int, int]
    """Functions across and along."""
    chart: np.ndarray
    """Start and spacing along [m], (2,)."""
    place: np.ndarray
    """First function across of each point, −1 for points beside the space, (c,)."""
    across: np.ndarray
    """Spline values across, (c, 4)."""
    height: np.ndarray
    """Coordinate along of each point at rest [m], (c,)."""
    direction: np.ndarray
    """Along, (3,)."""
    resultant: np.ndarray
    """Force and moment about the component's origin of each unit traction along the outward normal, (F, 6)."""


@dataclass(frozen=True)
class ContactRows:
    """One contact's rows in the system."""

    name: str
    body: str
    interface: str
    rows: slice
    points: np.ndarray
    """[m], (c, 3), in the body's design position."""
    directions: np.ndarray
    """Direction of the force on the body, (c, 3)."""
    areas: np.ndarray | None
    edge: np.ndarray
    master: SlidingBlock | None
    functions: slice
    """Of its traction space among all functions."""


def contact_block(scene: Scene, name: str, body: FlexibleBody, master: FlexibleBody | None) -> ContactBlock:
    """Build the rows of a contact.

    Raises:
        SceneError: an interface or R is missing, the obstacle does not face its surface, or points start inside it.
    """
    contact = scene.contact[name]
    interface = _points(contact, name, body)
    points = body.morph.points[contact.interface]
    placed = points + np.asarray(scene.body[body.name].position)
    obstacle = contact.against
    if isinstance(obstacle, MasterSurface):
        assert master is not None
        obstacle = basic_surface(_space(obstacle, name, master).chart, np.asarray(scene.body[master.name].position))
    directions = obstacle.direction(placed)
    if np.einsum("ci,ci->c", directions, -interface.normals).min() < FACING:
        raise SceneError(f"contact.{name}.against: the obstacle does not face interface '{contact.interface}'")
    gap = obstacle.gap(placed)
    if gap.min() < 0:
        raise SceneError(
            f"contact.{name}: {int((gap < 0).sum())} of {len(gap)} points start inside the obstacle, the worst by"
            f" {-gap.min():.3g} m; move body.{body.name}.position or widen contact.{name}.against"
        )
    rows = np.column_stack([body.rigid_rows(points, directions), -interface.rows])
    areas = interface.areas if contact.surface_stiffness is not None else None
    residual = _residual(contact, name, body)
    layer = np.zeros(len(gap))
    if contact.surface_stiffness is not None:
        layer = 1.0 / (contact.surface_stiffness * interface.areas)
    return ContactBlock(
        name, body.name, contact.interface, rows, gap, residual, layer,
        _dashpot(contact, name, body, residual + np.diag(layer)), points, directions, areas, interface.edge,
    )  # fmt: skip


def sliding_block(scene: Scene, name: str, block: ContactBlock, master: FlexibleBody) -> SlidingBlock:
    """Build what a contact's points slide over.

    Raises:
        SceneError: the master has no such traction space, or all points lie beside it.
    """
    against = scene.contact[name].against
    assert isinstance(against, MasterSurface)
    space = _space(against, name, master)
    placed = block.points + np.asarray(scene.body[block.body].position) - np.asarray(scene.body[master.name].position)
    coordinates = chart_coordinates(space.chart, placed)
    middle = np.column_stack([coordinates[:, 0], np.full(len(placed), space.start[1])])
    beside = ~inside(space, middle)
    if beside.all():
        raise SceneError(f"contact.{name}.against: no point of '{block.interface}' faces '{against.interface}'")
    across, along = (int(count) for count in space.counts)
    numbers, values = spline_weights(space, middle)
    # At the start along, the first of the four splines is 1/6: what stands beside it are the values across.
    first = numbers[:, 0] // along
    weights = values.reshape(-1, 4, 4)[:, :, 0] * 6
    order = np.arange(across * along).reshape(across, along).T.ravel()
    outward = np.column_stack([master.wrench_rows(space.resultant), space.rows])
    residual = master.residual(against.interface, against.interface)
    if scene.contact[name].method == "penalty":
        residual = np.zeros_like(residual)
    return SlidingBlock(
        master.name, against.interface, -outward[order], residual[np.ix_(order, order)], order, (across, along),
        np.array([space.start[1], space.spacing[1]]), np.where(beside, -1, first), weights, coordinates[:, 1],
        along_direction(space.chart), space.resultant[order],
    )  # fmt: skip


def _points(contact: Contact, name: str, body: FlexibleBody) -> InterfaceModes:
    if contact.interface not in body.modal.interfaces:
        have = ", ".join(sorted(body.modal.interfaces)) or "none"
        raise SceneError(f"contact.{name}.interface: body '{body.name}' has no '{contact.interface}', it has {have}")
    return body.modal.interfaces[contact.interface]


def _space(against: MasterSurface, name: str, master: FlexibleBody) -> TractionModes:
    if against.interface not in master.modal.tractions:
        have = ", ".join(sorted(master.modal.tractions)) or "none"
        raise SceneError(
            f"contact.{name}.against.interface: body '{master.name}' has no traction space '{against.interface}',"
            f" it has {have}"
        )
    return master.modal.tractions[against.interface]


def basic_surface(chart: Mapping[str, Any], position: np.ndarray) -> Bore | Plane:
    """Return the undeformed surface of a traction space's chart on a body that stands at `position` [m], (3,)."""
    origin = tuple(np.asarray(chart["origin"], float) + position)
    if chart["kind"] == "plane":
        return Plane(shape="plane", point=origin, normal=tuple(chart["normal"]))
    return Bore(shape="bore", radius=chart["radius"], axis=tuple(chart["axis"]), origin=origin)


def _residual(contact: Contact, name: str, body: FlexibleBody) -> np.ndarray:
    if contact.method == "residual":
        if body.modal.residual_flexibility is None:
            if body.modal.recipe != "rigid":
                raise SceneError(
                    f"contact.{name}.method: 'residual' needs a recipe that stores R, component"
                    f" '{body.name}' was reduced by '{body.modal.recipe}'"
                )
            if contact.surface_stiffness is None:
                raise SceneError(f"contact.{name}.surface_stiffness: is missing; a rigid body needs it to be pressed")
        return body.residual(contact.interface, contact.interface)
    return np.zeros((len(body.morph.points[contact.interface]),) * 2)


def _dashpot(contact: Contact, name: str, body: FlexibleBody, compliance: np.ndarray) -> np.ndarray:
    """Impedance of the truncated waves: d = (2/π)/(R ω_N), which is ρcA on a uniform bar."""
    if contact.dashpot == "none":
        return np.zeros(len(compliance))
    if len(compliance) > 1:
        raise SceneError(f"contact.{name}.dashpot: 'wave-guide' is for single-point contacts on bars, not surfaces")
    return np.array([2 / np.pi / (compliance[0, 0] * body.modal.angular_frequencies.max())])
