"""Contact forces at fixed points within one step of the midpoint rule, compiled, by solvers of this package alone.

    g⁺ = free + W λ̄,   W = Σ G_b W_b G_bᵀ over the bodies

Of the solver that this is the reference of, only the formulas of the contact laws are shared. With laws λ̄ is the mean
of the elastic force over the depths passed in the step, (V(d⁺) − V(d))/(d⁺ − d), damping beside it, so that an elastic
law keeps energy. Where nothing yields but the bodies (Signorini, the mass of the nodes in the step) a point closes when
its gap half-way through the step would be negative, and stays closed as long as it is pressed:

    0 ≤ λ̄ ⊥ ġ⁺ + max(ġ, 0) ≥ 0,   ġ⁺ = 2 (g⁺ − g)/h − ġ

(Moreau and Jean's rule with θ = ½ and no restitution, V. Acary, Z. Angew. Math. Mech. 96 (2016) 585-603, but for the
maximum.) Its work h λ̄ (ġ + ġ⁺)/2 is never positive: a closing loses what the mass that W sees in one step had, which
goes to zero with step and mesh, and a closed point none. Constraints on gaps would let closed nodes swing for ever.
Either way the forces are found point by point (Gauss-Seidel); W is symmetric and positive, so that this converges.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.nodal.problem import PointContact
from gudgeon.solver.compiled import compiled
from gudgeon.solver.laws.force import law_energy, law_force

FAST = {"reassoc", "contract"}
"""Sums may be reordered; NaN and infinity keep their meaning."""
SWEEPS = 10_000
"""Gauss-Seidel sweeps over the points before a step fails; one or two suffice for a few points."""
TOLERANCE = 1e-13
"""Violation of a rigid contact's condition, or change of a law's depth in a sweep, that counts as none, relative to
gaps and their changes in the step; round-off of sums over points is a hundredth of it."""
DEPENDENT = 1e-14
"""Pivot of W, relative to its diagonal, below which a point depends on others and sweeps alone find the forces."""
ROUND_OFF = 1e-14
"""Change of a depth in Newton's method, relative to the depths of its step, at which it is found."""
NEWTON_LIMIT = 200
"""Far above the five or so that a depth takes; each that leaves the bracket halves it instead."""
CLOSE = 1e-3
"""Relative difference of two depths below which two Gauss points give the mean force, to 1e-16."""
SLOWEST = 1e-6
"""Least approach speed of a contact, relative to the largest so far: what grazes loses as if it came at that."""


class Press(NamedTuple):
    """What the contact of c points needs and remembers; arrays change in place."""

    rigid: bool
    """Whether nothing yields but the bodies."""
    step: float
    """h [s]."""
    W: np.ndarray
    """Change of gaps in a step per constant force [m/N], (c, c)."""
    law: np.ndarray
    """K, n, χ, c of each point's law, (c, 4)."""
    force: np.ndarray
    """λ̄ of the last step [N], (c,)."""
    depth: np.ndarray
    """−g at its end [m], (c,); of laws."""
    approach: np.ndarray
    """v⁻ of the contact that goes on at each point, and the largest so far [m/s], (c + 1,); of laws."""
    balance: np.ndarray
    """What contact took so far, what its laws store now [J], iterations, (3,)."""


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
    balance = np.array([0.0, stored, 0.0])
    return Press(not laws, step, W.copy(), law, np.zeros(c), -gap, np.zeros(c + 1), balance)


@compiled()
def press(now, gap, rate, free):  # type: ignore[no-untyped-def]
    """Find λ̄ of a step; False where it could not be found.

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
    no set of pressed points comes twice.

    Args:
        W: Symmetric, positive [m/N], (c, c).
        b: [m], (c,).
        usable: Points that take part, (c,); others have no force on entry and get none.
        force: A guess on entry, λ on exit [N], (c,).
        tolerance: Violation that counts as none [m].
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
    """Whether no gap is closed too far and no pressed one is open."""
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
        now.balance[0] += max(lost, 0.0)  # No law gives energy: what a wrong force would create shall show as drift.
        now.balance[1] += law_energy(now.law[i], depth[i])
        now.depth[i] = depth[i]
        if depth[i] <= 0.0:
            approach[i] = 0.0
    return c == 1 or settled


@compiled()
def _point(now, i, alone):  # type: ignore[no-untyped-def]
    """Solve d + W_ii λ̄(d) = d₀ of one point; returns λ̄ [N], d [m] and the iterations used.

    The force grows with the depth, so that there is one root. Where the force jumps over it, as that of a dashpot does
    when a contact begins, the point stays on the edge of contact and bears what holds it there.

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
        d = 0.0  # Not what round-off makes of it: its sign says whether the contact has begun.
    return max((alone - d) / give, 0.0), d, NEWTON_LIMIT


@compiled()
def _mean(law, before, after, approach, h):  # type: ignore[no-untyped-def]
    """Return the mean force of a step between two depths, what is lost included, and its derivative by the second."""
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
