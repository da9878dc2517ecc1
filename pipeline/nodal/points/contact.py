"""Contact at fixed points within one step of the midpoint rule, compiled; the solver's laws, multipliers constant.

    g⁺ = free + W λ̄,   W = Σ G_b W_b G_bᵀ over the bodies

With laws λ̄ is the discrete gradient of their potential, damping beside it, as the solver's integrator of that name has
it: an elastic law keeps energy. Where nothing yields but the bodies (Signorini, the mass of the nodes in the step) a
point closes when its gap half-way through the step would be negative, and stays closed as long as it is pressed:

    0 ≤ λ̄ ⊥ ġ⁺ + max(ġ, 0) ≥ 0,   ġ⁺ = 2 (g⁺ − g)/h − ġ

(Moreau and Jean's rule with θ = ½ and no restitution, V. Acary, Z. Angew. Math. Mech. 96 (2016) 585-603, but for the
maximum.) Its work h λ̄ (ġ + ġ⁺)/2 is never positive: a closing loses what the mass that W sees in one step had, which
goes to zero with step and mesh, and a closed point none. Constraints on gaps would let closed nodes swing for ever.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from gudgeon.pipeline.nodal.problem import PointContact
from gudgeon.solver.contact.compliance import Compliance, fixed
from gudgeon.solver.contact.lcp import ActiveSet, empty_set, solve_lcp
from gudgeon.solver.contact.pairing import facing
from gudgeon.solver.integrators.discrete_gradient.kernel import State, Step, find_forces, quotient
from gudgeon.solver.integrators.uncoupled import SLOWEST
from gudgeon.solver.laws.force import law_energy

__all__ = ["Press", "facing", "new_press", "press"]

TOLERANCE = 1e-13
"""Of a gap, relative to the largest change of one in a step."""


class Press(NamedTuple):
    """What the contact of c points needs and remembers."""

    rigid: bool
    """Whether nothing yields but the bodies."""
    step: Step
    """`reach` is W [m/N], (c, c)."""
    state: State
    """`force` is λ̄ [N], (c,)."""
    matrix: Compliance
    active: ActiveSet
    """The closed points, with W's factor on them."""
    books: np.ndarray
    """What contact took so far, what its laws store now [J], iterations, (3,)."""


def new_press(contacts: list[PointContact], W: np.ndarray, gap: np.ndarray, step: float) -> Press:
    """Return the contact of all points at the start.

    Args:
        W: Change of gaps in a step per constant force [m/N], (c, c).
        gap: At the start [m], (c,).
        step: h [s].
    """
    c, none = len(gap), np.zeros(0)
    laws = [contact.law for contact in contacts if contact.law is not None]
    law = np.concatenate([np.zeros((0, 4)), *laws]) if laws else np.zeros((c, 4))
    running, energies = np.full((c, 7), -1.0), np.zeros(5)
    constants = Step(step, np.zeros((4, 0)), np.zeros((2, 0)), none, np.zeros((c, 0)), gap, W, law, SLOWEST, none, none)
    state = State(
        none, none, -gap, np.zeros(c), np.zeros(c), energies, np.zeros(3, np.int64), running, np.zeros((0, 8)),
        np.zeros(c),
    )  # fmt: skip
    books = np.zeros(3)
    books[1] = sum(law_energy(law[i], -gap[i]) for i in range(c))
    return Press(
        not laws, constants, state, fixed(W.copy()), empty_set(c), books,
    )  # fmt: skip


@njit(cache=True)
def press(now, gap, rate, free):  # type: ignore[no-untyped-def]
    """Find λ̄ of a step; False where it could not be found.

    Args:
        now: The Press.
        gap, rate: Gaps [m] and their rates [m/s] at its start, (c,).
        free: Gaps at its end without contact forces [m], (c,).
    """
    return _close(now, gap, rate, free) if now.rigid else _yield(now, free)


@njit(cache=True)
def _yield(now, free):  # type: ignore[no-untyped-def]
    state, law = now.state, now.step.law
    depth, before = np.empty(len(free)), state.tally[1]
    sound = find_forces(now.step, state, free, depth)
    now.books[1] = 0.0
    for i in range(len(free)):
        change = depth[i] - state.depth[i]
        lost = (state.force[i] - quotient(law[i], state.depth[i], depth[i])) * change
        if lost > 0.0:  # No law gives energy: what a wrong force would create shall show as drift.
            now.books[0] += lost
        state.depth[i] = depth[i]
        if depth[i] <= 0.0:
            state.approach[i] = 0.0
        now.books[1] += law_energy(law[i], depth[i])
    now.books[2] += state.tally[1] - before
    return sound


@njit(cache=True)
def _close(now, gap, rate, free):  # type: ignore[no-untyped-def]
    c, h, force = len(gap), now.step.dt, now.state.force
    near, floor, gaps = np.full(c, np.inf), np.empty(c), np.empty(c)
    largest = 0.0
    for i in range(c):
        floor[i] = gap[i] + 0.5 * h * min(rate[i], 0.0)
        if gap[i] + free[i] <= 0.0:
            near[i] = free[i] - floor[i]
    for a in range(now.active.size[0]):
        i = now.active.rows[a]
        near[i] = free[i] - floor[i]
    for i in range(c):
        if near[i] < np.inf:
            largest = max(largest, abs(free[i] - gap[i]) + 0.5 * h * abs(rate[i]))
    force[:] = 0.0
    if largest == 0.0:
        return True
    pivots = solve_lcp(now.matrix, near, now.active, force, gaps, TOLERANCE * largest)
    now.books[2] += abs(pivots)
    for i in range(c):
        force[i] = max(force[i], 0.0)
        change = free[i] - gap[i]
        for j in range(c):
            change += now.step.reach[i, j] * force[j]
        now.books[0] += max(0.0, -force[i] * change)
    return pivots >= 0
