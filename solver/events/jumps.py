"""What happens at an event: velocity jumps of rigid contact, and which contacts are closed from then on."""

from dataclasses import dataclass

import numpy as np
from scipy import linalg, optimize

from solver.events.conditions import Conditions, Equations, Status, acceleration
from solver.events.motion import Probe

ACCUMULATED = 1e-9
"""Separation speed over the largest approach speed so far, at which blows that follow ever faster count as over."""
RESTING = 1e-13
"""Speed or force, relative to what it came from, that counts as none."""


@dataclass
class Blow:
    """An impulsive contact: what it did."""

    impulses: np.ndarray
    """On each row [N s], (c,)."""
    tangential: np.ndarray
    """Friction's [N s], (c,)."""
    lost: float
    """Energy [J]."""
    compressed: float
    """Energy taken in compression, before any was given back [J]."""


def collide(equations: Equations, now: Conditions, hit: int, v: np.ndarray, fastest: np.ndarray) -> Blow:
    """Change velocities where a rigid row closes; Newton's restitution, all touching rows together.

    Args:
        now: Changed in place: which rows are closed from here on, as far as velocities tell.
        hit: The row that closes.
        v: Velocities, changed in place, (n,).
        fastest: Largest approach speed of each row so far, changed in place, (c,).
    """
    system = equations.system
    touching = np.flatnonzero((now.status == Status.CLOSED) & system.rigid_contact)
    touching = np.union1d(touching, [hit])
    rows = system.rows[touching]
    before = rows @ v
    fastest[hit] = max(fastest[hit], -float(system.rows[hit] @ v))
    if len(touching) == 1 and equations.frictional[hit]:
        impulses, drag = _with_friction(equations, hit, v)
    else:
        bounce = np.where(before < 0, 1 + system.restitution[touching], 1.0) * before
        impulses, drag = _complementary(rows @ rows.T, bounce), np.zeros(1)
    mean = v.copy()
    v += rows.T @ impulses
    if drag.any():
        v += system.tangents[touching].T @ drag
    mean = 0.5 * (mean + v)
    push = rows.T @ impulses + (system.tangents[touching].T @ drag if drag.any() else 0.0)
    after = rows @ v
    blow = Blow(np.zeros(len(system.gap)), np.zeros(len(system.gap)), -float(push @ mean), 0.0)
    blow.impulses[touching], blow.tangential[touching[: len(drag)]] = impulses, drag
    blow.compressed = 0.5 * float(impulses @ np.maximum(-before, 0.0))
    for number, row in enumerate(touching):
        size = abs(before[number]) + float(np.abs(system.rows[row]) @ np.abs(v))
        stays = after[number] <= max(ACCUMULATED * fastest[row], RESTING * size)
        now.status[row] = Status.CLOSED if stays else Status.OPEN
    _hold(equations, now, v, blow)
    return blow


def _hold(equations: Equations, now: Conditions, v: np.ndarray, blow: Blow) -> None:
    """Take what little speed is left from rows that stay closed."""
    system = equations.system
    held = np.flatnonzero((now.status == Status.CLOSED) & system.rigid_contact)
    if not len(held):
        return
    rows = system.rows[held]
    impulses = -linalg.solve(rows @ rows.T, rows @ v, assume_a="pos")
    mean = v + 0.5 * (rows.T @ impulses)
    blow.lost -= float((rows.T @ impulses) @ mean)
    blow.impulses[held] += impulses
    v += rows.T @ impulses


def _with_friction(equations: Equations, row: int, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Newton's restitution with Coulomb's friction at one row: normal and tangential impulse."""
    system = equations.system
    both = np.stack([system.rows[row], system.tangents[row]])
    W, speed = both @ both.T, both @ v
    target = np.array([-(1 + system.restitution[row]) * speed[0], system.belt[row] - speed[1]])
    normal, drag = np.linalg.solve(W, target) if np.linalg.det(W) > 0 else (target[0] / W[0, 0], 0.0)
    limit = system.friction[row, 1]
    if abs(drag) > limit * normal:
        sign = np.sign(drag)
        normal = target[0] / (W[0, 0] + sign * limit * W[0, 1])
        drag = sign * limit * normal
    return np.array([normal]), np.array([drag])


def _complementary(W: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Solve 0 ≤ x ⊥ W x + b ≥ 0 with W positive definite."""
    if len(b) == 1:
        return np.maximum(-b / W[0, 0], 0.0)
    lower = linalg.cholesky(W, lower=True)
    return optimize.nnls(lower.T, linalg.solve_triangular(lower, -b, lower=True))[0]


def settle(equations: Equations, now: Conditions, p: np.ndarray, v: np.ndarray) -> None:
    """Open rows that would pull, and find which rows with friction stick or slip, and which way.

    Changes `now` in place.
    """
    system = equations.system
    for row in np.flatnonzero(equations.frictional & (now.status == Status.CLOSED)):
        slide = float(system.tangents[row] @ v) - system.belt[row]
        size = float(np.abs(system.tangents[row]) @ np.abs(v)) + abs(system.belt[row])
        now.slip[row] = 0 if abs(slide) <= 1e-12 * size else int(np.sign(slide))
    for _ in range(len(now.status) + 1):
        hard = np.flatnonzero((now.status == Status.CLOSED) & system.rigid_contact)
        if not len(hard):
            return
        regime, still = equations.regime(now, p), np.zeros_like(p)
        forces = regime.forces(still, v)
        scale = _scale(acceleration(regime.linear), still, v, system.rows)
        pulling = [row for row in hard if forces[row] < -RESTING * scale[row]]
        if pulling:
            now.status[min(pulling, key=lambda row: forces[row])] = Status.OPEN
            continue
        drag = regime.tangential(still, v)
        over = [
            row
            for row in hard
            if equations.frictional[row]
            and now.slip[row] == 0
            and abs(drag[row]) > system.friction[row, 0] * forces[row] * (1 + 1e-12)
        ]
        if not over:
            return
        # It slides against the force that could not hold it.
        now.slip[over[0]] = -int(np.sign(drag[over[0]]))


def _scale(free: Probe, p: np.ndarray, v: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return what a force of each row is made of [N]: the terms of its acceleration over its mobility."""
    terms = np.abs(free.constant) + np.abs(free.position) @ np.abs(p) + np.abs(free.velocity) @ np.abs(v)
    mobility = (rows**2).sum(axis=1)
    return (np.abs(rows) @ terms) / np.where(mobility > 0, mobility, 1.0)
