"""Momentum balance of a run."""

import numpy as np

from gudgeon.solver.contact.rows import ContactRows
from gudgeon.solver.integrators.outcome import Outcome
from gudgeon.solver.system.system import System


def momentum_residual(system: System, end: Outcome, loads: np.ndarray, duration: float) -> float:
    """Return the largest error of a body's linear and angular momentum balance, relative to the impulse.

    Momentum is computed from the rigid twists, impulse independently from forces, directions and arms. Angular momentum
    is about the centre of mass, divided by the largest distance of a contact point from it.

    Args:
        loads: Impulse of each load row, (L,).
        duration: Time over which gravity acts [s].
    """
    worst = 0.0
    for name, body in system.bodies.items():
        if not body.rigid_count:
            continue
        columns = body.rigid
        (impulse, size), radius = _driven(system, name, loads, duration), 0.0
        for i, contact in enumerate(system.contacts):
            contact_impulse, arm, length = _pressed(system, end, contact, i, name)
            impulse, size, radius = impulse + contact_impulse, size + arm, max(radius, length)
        pulled = system.springs.rows[:, columns].T @ end.springs if len(end.springs) else 0.0
        if len(end.springs):
            size += float(np.abs(end.springs[np.any(system.springs.rows[:, columns], axis=1)]).sum())
        if size > 0:
            # Momentum of the coordinates against twist times wrench; supported motions have no coordinate.
            error = np.abs(end.v[columns] - system.velocity[columns] + pulled - body.twists @ impulse)
            scale = np.linalg.norm(body.twists[:, :3], axis=1) + (radius or 1.0) * np.linalg.norm(
                body.twists[:, 3:], axis=1
            )
            worst = max(worst, float((error / scale).max()) / size)
    return worst


def _moment(arm: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return Σ arm × force of (c, 3) each, (3,)."""
    product = arm.T @ force
    return np.array(
        [product[1, 2] - product[2, 1], product[2, 0] - product[0, 2], product[0, 1] - product[1, 0]]
    )  # fmt: skip


def _about(centre: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    """Return an impulse and its moment about a centre, of those about the origin, (6,)."""
    return np.concatenate([wrench[:3], wrench[3:] - np.cross(centre, wrench[:3])])


def _pressed(system: System, end: Outcome, contact: ContactRows, i: int, name: str) -> tuple[np.ndarray, float, float]:
    """Return the impulse and moment of a contact on a body about its centre, (6,), their size and largest arm [m]."""
    impulse, size, radius, centre = np.zeros(6), 0.0, 0.0, system.bodies[name].morph.centre
    impulses = end.impulses[contact.rows, None] * contact.directions
    if len(end.drags):
        impulses = impulses + end.drags[contact.rows]
    for owner, _, _, points, sign in contact.sides:
        if owner == name:
            arm = points - centre
            radius = max(radius, float(np.sqrt((arm * arm).sum(axis=1).max())))
            impulse += sign * np.concatenate([impulses.sum(axis=0), _moment(arm, impulses)])
            size += float(np.linalg.norm(impulses.sum(axis=0)))
    if (surface := contact.master) is not None:
        sign = (contact.body == name) - (surface.body == name)
        impulse[:3] += sign * end.drag_impulse[i] * surface.direction
        if surface.body == name:
            wrench = -end.master_impulses[contact.functions] @ surface.resultant
            if len(end.master_drags):
                wrench = wrench + end.master_drags[i]
            impulse += _about(centre, wrench)
            size += float(np.linalg.norm(wrench[:3]))
    return impulse, size, radius


def _driven(system: System, name: str, loads: np.ndarray, duration: float) -> tuple[np.ndarray, float]:
    """Return the impulse and moment of the loads on a body about its centre, (6,), and their size [N s]."""
    body, driving, wrenches = system.bodies[name], system.driving, []
    impulse, size = np.zeros(6), 0.0
    for i, point in enumerate(driving.joints):
        if point.joint.body == name:
            wrenches.append(loads[2 * i : 2 * i + 2] @ point.resultant)
    pushes = [*driving.given_rows(), *driving.driven_rows()]
    wrenches += [loads[rows] @ load.resultant for load, rows in pushes if load.body == name]
    for wrench in wrenches:
        impulse += _about(body.morph.centre, wrench)
        size += float(np.linalg.norm(wrench[:3]))
    impulse[:3] += duration * body.morph.mass * np.asarray(system.scene.run.gravity)
    return impulse, size
