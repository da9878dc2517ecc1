"""Energy and momentum of states of a mechanism."""

from typing import Any, NamedTuple

import numpy as np

from gudgeon.solver import core
from gudgeon.solver.bodies.small_motion import FlexibleBody
from gudgeon.solver.integrators.turning.arrays import (
    IMPULSE,
    LOST,
    SPEED,
    SPIN,
    SUMS,
    WIDTH,
    WORK,
    Model,
    Work,
)
from gudgeon.solver.integrators.turning.touching.columns import DEPTH
from gudgeon.solver.integrators.turning.touching.cone import stored


def bodies_of(model: Model, states: np.ndarray) -> np.ndarray:
    """Return the bodies' part of states (..., numbers), (..., n, 13)."""
    n = len(model.mass)
    return states[..., : WIDTH * n].reshape(*states.shape[:-1], n, WIDTH)


def modal_parts(model: Model, state: np.ndarray, b: int) -> tuple[np.ndarray, np.ndarray]:
    """Return views of a body's elastic coordinates and their momenta in states (..., numbers), (..., m) each."""
    m, start, momentum = (int(x) for x in model.elastic[b])
    return state[..., start : start + m], state[..., momentum : momentum + m]


def inertia_factor(model: Model, work: Work, b: int) -> np.ndarray:
    """Return the lower factor of a body's inertia over elastic coordinates and rotation along its own axes, of the
    pose that `work` has, (m + 3, m + 3)."""
    m = int(model.elastic[b, 0])
    factor = np.zeros((m + 3, m + 3))
    factor[:m, :m] = model.modal_root[b, :m, :m]
    factor[m:, :m], factor[m:, m:] = work.coupling[b, :, :m], np.tril(work.root[b])
    return factor


class Motion(NamedTuple):
    """What is found of one state."""

    omega: np.ndarray
    """Angular velocity of each body along the scene's axes [rad/s], (n, 3)."""
    modal: np.ndarray
    """Modal rates of each body, (n, E)."""
    springs: np.ndarray
    """Places and velocities of both ends of each spring [m, m/s], (b, 2, 2, 3)."""
    bushings: np.ndarray
    """Motions of each bushing and field, (u, 6), and force and moment on its own body, (u, 6): (u, 12)."""
    fields: np.ndarray
    """Co-energy of each field [J], (f,)."""
    depths: np.ndarray
    """Indentation of each section of a journal [m], (c,)."""
    stored: np.ndarray
    """What the tangential springs of sections that stick hold [J], (c,)."""
    pressed: float
    """What flexibilities between bodies that press on each other hold [J]."""


def motion_of(model: Model, work: Work, state: np.ndarray, turning: Any = None) -> Motion:
    """Return the motion of a state.

    Args:
        turning: `core.Turning` of model and work, if there is one already.
    """
    (turning or core.Turning(model, work)).observe(state)
    start, count = 2 * len(model.owner), len(model.spring)
    span, ends, bushings = slice(start, start + 2 * count), np.empty((count, 2, 2, 3)), np.empty((len(work.bush), 12))
    ends[:, :, 0], ends[:, :, 1] = work.place[span].reshape(count, 2, 3), work.speed[span].reshape(count, 2, 3)
    bushings[:, :6], bushings[:, 6:] = work.bush[:, :6], work.bush_push
    return Motion(work.omega.copy(), work.modal[:, 3:].copy(), ends, bushings,
                  work.field[:, 0].copy(), work.touch[:, DEPTH].copy(), stored=stored(model, work),
                  pressed=float(work.pressing.stored[0]))  # fmt: skip


def energies(model: Model, states: np.ndarray, motions: list[Motion]) -> np.ndarray:
    """Return kinetic and strain energy, that of contact, dissipated energy, and work with that of gravity since the
    bodies stood at the origin [J], (s, 5), of states (s, numbers)."""
    bodies, sums = bodies_of(model, states), states[:, -SUMS:]
    omega, modal = (np.array(column) for column in list(zip(*motions, strict=True))[:2])
    result = np.zeros((len(states), 5))
    square = (bodies[..., SPEED : SPEED + 3] ** 2).sum(axis=-1)
    result[:, 0] = 0.5 * (square @ model.mass + (omega * bodies[..., SPIN : SPIN + 3]).sum(axis=(1, 2)))
    for b in map(int, np.flatnonzero(model.elastic[:, 0])):
        q, momentum = modal_parts(model, states, b)
        m = q.shape[1]
        result[:, 0] += 0.5 * (modal[:, b, :m] * momentum).sum(axis=1)
        result[:, 1] += 0.5 * q**2 @ model.modal_stiffness[b, :m]
    for k, (stiffness, _, length) in enumerate(model.spring):
        offset = np.array([motion.springs[k, 1, 0] - motion.springs[k, 0, 0] for motion in motions])
        result[:, 1] += 0.5 * stiffness * (np.linalg.norm(offset, axis=1) - length) ** 2
    for k, matrix in enumerate(model.bush_stiffness):
        x = np.array([motion.bushings[k, :6] for motion in motions])
        result[:, 1] += 0.5 * np.einsum("si,ij,sj->s", x, matrix, x)
    result[:, 1] -= np.array([motion.fields for motion in motions]).sum(axis=1)
    for i, (stiffness, exponent, _, _) in enumerate(model.touch_law):
        depth = np.maximum([motion.depths[i] for motion in motions], 0.0)
        result[:, 2] += stiffness * depth ** (exponent + 1) / (exponent + 1)
    internal = np.array([motion.stored for motion in motions]).sum(axis=1)
    result[:, 2] += internal + np.array([motion.pressed for motion in motions])
    result[:, 3] = sums[:, LOST] - internal
    result[:, 4] = sums[:, WORK] + np.einsum("sbi,b,i->s", bodies[..., :3], model.mass, model.gravity)
    return result


def momentum_error(
    model: Model, states: np.ndarray, motions: list[Motion], wrenches: np.ndarray, duration: float
) -> float:
    """Return the largest error of the balances of momentum and of angular momentum about the origin, of states
    (s, numbers) of which the first is the start, over momenta and impulses as large as acted.

    Parts of a body have momenta where they cancel in the body: its mass times its root mean square speed counts, and
    the impulse of weights and of joints.

    Args:
        wrenches: Of the joints at the states [N, N m], (s, J, 6).
    """
    bodies, sums = bodies_of(model, states), states[:, -SUMS:]
    speeds, spins = bodies[..., SPEED : SPEED + 3], bodies[..., SPIN : SPIN + 3]
    linear = speeds * model.mass[:, None]
    orbital = np.cross(bodies[..., :3], linear)
    turning = (np.array([m.omega for m in motions]) * spins).sum(axis=-1)
    momenta = np.sqrt((linear**2).sum(axis=-1) + model.mass * np.maximum(turning, 0.0))
    weights = float(model.mass.sum() * np.linalg.norm(model.gravity)) * duration
    weights += float(np.linalg.norm(wrenches[..., :3], axis=-1).sum(axis=1).mean()) * duration
    moments = np.linalg.norm(orbital, axis=-1) + np.linalg.norm(spins, axis=-1)
    far = max(float(np.linalg.norm(bodies[..., :3], axis=-1).max()), model.size)
    worst, scale = 0.0, weights
    for total, sizes, column in (
        (linear.sum(axis=1), momenta, IMPULSE),
        ((orbital + spins).sum(axis=1), moments, IMPULSE + 3),
    ):
        missing = np.linalg.norm(total - total[0] - sums[:, column : column + 3], axis=1)
        impulses = np.linalg.norm(sums[:, column : column + 3], axis=1)
        largest = max(float(sizes.sum(axis=1).max()), float(impulses.max()), scale)
        worst, scale = max(worst, float(missing.max()) / largest if largest > 0 else 0.0), far * largest
    return worst


def to_coordinates(body: FlexibleBody) -> np.ndarray:
    """Return the rows of a body's rigid coordinates over its displacement and rotation, (6, 6)."""
    momentum = np.zeros((6, 6))
    momentum[:3, :3], momentum[3:, 3:] = body.morph.mass * np.eye(3), body.morph.inertia
    return momentum @ body.twists.T
