"""Energy and momentum of states of a mechanism."""

import numpy as np

from gudgeon.solver.integrators.mechanism.arrays import (
    IMPULSE,
    LOST,
    NONE,
    SPEED,
    SPIN,
    SUMS,
    TURN,
    WIDTH,
    WORK,
    Model,
)
from gudgeon.solver.integrators.mechanism.rotation import matrices


def bodies_of(model: Model, states: np.ndarray) -> np.ndarray:
    """Return the bodies' part of states (..., 13 n + SUMS), (..., n, 13)."""
    n = len(model.mass)
    return states[..., : WIDTH * n].reshape(*states.shape[:-1], n, WIDTH)


def angular_velocities(model: Model, bodies: np.ndarray) -> np.ndarray:
    """Return ω along the scene's axes [rad/s] of bodies (..., n, 13), (..., n, 3)."""
    turn = matrices(bodies[..., TURN : TURN + 4])
    own = np.einsum("...bji,...bj->...bi", turn, bodies[..., SPIN : SPIN + 3])
    return np.einsum("...bij,bjk,...bk->...bi", turn, model.inverse, own)


def point_places(model: Model, bodies: np.ndarray, owner: int, arm: np.ndarray) -> np.ndarray:
    """Return the places of a point of a body, or of the ground [m], (..., 3)."""
    if owner == NONE:
        return np.broadcast_to(arm, (*bodies.shape[:-2], 3))
    return bodies[..., owner, :3] + matrices(bodies[..., owner, TURN : TURN + 4]) @ arm


def energies(model: Model, states: np.ndarray) -> np.ndarray:
    """Return kinetic and strain energy, none of contact, dissipated energy, and work with that of gravity since the
    bodies stood at the origin [J], (s, 5), of states (s, 13 n + SUMS)."""
    bodies, sums = bodies_of(model, states), states[:, -SUMS:]
    omega = angular_velocities(model, bodies)
    found = np.zeros((len(states), 5))
    square = (bodies[..., SPEED : SPEED + 3] ** 2).sum(axis=-1)
    found[:, 0] = 0.5 * (square @ model.mass + (omega * bodies[..., SPIN : SPIN + 3]).sum(axis=(1, 2)))
    for (a, b), arms, (stiffness, _, length) in zip(model.spring_owner, model.spring_arm, model.spring, strict=True):
        apart = point_places(model, bodies, b, arms[1]) - point_places(model, bodies, a, arms[0])
        found[:, 1] += 0.5 * stiffness * (np.linalg.norm(apart, axis=1) - length) ** 2
    found[:, 3] = sums[:, LOST]
    found[:, 4] = sums[:, WORK] + np.einsum("sbi,b,i->s", bodies[..., :3], model.mass, model.gravity)
    return found


def momentum_error(model: Model, states: np.ndarray) -> float:
    """Return the largest error of the balances of momentum and of angular momentum about the origin, over the sum of
    the bodies' own momenta, of states (s, 13 n + SUMS) of which the first is the start."""
    bodies, sums = bodies_of(model, states), states[:, -SUMS:]
    speeds, spins = bodies[..., SPEED : SPEED + 3], bodies[..., SPIN : SPIN + 3]
    linear = speeds * model.mass[:, None]
    orbital = np.cross(bodies[..., :3], linear)
    worst = 0.0
    for total, parts, at in (
        (linear.sum(axis=1), np.linalg.norm(linear, axis=-1), IMPULSE),
        ((orbital + spins).sum(axis=1), np.linalg.norm(orbital, axis=-1) + np.linalg.norm(spins, axis=-1), IMPULSE + 3),
    ):
        lost = np.linalg.norm(total - total[0] - sums[:, at : at + 3], axis=1)
        largest = max(float(parts.sum(axis=1).max()), float(np.linalg.norm(sums[:, at : at + 3], axis=1).max()))
        worst = max(worst, float(lost.max()) / largest if largest > 0 else 0.0)
    return worst
