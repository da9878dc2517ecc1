"""The responses of all candidates of a step together: sweeps over the ports with Anderson's mixing.

A sweep lets every block of ports respond to the measures y = y₀ + M x as they are (Gauss-Seidel), cones under-relaxed
(a projection onto the disc μ fₙ after one onto fₙ ≥ 0). The last sweeps are mixed so that their residuals cancel best
(D. G. Anderson, J. ACM 12 (1965) 547-560); M x is kept up to date, so that a sweep costs one product with M.
"""

import numpy as np

from gudgeon.solver.compiled import entry, inner
from gudgeon.solver.integrators.general.responses import pressed_law, rubbed, spring_force, tabled_force

UNILATERAL, CONE, LAW, RUBBING_LAW, SPRING, BILATERAL, GIVEN = range(7)
"""Values of `ports.table.Kind`, which a compiled function reads as numbers."""
RELAXATION = 0.7
"""Of cones: two trials with the residual flexibility of a part need 40 sweeps with it, 55 at 1."""
WINDOW = 8
"""Sweeps that are mixed."""
MOST_SWEEPS = 600
TOLERANCE = 1e-11
"""Largest change of a force in a sweep, relative to the largest force, at which it was the last."""
STEADY = 1e-13
"""Ridge of the least squares, relative to their largest diagonal."""


@entry
def solve(constants, state, problem):  # type: ignore[no-untyped-def]
    """Find the unknowns x and measures y of all candidates, from x as it is; False where the sweeps do not converge.

    Args:
        problem: y on entry: without the unknowns of the candidates.
    """
    n = problem.size[0]
    x, y, columns = problem.x[:n], problem.y[:n], problem.columns
    for a in range(n):
        if x[a] != 0.0:
            column, amount = columns[a, :n], x[a]
            for c in range(n):
                y[c] += amount * column[c]
    kept, before = 0, 0.0
    for sweep in range(MOST_SWEEPS):
        for a in range(n):
            problem.start[a] = x[a]
        blocks = _sweep(constants, state, problem)
        change, largest, size = 0.0, 0.0, 0.0
        for a in range(n):
            step = abs(x[a] - problem.start[a])
            largest = max(largest, abs(x[a]))
            change = max(change, step)
            size += columns[a, a] * step * step
        state.counts[3] += 1
        if change <= TOLERANCE * largest:
            return True
        if blocks == 1 and constants.size[problem.ports[0]] == 1:
            return True
        if sweep > 0 and size > 4.0 * before:
            kept = 0
        before = size
        kept = _mix(problem, n, kept, sweep)
    return False


@inner
def _sweep(constants, state, problem):  # type: ignore[no-untyped-def]
    """Let every block respond once; returns the number of blocks."""
    n, a, blocks = problem.size[0], 0, 0
    while a < n:
        i = problem.ports[a]
        kind, size = constants.kind[i], constants.size[i]
        blocks += 1
        if kind == BILATERAL:
            _hold(constants, state, problem, i, a)
        else:
            _press(constants, state, problem, i, a)
            if size == 3:
                _rub(constants, state, problem, i, a)
        a += size
    return blocks


@inner
def _change(problem, a, value):  # type: ignore[no-untyped-def]
    """Set an unknown, and all measures by its change."""
    n, change = problem.size[0], value - problem.x[a]
    if change != 0.0:
        column, y = problem.columns[a, :n], problem.y[:n]
        for c in range(n):
            y[c] += change * column[c]
        problem.x[a] = value


@inner
def _press(constants, state, problem, i, a):  # type: ignore[no-untyped-def]
    """Let one port respond along its normal or its line."""
    kind, reach, before = constants.kind[i], problem.columns[a, a], state.displacement[1, i]
    old = problem.x[a]
    free = problem.y[a] - reach * old
    ends = constants.share[i] < 1.0
    if kind in (UNILATERAL, CONE):
        if old == 0.0 and problem.y[a] >= 0.0:
            return
        value = max(0.0, -free / reach)
        if kind == CONE:
            value = max(0.0, old + RELAXATION * (-free / reach - old))
    elif kind == SPRING and constants.table[i, 1] > 0:
        knots = constants.knots[constants.table[i, 0] : constants.table[i, 1]]
        value = tabled_force(constants.law[i], knots, (before, free), reach, constants.dt, ends)
    elif kind == SPRING:
        value = spring_force(constants.law[i], before, free, reach, constants.dt, ends)
    else:
        value = pressed_law(constants.law[i], state.approach[i], (-before, -free), reach, constants.dt, ends)
        if kind == RUBBING_LAW:
            value = max(0.0, old + RELAXATION * (value - old))
    _change(problem, a, value)


@inner
def _rub(constants, state, problem, i, a):  # type: ignore[no-untyped-def]
    """Let the two tangents of a cone respond."""
    normal = problem.x[a]
    if normal <= 0.0:
        _change(problem, a + 1, 0.0)
        _change(problem, a + 2, 0.0)
        return
    columns = problem.columns
    p, r = columns[a + 1, a + 1], columns[a + 2, a + 2]
    s = 0.5 * (columns[a + 1, a + 2] + columns[a + 2, a + 1])
    # The larger eigenvalue of the 2 × 2 block keeps the projection of its step a contraction.
    reach = 0.5 * (p + r) + np.sqrt(0.25 * (p - r) ** 2 + s * s)
    weight = 1.0 / reach if reach > 0.0 else 0.0
    limit = (constants.friction[i, 0] * normal, constants.friction[i, 1] * normal)
    first = problem.x[a + 1] - weight * problem.y[a + 1]
    second = problem.x[a + 2] - weight * problem.y[a + 2]
    first, second, _ = rubbed(limit, state.sliding[i], first, second)
    _change(problem, a + 1, first)
    _change(problem, a + 2, second)


@inner
def _hold(constants, state, problem, i, a):  # type: ignore[no-untyped-def]
    """Hold the distance of a joint's point from its driven point, by a force along the rod's direction in the step."""
    along = state.rod[constants.joint[i]]
    y, columns, length = problem.y, problem.columns, along[2]
    for _turn in range(2):
        size = np.hypot(y[a], y[a + 1])
        n0, n1 = y[a] / size, y[a + 1] / size
        give = n0 * (columns[a, a] * along[0] + columns[a + 1, a] * along[1])
        give += n1 * (columns[a, a + 1] * along[0] + columns[a + 1, a + 1] * along[1])
        force = (length - size) / give
        _change(problem, a, problem.x[a] + force * along[0])
        _change(problem, a + 1, problem.x[a + 1] + force * along[1])


@inner
def _mix(problem, n, kept, sweep):  # type: ignore[no-untyped-def]
    """Mix the last sweeps; returns how many changes are kept.

    The weights minimise ‖r − Σ γ Δr‖ in the norm of the diagonal of M.
    """
    x, y, past, changes, gram, columns = (
        problem.x,
        problem.y,
        problem.past,
        problem.changes,
        problem.gram,
        problem.columns,
    )
    slot = sweep % WINDOW
    for a in range(n):
        residual = (x[a] - problem.start[a]) * np.sqrt(columns[a, a])
        changes[0, slot, a], changes[1, slot, a] = residual - past[0, a], x[a] - past[1, a]
        changes[2, slot, a] = y[a] - past[2, a]
        past[0, a], past[1, a], past[2, a] = residual, x[a], y[a]
    if sweep == 0:
        return 0
    kept = min(kept + 1, WINDOW)
    top = 0.0
    for b in range(kept):
        one = changes[0, (slot - b) % WINDOW, :n]
        for c in range(b + 1):
            other, total = changes[0, (slot - c) % WINDOW, :n], 0.0
            for a in range(n):
                total += one[a] * other[a]
            gram[b, c] = total
        total, residual = 0.0, past[0, :n]
        for a in range(n):
            total += one[a] * residual[a]
        gram[b, WINDOW] = total
        top = max(top, gram[b, b])
    if not top > 0.0:
        return 0
    if not _least_squares(gram, kept, STEADY * top):
        return 0
    for b in range(kept):
        weight, at = gram[b, WINDOW], (slot - b) % WINDOW
        dx, dy = changes[1, at, :n], changes[2, at, :n]
        for a in range(n):
            x[a] -= weight * dx[a]
            y[a] -= weight * dy[a]
    return kept


@inner
def _least_squares(gram, kept, ridge):  # type: ignore[no-untyped-def]
    """Solve (G + ridge) γ = b in place by Cholesky's factor; γ replaces b, the last column. False if G is singular."""
    for b in range(kept):
        for c in range(b + 1):
            total = gram[b, c] + (ridge if b == c else 0.0)
            for d in range(c):
                total -= gram[b, d] * gram[c, d]
            if b == c:
                if not total > 0.0:
                    return False
                gram[b, b] = np.sqrt(total)
            else:
                gram[b, c] = total / gram[c, c]
    for b in range(kept):
        total = gram[b, WINDOW]
        for d in range(b):
            total -= gram[b, d] * gram[d, WINDOW]
        gram[b, WINDOW] = total / gram[b, b]
    for b in range(kept - 1, -1, -1):
        total = gram[b, WINDOW]
        for d in range(b + 1, kept):
            total -= gram[d, b] * gram[d, WINDOW]
        gram[b, WINDOW] = total / gram[b, b]
    return True
