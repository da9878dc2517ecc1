"""Velocity jumps of rigid contact at an event, and which contacts are closed after it."""

from collections.abc import Set
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from gudgeon.solver.integrators.event.motion import Probe
from gudgeon.solver.integrators.event.regimes import Conditions, Equations, Status, acceleration

ACCUMULATED = 1e-9
"""Separation speed over the largest approach speed so far, below which a sequence of impacts counts as over."""
UNRESOLVED = 1e-5
"""The same of rows that part and return within `HOP` of the shortest period: without restitution, many points would
close and part each other without end."""
HOP = 1e-4
"""Time between events over the shortest period of the modes, below which they are of one sequence."""
TOGETHER = 1e-12
"""Gap, relative to the sum of its terms, at which a row counts as closing at the same time."""
RESTING = 1e-13
"""Speed or force, relative to the sum of its terms, that counts as zero."""


@dataclass
class Impact:
    """A velocity jump of c rows."""

    impulses: np.ndarray
    """On each row [N s], (c,)."""
    tangential: np.ndarray
    """Impulse of friction [N s], (c,)."""
    lost: float
    """Energy lost [J]."""
    driven: float
    """Work of moving obstacles by friction [J]."""
    rubbed: np.ndarray
    """Energy that friction takes [J], (c,)."""
    compressed: float
    """Energy of compression, before restitution [J]."""


def gaps_of(equations: Equations, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the gaps of all rows without yielding, and the sums of their absolute terms [m], (c,) each."""
    rows, gap = equations.rows, equations.system.gap
    return gap + rows @ p, np.abs(rows) @ np.abs(p) + np.abs(gap)


def struck(equations: Equations, state: Conditions, hit: int, p: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the rigid rows of an impact: those that are closed, and those that close together with row `hit`."""
    system = equations.system
    rigid = system.rigid_contact
    gaps, size = gaps_of(equations, p)
    together = rigid & (np.abs(gaps) <= TOGETHER * size) & (equations.rows @ v < 0)
    touching = rigid & ((state.status == Status.CLOSED) | (state.status == Status.IMPLIED))
    return np.union1d(np.flatnonzero(together | touching), [hit])


def collide(
    equations: Equations, state: Conditions, touching: np.ndarray, v: np.ndarray, fastest: np.ndarray,
    hopped: Set[int],
) -> Impact:  # fmt: skip
    """Change velocities where rigid rows close, by Newton's restitution of all touching rows together.

    Args:
        state: Changed in place: rows that separate open, others close.
        touching: Rows of the impact.
        v: Velocities, changed in place, (n,).
        fastest: Largest approach speed of each row so far, changed in place, (c,).
        hopped: Rows that parted and returned within a time that the modes do not resolve; at small speeds they stay
            closed.
    """
    system = equations.system
    rows = equations.rows[touching]
    before = rows @ v
    fastest[touching] = np.maximum(fastest[touching], -before)
    if len(touching) == 1 and equations.frictional[touching[0]]:
        impulses, drag = _with_friction(equations, int(touching[0]), v)
    else:
        bounce = np.where(before < 0, 1 + system.restitution[touching], 1.0) * before
        impulses, drag = _complementary(rows, bounce), np.zeros(1)
    mean, velocity_jump = v.copy(), rows.T @ impulses
    v += velocity_jump
    if drag.any():
        along = equations.tangents[touching].T @ drag
        velocity_jump = velocity_jump + along
        v += along
    mean = 0.5 * (mean + v)
    after = rows @ v
    driven = float(drag @ system.belt[touching[: len(drag)]])
    zero, rubbing = np.zeros(len(system.gap)), touching[: len(drag)]
    impact = Impact(zero, zero.copy(), driven - float(velocity_jump @ mean), driven, zero.copy(), 0.0)
    impact.impulses[touching], impact.tangential[rubbing] = impulses, drag
    impact.rubbed[rubbing] = drag * (system.belt[rubbing] - system.tangents[rubbing] @ mean)
    impact.compressed = 0.5 * float(impulses @ np.maximum(-before, 0.0))
    for i, row in enumerate(touching):
        size = abs(before[i]) + float(np.abs(equations.rows[row]) @ np.abs(v))
        slow = UNRESOLVED if int(row) in hopped else ACCUMULATED
        stays = after[i] <= max(slow * fastest[row], RESTING * size)
        state.status[row] = Status.CLOSED if stays else Status.OPEN
    _hold(equations, state, v, impact)
    return impact


def _hold(equations: Equations, state: Conditions, v: np.ndarray, impact: Impact) -> None:
    """Set the remaining speeds of rows that stay closed to zero."""
    system = equations.system
    closed = np.flatnonzero((state.status == Status.CLOSED) & system.rigid_contact)
    if not len(closed):
        return
    rows = equations.rows[closed]
    impulses = -np.linalg.lstsq(rows @ rows.T, rows @ v, rcond=1e-12)[0]
    mean = v + 0.5 * (rows.T @ impulses)
    impact.lost -= float((rows.T @ impulses) @ mean)
    impact.impulses[closed] += impulses
    v += rows.T @ impulses


def _with_friction(equations: Equations, row: int, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return normal and tangential impulse [N s] of one row by Newton's restitution and Coulomb's friction."""
    system = equations.system
    both = np.stack([equations.rows[row], equations.tangents[row]])
    W, speed = both @ both.T, both @ v
    target = np.array([-(1 + system.restitution[row]) * speed[0], system.belt[row] - speed[1]])
    normal, drag = np.linalg.solve(W, target) if np.linalg.det(W) > 0 else (target[0] / W[0, 0], 0.0)
    limit = system.friction[row, 1]
    if abs(drag) > limit * normal:
        sign = np.sign(drag)
        normal = target[0] / (W[0, 0] + sign * limit * W[0, 1])
        drag = sign * limit * normal
    return np.array([normal]), np.array([drag])


def _complementary(rows: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Solve 0 ≤ x ⊥ A Aᵀ x + b ≥ 0 with rows A that may depend on each other: min |Aᵀ x + w| with A w = b, x ≥ 0."""
    if len(b) == 1:
        return np.maximum(-b / float(rows[0] @ rows[0]), 0.0)
    w = np.linalg.lstsq(rows, b, rcond=None)[0]
    return optimize.nnls(rows.T, -w)[0]


def _spread(equations: Equations, state: Conditions, p: np.ndarray, v: np.ndarray) -> None:
    """Choose independent rows among closed ones that depend on each other; changes `state` in place.

    The forces are the nonnegative ones that leave the least acceleration; these act on independent rows.
    """
    system = equations.system
    state.status[state.status == Status.IMPLIED] = Status.CLOSED
    hard = np.flatnonzero((state.status == Status.CLOSED) & system.rigid_contact)
    if len(hard) < 2 or equations.frictional[hard].any():
        return
    rows = equations.rows[hard] / np.linalg.norm(equations.rows[hard], axis=1)[:, None]
    if np.linalg.matrix_rank(rows, tol=1e-10) == len(hard):
        return
    open_status = state.status.copy()
    open_status[hard] = Status.OPEN
    free = acceleration(equations.regime(Conditions(open_status, state.slip), p).linear)
    free_acceleration = free(np.zeros_like(p), v)
    forces = optimize.nnls(rows.T, -free_acceleration)[0]
    parting = rows @ (free_acceleration + rows.T @ forces)
    still = parting <= 1e-10 * (float(np.abs(free_acceleration).max()) or 1.0)
    carrying: list[int] = []
    for i in np.argsort(-forces, kind="stable"):
        row = hard[i]
        if not still[i]:
            state.status[row] = Status.OPEN
        elif np.linalg.matrix_rank(rows[[*carrying, i]], tol=1e-10) > len(carrying):
            state.status[row] = Status.CLOSED
            carrying.append(int(i))
        else:
            state.status[row] = Status.IMPLIED


def settle(equations: Equations, state: Conditions, p: np.ndarray, v: np.ndarray) -> None:
    """Open rows whose force would be negative, and set which rows stick or slip; changes `state` in place."""
    system = equations.system
    _spread(equations, state, p, v)
    for row in np.flatnonzero(equations.frictional & (state.status == Status.CLOSED)):
        slide = float(equations.tangents[row] @ v) - system.belt[row]
        size = float(np.abs(equations.tangents[row]) @ np.abs(v)) + abs(system.belt[row])
        state.slip[row] = 0 if abs(slide) <= 1e-12 * size else int(np.sign(slide))
    for _ in range(len(state.status) + 1):
        hard = np.flatnonzero((state.status == Status.CLOSED) & system.rigid_contact)
        if not len(hard):
            return
        regime, still = equations.regime(state, p), np.zeros_like(p)
        forces = regime.forces(still, v)
        scale = force_scale(acceleration(regime.linear), still, v, equations.rows)
        pulling = [row for row in hard if forces[row] < -RESTING * scale[row]]
        if pulling:
            state.status[min(pulling, key=lambda row: forces[row])] = Status.OPEN
            continue
        drag = regime.tangential(still, v)
        sticking = hard[equations.frictional[hard] & (state.slip[hard] == 0)]
        exceeding = [row for row in sticking if _exceeds(equations, row, float(drag[row]), float(forces[row]))]
        if not exceeding:
            return
        # It slips against the direction of the friction force that it would need.
        state.slip[exceeding[0]] = -int(np.sign(drag[exceeding[0]]))


def _exceeds(equations: Equations, row: int, drag: float, force: float) -> bool:
    """Whether a friction force is above the static limit of a normal force [N]."""
    return bool(abs(drag) > equations.system.friction[row, 0] * force * (1 + 1e-12))


def settle_slip(equations: Equations, state: Conditions, p: np.ndarray, v: np.ndarray, row: int) -> None:
    """Set whether a row that came to rest sticks, or slips since friction cannot hold it; changes `state` in place."""
    regime, still = equations.regime(state, p), np.zeros_like(p)
    drag, force = regime.tangential(still, v)[row], regime.forces(still, v)[row]
    if _exceeds(equations, row, drag, force):
        state.slip[row] = -int(np.sign(drag))


def force_scale(free: Probe, p: np.ndarray, v: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the sum of the absolute terms of each row's force [N]: of its acceleration over its mobility."""
    terms = np.abs(free.constant) + np.abs(free.position) @ np.abs(p) + np.abs(free.velocity) @ np.abs(v)
    mobility = (rows**2).sum(axis=1)
    return (np.abs(rows) @ terms) / np.where(mobility > 0, mobility, 1.0)
