"""Full-FE problem of a scene with contact at fixed points: against points of another body, or against an obstacle."""

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.nodal.problem import PointContact, PointProblem
from gudgeon.pipeline.nodal.scene.body import Part, load_part
from gudgeon.pipeline.nodal.scene.facets import faced_rows, surface_of
from gudgeon.pipeline.stages.job import Job
from gudgeon.solver.obstacles import obstacle_of
from gudgeon.solver.scene.oblique import oblique

INSIDE = 1e-9
"""Penetration allowed at the start, relative to the points' coordinates: round-off."""
MATCHING = 1e-6
"""Offset of paired points, relative to the extent of the surface, above which the facets of the other are met."""
FLAT = 1e-9
"""Difference of the normals of a flat face."""
MISSES = 1e3
"""Gap of points that meet nothing, over the extent of the surface."""
METHODS = ("residual", "penalty", "constraint")
"""Contact methods of a full FE; its nodes have all the flexibility that `residual` adds to a reduced model."""


def meeting_problem(job: Job) -> PointProblem:
    """Return the problem.

    Raises:
        InputError: something is not supported, points start in penetration, or points of two bodies do not pair.
    """
    scene = job.scene
    bodies = [load_part(job, name, np.asarray(scene.run.gravity)) for name in scene.body]
    contacts = {name: _contact(job, name, bodies) for name in scene.contact}
    if len({contact.law is None for contact in contacts.values()}) > 1:
        raise InputError(
            f"{job.path}: report.full_fe: contacts with a law or a layer cannot be combined with rigid contacts"
        )
    flying = len(contacts) == 1 and not any(scene.run.gravity)
    return PointProblem(tuple(b.body for b in bodies), contacts, scene.run.duration, flying, scene.run.window)


def refuse_contacts(job: Job) -> None:
    """Check that contacts are of the kinds that the full FE has.

    Raises:
        InputError: a contact has friction or a restitution.
    """
    for name, contact in job.scene.contact.items():
        key = f"{job.path}: report.full_fe: contact.{name}"
        if contact.method not in METHODS:
            raise InputError(f"{key}.method: '{contact.method}' given, allowed: {', '.join(METHODS)}")
        if contact.friction is not None:
            raise InputError(f"{key}.friction: friction is not supported; remove it")


def _contact(job: Job, name: str, bodies: list[Part]) -> PointContact:
    contact, names = job.scene.contact[name], [body.name for body in bodies]
    body_id, slanting = names.index(contact.body), oblique(job.scene)
    points, outward = bodies[body_id].contact_rows(contact.interface, f"contact.{name}.interface")
    placed, normals = bodies[body_id].placed(points.points), points.normals @ bodies[body_id].rotation.T
    rows: list[sparse.csr_matrix | None] = [None] * len(bodies)
    rows[body_id], areas = -outward, points.areas
    if contact.against.shape == "body":
        partner_id = names.index(contact.against.body)
        key = f"contact.{name}.against.interface"
        flat = contact.against.interface in slanting[contact.against.body] and np.ptp(normals, axis=0).max() < FLAT
        along = -normals[0] if flat else None
        far, there = bodies[partner_id].contact_rows(contact.against.interface, key, along)
        order, gap, beside = _facing(placed, normals, bodies[partner_id].placed(far.points))
        equal = len(far.points) == len(placed) and len(np.unique(order)) == len(order)
        surfaces = []
        if len(points.facets) and len(far.facets):
            surfaces = [
                surface_of(bodies[body_id], contact.interface),
                surface_of(bodies[partner_id], contact.against.interface),
            ]
        solids = len(surfaces) > 0 and all(s.facets.shape[1] == 6 for s in surfaces)
        if solids and (not equal or beside > MATCHING * float(np.ptp(placed))):
            met, gap, areas = faced_rows((bodies[body_id], points, surfaces[0]), (bodies[partner_id], surfaces[1]))
            gap = np.where(np.isfinite(gap), gap, MISSES * float(np.ptp(placed)))
        elif equal:
            met = -there[order]
        else:
            raise InputError(
                f"{job.path}: {key}: has {len(far.points)} points, the one opposite {len(placed)}; needed: as many,"
                " each facing another, or surfaces with facets on both sides"
            )
        rows[partner_id] = met if partner_id != body_id else rows[body_id] + met
        directions = -normals
    else:
        partner_id, obstacle = None, obstacle_of(contact.against.model_dump())
        gap, directions = obstacle.gap(placed), obstacle.direction(placed)
        if contact.interface in slanting[contact.body]:
            _, inward = bodies[body_id].contact_rows(contact.interface, f"contact.{name}.interface", -directions)
            rows[body_id] = -inward
    allowed, deformed = INSIDE * float(np.abs(placed).max()), gap.copy()
    for row, body in zip(rows, bodies, strict=True):
        deformed += 0.0 if row is None else row @ body.body.start[0]
    if gap.min() < -allowed and deformed.min() < -allowed:
        raise InputError(f"{job.path}: contact.{name}: points start with a penetration of {-deformed.min():.3g} m")
    if deformed.min() < -allowed:
        raise InputError(
            f"{job.path}: report.full_fe: contact.{name}: points start with a penetration of {-deformed.min():.3g} m,"
            " deformed by gravity; the full FE has no start with contact forces, set run.start to 'undeformed'"
        )
    law = None
    if contact.surface_stiffness is not None:
        law = np.zeros((len(gap), 4))
        law[:, 0], law[:, 1] = contact.surface_stiffness * areas, 1.0
    elif contact.law is not None:
        law = np.array(contact.law.of_points(areas.tolist()))
    gap = np.where(np.abs(gap) <= allowed, np.maximum(gap, 0.0), gap)
    return PointContact(tuple(rows), gap, directions, body_id, partner_id, law)


def _facing(placed: np.ndarray, normals: np.ndarray, there: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the point of another body nearest to the normal of each point, the gap along it [m], (c,) each, and the
    largest offset across it [m]."""
    aside = np.linalg.norm(np.cross(there[None] - placed[:, None], normals[:, None]), axis=2)
    order = aside.argmin(axis=1)
    return order, np.einsum("ci,ci->c", there[order] - placed, normals), float(aside.min(axis=1).max())
