"""Contact forces at fixed points in one step of the midpoint rule, compiled.

    g⁺ = free + W λ̄,   W = Σ G_b W_b G_bᵀ over the bodies

Only the formulas of the contact laws are shared with the solver, which this is the reference of. With a law λ̄ is the
mean of the elastic force over the depths of the step, (V(d⁺) − V(d))/(d⁺ − d), plus damping, so that an elastic law
conserves energy. In rigid contact (Signorini) a point closes when its gap half-way through the step would be negative,
and stays closed while its force is positive:

    0 ≤ λ̄ ⊥ ġ⁺ + max(ġ, 0) ≥ 0,   ġ⁺ = 2 (g⁺ − g)/h − ġ

(Moreau and Jean's rule with θ = ½ and no restitution, V. Acary, Z. Angew. Math. Mech. 96 (2016) 585-603, but for the
maximum.) Its work h λ̄ (ġ + ġ⁺)/2 is never positive: a closing dissipates the kinetic energy of the mass that W sees in
one step, which tends to zero with step and mesh; a closed point dissipates none. Constraints on gaps instead of rates
would let closed nodes oscillate undamped. The forces are found by Gauss-Seidel sweeps over the points, which converge
since W is symmetric and positive definite.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.nodal.problem import PointContact
from gudgeon.solver.compiled import compiled
from gudgeon.solver.laws.force import law_energy, law_force

FAST = {"reassoc", "contract"}
"""Sums may be reordered; NaN and infinity keep their meaning."""
SWEEPS = 10_000
"""Gauss-Seidel sweeps after which a step fails; one or two suffice for a few points."""
TOLERANCE = 1e-13
"""Allowed violation of a rigid contact's condition, and change of a law's depth in a sweep, relative to gaps and their
changes in the step; round-off of sums over points is a hundredth of it."""
DEPENDENT = 1e-14
"""Pivot of W, relative to its diagonal, below which a point depends on others; then sweeps alone find the forces."""
ROUND_OFF = 1e-14
"""Change of a depth in Newton's method, relative to the depths of the step, at which it has converged."""
NEWTON_LIMIT = 200
"""Newton iterations of one depth; about five suffice, and one that leaves the bracket halves it instead."""
CLOSE = 1e-3
"""Relative difference of two depths below which two Gauss points give the mean force to 1e-16."""
SLOWEST = 1e-6
"""Least approach speed of a contact for its damping, relative to the largest so far; grazing contacts use it."""


class Press(NamedTuple):
    """Data and state of the contact of c points; arrays change in place."""

    rigid: bool
    """Whether contact has no law."""
    step: float
    """h [s]."""
    W: np.ndarray
    """Change of gaps in a step per constant force [m/N], (c, c)."""
    law: np.ndarray
    """K, n, χ, c of each point's law, (c, 4)."""
    force: np.ndarray
    """λ̄ of the last step [N], (c,)."""
    depth: np.ndarray
    """−g at its end [m], (c,); with laws."""
    approach: np.ndarray
    """v⁻ of the present contact of each point, then the largest so far [m/s], (c + 1,); with laws."""
    balance: np.ndarray
    """Energy dissipated so far and energy stored by laws [J], iterations, (3,)."""


def new_press(contacts: list[PointContact], W: np.ndarray, gap: np.ndarray, step: float) -> Press:
    """Return the contact of all points at the start.

    Args:
        W: Change of gaps in a step per constant force [m/N], (c, c).
        gap: At the start [m], (c,).
        step: h [s].
    """
    c = len(gap)
    laws = [contact.law for contact in contacts if contact.law is not None]
    law = np.concatenate(laws) if laws else np.zeros((c, 4))
    stored = sum(law_energy(law[i], -gap[i]) for i in range(c))
    return Press(
        rigid=not laws, step=step, W=W.copy(), law=law, force=np.zeros(c), depth=-gap, approach=np.zeros(c + 1),
        balance=np.array([0.0, stored, 0.0]),
    )  # fmt: skip


@compiled()
def press(now, gap, rate, free):  # type: ignore[no-untyped-def]
    """Find λ̄ of a step; returns whether it was found.

    Args:
        now: The Press.
        gap, rate: Gaps [m] and their rates [m/s] at its start, (c,).
        free: Gaps at its end without contact forces [m], (c,).
    """
    return _close(now, gap, rate, free) if now.rigid else _yield(now, free)


@compiled()
def _close(now, gap, rate, free):  # type: ignore[no-untyped-def]
    """Find the forces of rigid contact."""
    force, size = now.force, 0.0
    usable, b = np.empty(len(gap), np.bool_), np.empty(len(gap))
    for i in range(len(gap)):
        usable[i] = force[i] > 0.0 or gap[i] + free[i] <= 0.0
        b[i] = free[i] - gap[i] - 0.5 * now.step * min(rate[i], 0.0)
        if usable[i]:
            size = max(size, abs(free[i] - gap[i]) + 0.5 * now.step * abs(rate[i]))
    if size == 0.0:
        force[:] = 0.0
        return True
    sweeps = complementary(now.W, b, usable, force, TOLERANCE * size)
    now.balance[2] += abs(sweeps)
    for i in range(len(gap)):
        now.balance[0] += max(0.0, -force[i] * (free[i] - gap[i] + _dot(now.W[i], force)))
    return sweeps > 0


@compiled()
def complementary(W, b, usable, force, tolerance):  # type: ignore[no-untyped-def]
    """Solve 0 ≤ λ ⊥ W λ + b ≥ 0; returns the sweeps made, negative where they were not enough.

    Sweeps find which points are pressed, Cholesky's method their forces to round-off. Each lowers ½ λᵀWλ + bᵀλ, so that
    no set of pressed points recurs.

    Args:
        W: Symmetric, positive [m/N], (c, c).
        b: [m], (c,).
        usable: Points that take part, (c,); others have no force on entry and get none.
        force: A guess on entry, λ on exit [N], (c,).
        tolerance: Allowed violation [m].
    """
    for sweep in range(1, SWEEPS + 1):
        change = 0.0
        for i in range(len(b)):
            if usable[i]:
                new = max(0.0, force[i] - (b[i] + _dot(W[i], force)) / W[i, i])
                change = max(change, W[i, i] * abs(new - force[i]))
                force[i] = new
        while _polish(W, b, force, tolerance):
            pass
        if change <= tolerance or _fits(W, b, usable, force, tolerance):
            return sweep
    return -SWEEPS


@compiled()
def _polish(W, b, force, tolerance):  # type: ignore[no-untyped-def]
    """Go from λ towards W λ = −b on the pressed points until one of them is free; returns whether one was."""
    pressed = np.flatnonzero(force)
    n = len(pressed)
    L, found = np.zeros((n, n)), np.empty(n)
    for i in range(n):
        for j in range(i):
            L[i, j] = (W[pressed[i], pressed[j]] - _dot(L[i, :j], L[j, :j])) / L[j, j]
        diagonal = W[pressed[i], pressed[i]]
        pivot = diagonal - _dot(L[i, :i], L[i, :i])
        if pivot <= DEPENDENT * diagonal:
            return False
        L[i, i] = np.sqrt(pivot)
        found[i] = (-b[pressed[i]] - _dot(L[i, :i], found[:i])) / L[i, i]
    freed, share = -1, 1.0
    for i in range(n - 1, -1, -1):
        found[i] = (found[i] - _dot(L[i + 1 :, i], found[i + 1 :])) / L[i, i]
        old = force[pressed[i]]
        if W[pressed[i], pressed[i]] * found[i] < -tolerance and old < share * (old - found[i]):
            freed, share = pressed[i], old / (old - found[i])
    for i in range(n):
        force[pressed[i]] = max(0.0, (1.0 - share) * force[pressed[i]] + share * found[i])
    if freed >= 0:
        force[freed] = 0.0
    return freed >= 0


@compiled()
def _fits(W, b, usable, force, tolerance):  # type: ignore[no-untyped-def]
    """Return whether no gap is negative and no pressed gap is open, to the tolerance."""
    wrong = 0
    for i in range(len(b)):
        if usable[i]:
            gap = b[i] + _dot(W[i], force)
            wrong += gap < -tolerance or (force[i] > 0.0 and gap > tolerance)
    return wrong == 0


@compiled(fastmath=FAST)
def _dot(x, y):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(len(x)):
        total += x[i] * y[i]
    return total


@compiled()
def _yield(now, free):  # type: ignore[no-untyped-def]
    """Find the forces of laws."""
    c, h, force, approach = len(free), now.step, now.force, now.approach
    for i in range(c):
        if now.depth[i] <= 0.0 < -free[i] and approach[i] <= 0.0:
            rate = (-free[i] - now.depth[i]) / h
            approach[c] = max(approach[c], rate)
            approach[i] = max(rate, SLOWEST * approach[c])
    depth, settled = np.empty(c), False
    for _ in range(SWEEPS):
        settled = True
        for i in range(c):
            alone = now.W[i, i] * force[i] - free[i] - _dot(now.W[i], force)
            before = force[i]
            force[i], depth[i], used = _point(now, i, alone)
            now.balance[2] += used
            size = abs(alone) + abs(free[i]) + abs(now.depth[i])
            settled = settled and now.W[i, i] * abs(force[i] - before) <= TOLERANCE * size
        if c == 1 or settled:
            break
    now.balance[1] = 0.0
    for i in range(c):
        lost = (force[i] - _elastic(now.law[i], now.depth[i], depth[i])[0]) * (depth[i] - now.depth[i])
        now.balance[0] += max(
            lost, 0.0
        )  # No law creates energy: an error of the force that does must show as energy drift.
        now.balance[1] += law_energy(now.law[i], depth[i])
        now.depth[i] = depth[i]
        if depth[i] <= 0.0:
            approach[i] = 0.0
    return c == 1 or settled


@compiled()
def _point(now, i, alone):  # type: ignore[no-untyped-def]
    """Solve d + W_ii λ̄(d) = d₀ of one point; returns λ̄ [N], d [m] and the iterations used.

    The force grows with the depth, so that there is one root. Where the force jumps across it, as a dashpot's does when
    a contact begins, the depth is zero and the force is the one that keeps it zero.

    Args:
        alone: d₀, depth at the end of the step under all other forces [m].
    """
    law, before, approach, give = now.law[i], now.depth[i], now.approach[i], now.W[i, i]
    if before <= 0.0 and alone <= 0.0:
        return 0.0, alone, 0
    low, high = alone - give * _mean(law, before, alone, approach, now.step)[0], alone
    d = min(max(alone - give * now.force[i], low), high)
    for used in range(1, NEWTON_LIMIT):
        force, slope = _mean(law, before, d, approach, now.step)
        wrong = d + give * force - alone
        if wrong > 0.0:
            high = d
        else:
            low = d
        change = -wrong / (1.0 + give * slope)
        if abs(change) <= ROUND_OFF * (abs(d) + abs(before)):
            return max(force + slope * change, 0.0), d + change, used
        d += change
        if not low < d < high:
            d = 0.5 * (low + high)
            if high - low <= ROUND_OFF * (abs(d) + abs(before)):
                break
    if low <= 0.0 <= high:
        d = 0.0  # Exactly zero: the sign of a rounded value would decide whether the contact has begun.
    return max((alone - d) / give, 0.0), d, NEWTON_LIMIT


@compiled()
def _mean(law, before, after, approach, h):  # type: ignore[no-untyped-def]
    """Return the mean force between two depths in a step, damping included, and its derivative by the second."""
    elastic, steepness = _elastic(law, before, after)
    rate = (after - before) / h
    per_rate = law[2] / approach if approach > 0.0 else 0.0
    damping = law[3] if before > 0.0 or after > 0.0 else 0.0
    force = elastic * (1.0 + per_rate * rate) + damping * rate
    if force <= 0.0:
        return 0.0, 0.0
    return force, steepness * (1.0 + per_rate * rate) + (elastic * per_rate + damping) / h


@compiled()
def _elastic(law, before, after):  # type: ignore[no-untyped-def]
    """Return the mean of the elastic force between two depths, and its derivative by the second."""
    width = after - before
    if before <= 0.0 and after <= 0.0:
        return 0.0, 0.0
    if abs(width) < CLOSE * min(before, after):
        middle, aside = 0.5 * (before + after), width / np.sqrt(12.0)
        one, slope, _ = law_force(law, middle - aside, 0.0, 1.0)
        two, steeper, _ = law_force(law, middle + aside, 0.0, 1.0)
        return 0.5 * (one + two), 0.25 * (slope + steeper)
    elastic = (law_energy(law, after) - law_energy(law, before)) / width
    return elastic, (law_force(law, after, 0.0, 1.0)[0] - elastic) / width
