"""Bodies whose interfaces are pressed at a slant: the rows of their contact points along the obstacle's direction.

The record has the rows of each point along its outward normal n and two tangents. With F these three unit vectors and
F' those of which the first is against the direction d of the obstacle's force, in rows,

  B' = F' Fᵀ B,   R' = F' Fᵀ R F F'ᵀ,   F'₁ = −d,

for the rows B of the elastic coordinates, and R and the columns of gauges alike.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.errors import SceneError
from gudgeon.solver.obstacles import basic_surface
from gudgeon.solver.scene.contact import Contact, MasterSurface, OtherBody
from gudgeon.solver.scene.scene import Scene

FACING = 0.99
"""Least cosine between a surface's normal and the direction to its obstacle."""
ALIKE = 1e-9
"""Largest difference of directions that are the same."""
APART = 1e-4
"""Difference of the directions of two obstacles from which on an interface cannot have rows along both."""


def along_obstacles(scene: Scene, bodies: Mapping[str, FlexibleBody]) -> dict[str, FlexibleBody]:
    """Return bodies with rows along the directions of what their interfaces meet, where their records have tangents.

    Points that do not face an obstacle keep their rows: the contact refuses them.

    Raises:
        SceneError: an interface meets obstacles of two directions.
    """
    along, seen = dict(bodies), dict[tuple[str, str], np.ndarray]()
    if scene.capabilities.turns:
        return along
    for name, contact in scene.contact.items():
        for body, interface, directions in _met(scene, contact, bodies):
            modes = bodies[body].modal.interfaces[interface]
            if modes.tangential_rows is None or (np.einsum("ci,ci->c", directions, modes.normals) < FACING).any():
                continue
            if np.abs(seen.setdefault((body, interface), directions) - directions).max(initial=0.0) > APART:
                raise SceneError(
                    f"contact.{name}: interface '{interface}' of body '{body}' meets obstacles of two directions;"
                    " give each contact an interface of its own on the same surface"
                )
    for (body, interface), directions in seen.items():
        if np.abs(directions - along[body].contact_frame(interface)[:, 0]).max(initial=0.0) > ALIKE:
            along[body] = _pressed(along[body], interface, directions)
    return along


def _met(scene: Scene, contact: Contact, bodies: Mapping[str, FlexibleBody]) -> list[tuple[str, str, np.ndarray]]:
    """Return body, interface, and unit vectors to the obstacle, (c, 3), of each side of a contact with points."""
    modes, against = bodies[contact.body].modal.interfaces.get(contact.interface), contact.against
    if modes is None or not len(modes.normals):
        return []
    if isinstance(against, OtherBody):
        far, side = bodies[against.body].modal.interfaces.get(against.interface), (contact.body, contact.interface)
        # Forces act along the normals of the first side: of one direction, if its face is flat.
        if far is None or not len(far.normals) or np.ptp(modes.normals, axis=0).max() > ALIKE:
            return [(*side, modes.normals)]
        there = np.tile(-modes.normals[0], (len(far.normals), 1))
        return [(*side, modes.normals), (against.body, against.interface, there)]
    placed = bodies[contact.body].morph.points[contact.interface] + np.asarray(scene.body[contact.body].position)
    if isinstance(against, MasterSurface):
        space = bodies[against.body].modal.tractions.get(against.interface)
        if space is None or space.chart["kind"] == "patch":
            return []
        against = basic_surface(space.chart, np.asarray(scene.body[against.body].position))
    return [(contact.body, contact.interface, -against.direction(placed))]


def _pressed(body: FlexibleBody, interface: str, normals: np.ndarray) -> FlexibleBody:
    """Return a body with rows of an interface along other unit vectors, (c, 3), and tangents across them."""
    modal, frame, rows = body.modal, body.contact_frame(interface), body.contact_rows(interface)
    t = frame[:, 1] - np.einsum("ci,ci->c", frame[:, 1], normals)[:, None] * normals
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    new = np.stack([normals, t, np.cross(normals, t)], axis=1)
    turn = np.einsum("cai,cbi->cab", new, frame)
    turned, row_numbers = np.einsum("cab,cbm->cam", turn, rows), body.contact_places(interface).reshape(-1, 3)
    R = modal.residual_flexibility
    if R is not None:
        R = R.copy()
        R[row_numbers] = np.einsum("cab,cbk->cak", turn, R[row_numbers])
        R[:, row_numbers] = np.einsum("cab,kcb->kca", turn, R[:, row_numbers])
    gauges = dict(modal.gauges)
    for name, gauge in gauges.items():
        if gauge.residual.size:
            columns = gauge.residual.copy()
            columns[:, row_numbers] = np.einsum("cab,kcb->kca", turn, columns[:, row_numbers])
            gauges[name] = replace(gauge, residual=columns)
    item = replace(modal.interfaces[interface], rows=turned[:, 0], tangential_rows=turned[:, 1:])
    return replace(
        body,
        modal=replace(
            modal, interfaces=modal.interfaces | {interface: item}, residual_flexibility=R, gauges=gauges
        ),
        pressed={**body.pressed, interface: new},
    )  # fmt: skip
