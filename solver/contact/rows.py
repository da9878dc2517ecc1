"""The rows of one contact: its points, their gaps, and their displacement per coordinate of its bodies."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.modes import InterfaceModes, TractionModes
from gudgeon.modaldb.records.traction import along_direction, chart_coordinates, cubic_weights, inside, spline_weights
from gudgeon.modaldb.records.types import Json
from gudgeon.solver.bodies.slanting import FACING
from gudgeon.solver.bodies.small_motion import FlexibleBody, named
from gudgeon.solver.contact.missing_compliance import Side, check_compliance
from gudgeon.solver.contact.pairs import OtherBlock, faced
from gudgeon.solver.contact.shares import identity, shared_columns, shared_twice
from gudgeon.solver.errors import SceneError
from gudgeon.solver.methods import METHODS, RIGID_NEEDS
from gudgeon.solver.obstacles import Plane, basic_surface
from gudgeon.solver.scene.contact import Contact, MasterSurface, OtherBody
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.vectors import unit

TOUCHING = 1e-9
"""Depth relative to the size of the points' coordinates up to which points touch and do not penetrate."""
PER_ROW = {"gap": (), "layer": (), "dashpot": (), "restitution": (), "law": (4,), "friction": (2,), "belt": ()}
"""Shape of the entry per contact row of the arrays of `System` that every contact contributes to."""


@dataclass(frozen=True)
class ContactPoints:
    """The c points of one contact, on the first of its bodies."""

    name: str
    body: str
    interface: str
    points: np.ndarray
    """In the body's design position [m], (c, 3)."""
    directions: np.ndarray
    """Direction of the force on the body, (c, 3)."""
    areas: np.ndarray | None
    edge: np.ndarray
    other: OtherBlock | None
    adjusted: np.ndarray
    """How far each was moved onto what it touches at the start, with `adjust` [m], (c,)."""


@dataclass(frozen=True)
class ContactBlock(ContactPoints):
    """One contact's rows over the coordinates of its bodies."""

    rows: np.ndarray
    """∂g/∂q over the body's own coordinates, (c, r + m)."""
    tangents: np.ndarray
    """Displacement along the line of friction over the body's own coordinates, (c, r + m)."""
    residual: np.ndarray
    """R [m/N], (c, c)."""
    per_row: dict[str, np.ndarray]
    """The arrays of `System` with one entry per row: those in `PER_ROW`."""


@dataclass(frozen=True)
class SlidingBlock:
    """The traction space of another body in one contact: F functions in the order along, across."""

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
    tangential: np.ndarray | None
    """The same of each along `direction` and along normal × direction, (F, 2, 6); None without friction."""

    def at_points(self, slid: float, values: np.ndarray) -> np.ndarray:
        """Return a field [m] of the functions, (F,), at points that slid along [m], (c,); ∞ beside the space."""
        numbers, weights, beside = self.weights(slid)
        return np.where(beside, np.inf, (weights * values[numbers]).sum(axis=(1, 2)))

    def weights(self, slid: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the functions that points touch, slid along [m], their weights, (c, 4, 4), and which are beside."""
        columns, lines = self.counts
        coordinate = (self.height + slid - self.chart[0]) / self.chart[1]
        line = np.clip(np.floor(coordinate), 0, lines - 4)
        weights = np.einsum("cb,ca->cba", cubic_weights(coordinate - line), self.across)
        corner = np.maximum(self.place, 0) + line.astype(int) * columns
        numbers = corner[:, None, None] + columns * np.arange(4)[:, None] + np.arange(4)
        return numbers, weights, (self.place < 0) | (coordinate < -1e-9) | (coordinate > lines - 3 + 1e-9)


@dataclass(frozen=True)
class ContactRows(ContactPoints):
    """One contact's place in the system."""

    rows: slice
    master: SlidingBlock | None
    functions: slice
    """Of its traction space among all functions."""

    @property
    def sides(self) -> list[tuple[str, str, sparse.csr_matrix, np.ndarray, float]]:
        """Body, interface, shares of the record's points, points, and sign of the force, of each side with points.

        Each of the c points moves as the sum of its shares of the k points of the interface, (c, k).
        """
        sides = [(self.body, self.interface, identity(len(self.points)), self.points, 1.0)]
        if (partner := self.other) is not None:
            sides.append((partner.body, partner.interface, partner.share, partner.points, -1.0))
        return sides


def contact_block(scene: Scene, name: str, body: FlexibleBody, master: FlexibleBody | None) -> ContactBlock:
    """Build the rows of a contact.

    Raises:
        SceneError: an interface or R is missing, the obstacle does not face its surface, or points start inside it.
    """
    contact = scene.contact[name]
    interface = _points(contact.interface, f"contact.{name}.interface", body)
    points = body.morph.points[contact.interface]
    position = np.asarray(scene.body[body.name].position)
    placed, obstacle, partner = points + position, contact.against, None
    if isinstance(obstacle, OtherBody):
        assert master is not None
        directions = -interface.normals
        partner, gap = faced(scene, name, (body, master), placed)
    else:
        if isinstance(obstacle, MasterSurface):
            assert master is not None
            origin, chart = np.asarray(scene.body[master.name].position), _space(obstacle, name, master).chart
            if not scene.capabilities.turns:
                obstacle = basic_surface(_sliding_chart(chart, name), origin)
        if isinstance(obstacle, MasterSurface):  # Where its points meet it, the integrator finds.
            directions, gap = -interface.normals, np.zeros(len(placed))
        else:
            directions, gap = obstacle.direction(placed), obstacle.gap(placed)
        if not scene.capabilities.turns:  # Bodies that turn may come to face it.
            _check_facing(name, contact.interface, placed, np.einsum("ci,ci->c", directions, -interface.normals))
    gap = _without_round_off(gap, touching_depth(placed, position))
    adjusted = np.maximum(-gap, 0.0) if contact.adjust else np.zeros(len(gap))
    if isinstance(obstacle, Plane):
        adjusted[obstacle.beside(placed)] = 0.0
    gap = gap + adjusted
    rows = np.column_stack([body.rigid_rows(points, directions), -interface.rows])
    residual = _residual(contact, name, body, contact.interface)
    if partner is not None and master is not None:
        residual = residual + _beyond(contact, name, (body, master), partner)
        if contact.friction is not None:
            partner = replace(partner, tangents=-_tangents(contact, name, master, partner.interface, partner.points))
    areas = interface.areas if partner is None or partner.areas is None else partner.areas
    layer = np.zeros(len(gap))
    if contact.surface_stiffness is not None:
        layer = 1.0 / (contact.surface_stiffness * areas)
    elif contact.law is not None and contact.law.kind == "linear":
        layer = 1.0 / np.array([point.stiffness for point in contact.law.of_points(areas.tolist())])
    sides = [Side(body, contact.interface, identity(len(gap)), placed)]
    if partner is not None and master is not None:
        sides.append(Side(master, partner.interface, partner.share, placed))
    check_compliance(scene, name, sides, master, residual.diagonal(), layer)
    per_row = _surface(contact, len(gap), areas) | {
        "gap": gap,
        "layer": layer,
        "dashpot": _dashpot(contact, name, (body, master), (len(gap), areas)),
    }
    return ContactBlock(
        name=name, body=body.name, interface=contact.interface, points=points, directions=directions,
        areas=_areas(contact, areas), edge=interface.edge, other=partner,
        adjusted=adjusted,
        rows=rows, tangents=_tangents(contact, name, body, contact.interface, points), residual=residual,
        per_row=per_row,
    )  # fmt: skip


def _areas(contact: Contact, areas: np.ndarray) -> np.ndarray | None:
    """Return the areas that make pressures of forces [m^2], (c,): of layers, wear, several points on another body."""
    several = isinstance(contact.against, OtherBody) and len(areas) > 1
    needed = several or contact.wear is not None or contact.surface_stiffness is not None
    return areas if needed else None


def _check_facing(name: str, interface: str, placed: np.ndarray, cosines: np.ndarray) -> None:
    """Raise a SceneError for points [m], (c, 3), whose normals do not lead to the obstacle; cosines of the angle, (c,).

    Gaps are those in small motion, of points that stay before the obstacle.
    """
    away = np.flatnonzero(cosines < FACING)
    if not len(away):
        return
    worst, allowed = (np.degrees(np.arccos(np.clip(c, -1.0, 1.0))) for c in (cosines.min(), FACING))
    text = f"contact.{name}.against: the obstacle does not face interface '{interface}'"
    if len(away) == len(cosines):
        raise SceneError(
            f"{text}: its normals are up to {worst:.0f} degrees from the direction to it; allowed: {allowed:.0f};"
            " turn the body, or give what strikes a narrow surface that faces the obstacle (the bevel of an edge, the"
            " cap of a sphere); in integrator 'turning' a contact law meets planes at any angle"
        )
    x, y, z = placed[int(cosines.argmin())]
    raise SceneError(
        f"{text}: at {len(away)} of {len(cosines)} points the normal is more than {allowed:.0f} degrees from the"
        f" direction to it, {worst:.0f} at ({x:.4g}, {y:.4g}, {z:.4g}) m; leave these points out of the interface, by a"
        " smaller surface (such as the cap of a sphere), height or sector_deg"
    )


def touching_depth(placed: np.ndarray, position: np.ndarray | float = 0.0) -> float:
    """Return the depth up to which points touch and do not penetrate [m].

    Args:
        placed: Their places [m], (c, 3).
        position: Of their body [m], (3,): places near the scene's origin have the round-off of both that cancel.
    """
    largest = max(float(np.abs(placed).max()), float(np.abs(position).max()))
    return TOUCHING * max(largest, float(np.ptp(placed, axis=0).max()))


def _without_round_off(gap: np.ndarray, allowed: float) -> np.ndarray:
    """Return gaps [m], (c,), zero where they are negative by no more than is allowed [m]: round-off of places."""
    return np.where((gap < 0) & (gap >= -allowed), 0.0, gap)


def _surface(contact: Contact, c: int, areas: np.ndarray) -> dict[str, np.ndarray]:
    """Return restitution, law, friction coefficients and belt velocity of c points, see `System`.

    Args:
        areas: Of the points [m^2], (c,), which laws read.
    """
    law, friction, belt = np.zeros((c, 4)), np.zeros((c, 2)), np.zeros(c)
    if contact.law is not None:
        law[:] = contact.law.of_points(areas.tolist())
    if contact.friction is not None:
        friction[:] = contact.friction.static, contact.friction.sliding
        if contact.friction.direction is not None:
            velocity = np.asarray(getattr(contact.against, "velocity", (0.0, 0.0, 0.0)))
            belt[:] = unit(contact.friction.direction) @ velocity
    restitution = np.full(c, (contact.restitution or 0.0) if METHODS[contact.method].rigid else -1.0)
    return {"restitution": restitution, "law": law, "friction": friction, "belt": belt}


def _tangents(contact: Contact, name: str, body: FlexibleBody, interface: str, points: np.ndarray) -> np.ndarray:
    """Return the displacement of points along the line of friction per coordinate, (c, r + m); zero without friction.

    Raises:
        SceneError: the body is elastic, or modes of an elastic body lack tangential rows.
    """
    size, friction = len(body.stiffness), contact.friction
    if friction is None:
        return np.zeros((len(points), size))
    body.contact_frame(interface)
    if friction.direction is None:
        return np.zeros((len(points), size))
    if size > body.rigid_count or not METHODS[contact.method].rigid:
        cause = f"body '{body.name}' is elastic" if size > body.rigid_count else f"its method is '{contact.method}'"
        raise SceneError(
            f"contact.{name}.friction.direction: {cause}, and friction along a line acts on rigid bodies in rigid"
            " contact; remove the direction, so that friction acts in the plane of contact"
        )
    return body.rigid_rows(points, np.broadcast_to(unit(friction.direction), points.shape))


def sliding_block(scene: Scene, name: str, block: ContactBlock, master: FlexibleBody) -> SlidingBlock:
    """Build the rows of the traction space over which a contact's points slide.

    Raises:
        SceneError: the master has no such traction space, or no point lies over it.
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
    # At the start along, the first of the four splines is 1/6: times 6, its products are the values across.
    corner = numbers[:, 0] // along
    weights = values.reshape(-1, 4, 4)[:, :, 0] * 6
    order = np.arange(across * along).reshape(across, along).T.ravel()
    outward = np.column_stack([master.wrench_rows(space.resultant), space.rows])
    residual = master.residual(against.interface, against.interface)
    if not METHODS[scene.contact[name].method].flexible:
        residual = np.zeros_like(residual)
    return SlidingBlock(
        body=master.name, interface=against.interface, rows=-outward[order], residual=residual[np.ix_(order, order)],
        order=order, counts=(across, along), chart=np.array([space.start[1], space.spacing[1]]),
        place=np.where(beside, -1, corner), across=weights, height=coordinates[:, 1],
        direction=along_direction(space.chart), resultant=space.resultant[order],
        tangential=_tangential(scene.contact[name], name, master, space, order),
    )  # fmt: skip


def _tangential(
    contact: Contact, name: str, master: FlexibleBody, space: TractionModes, order: np.ndarray
) -> np.ndarray | None:
    """Return the resultants of tractions across the normal in an order, (F, 2, 6); None without friction.

    Raises:
        SceneError: the record has no such tractions.
    """
    if contact.friction is None:
        return None
    if space.tangential_resultant is None:
        raise SceneError(
            f"contact.{name}.friction: the record of the modes of body '{master.name}',"
            f" {master.morph.modes_key[:12]}, has no tractions across the normal, since it was made for"
            " a scene without friction; `gudgeon modes SCENE` makes them"
        )
    return space.tangential_resultant[order]


def _points(interface: str, key: str, body: FlexibleBody) -> InterfaceModes:
    return named(body.modal.interfaces, interface, f"{key}: body '{body.name}' has no")


def _space(against: MasterSurface, name: str, master: FlexibleBody) -> TractionModes:
    owner = f"contact.{name}.against.interface: body '{master.name}' has no traction space"
    return named(master.modal.tractions, against.interface, owner)


def _sliding_chart(chart: Json, name: str) -> Json:
    """Return the chart of a traction space; raise a SceneError for a patch, which small motion does not follow."""
    if chart["kind"] == "patch":
        raise SceneError(
            f"contact.{name}.against.interface: it is a patch, which the normals of points follow by integrator"
            " 'turning' alone; set run.integrator to it, or slide over a plane or in a cylinder"
        )
    return chart


def _residual(contact: Contact, name: str, body: FlexibleBody, interface: str) -> np.ndarray:
    """Return R of a body's interface [m/N], (c, c); zero where the method does not use it."""
    if METHODS[contact.method].flexible:
        if body.modal.residual_flexibility is None:
            if body.modal.reduction != "rigid":
                raise SceneError(
                    f"contact.{name}.method: 'residual' needs a reduction that stores R, component"
                    f" '{body.name}' was reduced by '{body.modal.reduction}'"
                )
            if contact.surface_stiffness is None and contact.law is None and not isinstance(contact.against, OtherBody):
                raise SceneError(f"contact.{name}.surface_stiffness: is missing; {RIGID_NEEDS}")
        return body.residual(interface, interface)
    return np.zeros((len(body.morph.points[interface]),) * 2)


def _beyond(contact: Contact, name: str, bodies: tuple[FlexibleBody, FlexibleBody], partner: OtherBlock) -> np.ndarray:
    """Return R of the other side of a contact [m/N], (c, c); of one body on both sides with what couples them."""
    body, master = bodies
    there = _residual(contact, name, master, partner.interface)
    R = shared_twice(partner.share, there, partner.share)
    if master is body and METHODS[contact.method].flexible:
        between = shared_columns(partner.share, body.residual(contact.interface, partner.interface))
        R = R + between + between.T
    return R


def _dashpot(
    contact: Contact, name: str, bodies: tuple[FlexibleBody, FlexibleBody | None], points: tuple[int, np.ndarray]
) -> np.ndarray:
    """Impedance of the truncated waves [N s/m], (c,): d = (2/π)/(R ω_N), which is ρcA on a uniform bar.

    Between two bars their dashpots are in series, as their R are.

    Args:
        points: Their number c, and areas [m^2], (c,), which laws read.
    """
    c, areas = points
    if contact.law is not None and contact.law.kind == "linear":
        return np.array([point.damping for point in contact.law.of_points(areas.tolist())])
    if contact.dashpot == "none":
        return np.zeros(c)
    if c > 1:
        raise SceneError(f"contact.{name}.dashpot: 'wave-guide' needs a single-point contact on a bar")
    flexibility = 0.0
    for body, interface in zip(bodies, (contact.interface, getattr(contact.against, "interface", "")), strict=True):
        if body is not None and len(body.modal.angular_frequencies):
            flexibility += body.residual(interface, interface)[0, 0] * body.modal.angular_frequencies.max()
    return np.array([2 / np.pi / flexibility])
