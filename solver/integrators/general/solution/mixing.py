"""Anderson's mixing of the last sweeps (D. G. Anderson, J. ACM 12 (1965) 547-560)."""

import numpy as np

from gudgeon.solver.compiled import copy, inner

WINDOW = 8
"""Sweeps that are mixed."""
STEADY = 1e-13
"""Ridge of the least squares, relative to their largest diagonal."""


@inner
def mix(problem, n, sweep):  # type: ignore[no-untyped-def]
    """Mix the last sweeps; returns how many changes are kept.

    The weights minimise ‖r − Σ γ Δr‖ in the norm of the diagonal of M.
    """
    x, y, changes, products, gram = problem.x[:n], problem.y[:n], problem.changes, problem.products, problem.gram
    slot, residual = sweep % WINDOW, problem.past[0, :n]
    _subtract(x, problem.past[1, :n], changes[1, slot, :n])
    _subtract(y, problem.past[2, :n], changes[2, slot, :n])
    change, start, weight = changes[0, slot, :n], problem.start[:n], problem.weight[:n]
    for a in range(n):
        now = (x[a] - start[a]) * weight[a]
        change[a] = now - residual[a]
        residual[a] = now
    if sweep == 0:
        return 0
    kept = min(problem.size[4] + 1, WINDOW)
    for b in range(kept):
        other = (slot - b) % WINDOW
        products[slot, other] = products[other, slot] = _product(change, changes[0, other, :n])
    top = 0.0
    for b in range(kept):
        one = (slot - b) % WINDOW
        for c in range(b + 1):
            gram[b, c] = products[one, (slot - c) % WINDOW]
        gram[b, WINDOW] = _product(changes[0, one, :n], residual)
        top = max(top, gram[b, b])
    if not top > 0.0:
        return 0
    if not _least_squares(gram, kept, STEADY * top):
        return 0
    for b in range(kept):
        share, at = gram[b, WINDOW], (slot - b) % WINDOW
        dx, dy = changes[1, at, :n], changes[2, at, :n]
        for a in range(n):
            x[a] -= share * dx[a]
        for a in range(n):
            y[a] -= share * dy[a]
    return kept


@inner
def _subtract(now, past, difference):  # type: ignore[no-untyped-def]
    """Set a difference, and the past to what is now."""
    for a in range(len(now)):
        difference[a] = now[a] - past[a]
    copy(now, past)


@inner
def _product(one, other):  # type: ignore[no-untyped-def]
    """Return the scalar product of two vectors."""
    total = 0.0
    for a in range(len(one)):
        total += one[a] * other[a]
    return total


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
