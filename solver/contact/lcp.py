"""The linear complementarity problem of frictionless contact: 0 ≤ λ ⊥ g + C λ ≥ 0, C symmetric positive definite.

Block principal pivoting (Júdice & Pires 1994) with Murty's single pivot as its way out of cycles, warm-started from
the last active set. The active block's Cholesky factor is kept and changed row by row, so an unchanged set costs two
triangular solves. R couples points with either sign: pressing one can close its neighbour, so every candidate is
checked at every solve, but for those of contacts that are proved to stay open.
"""

import numpy as np
from numba import njit

from gudgeon.solver.compiled import FAST, inner
from gudgeon.solver.contact.compliance import combine, prepare

PATIENCE = 3
"""Block pivots without fewer infeasible rows before single pivots take over."""
SINGULAR = 1e-14
"""A new pivot below this share of its diagonal means dependent contact rows."""


@njit(cache=True, fastmath=FAST)
def solve_lcp(matrix, g, active, count, L, multipliers, gaps, tolerance):  # type: ignore[no-untyped-def]
    """Solve in place, over the rows of contacts that are near.

    Args:
        matrix: The Compliance C [m/N], (c, c).
        g: Free gaps [m], (c,).
        active: Rows of the active set, its first `count` entries; changed in place, (c,).
        count: Size of the active set on entry.
        L: Lower Cholesky factor of C[active, active] on entry and exit, (c, c).
        multipliers: λ [N] on exit, (c,).
        gaps: g + C λ [m] on exit, (c,).
        tolerance: Violation of a gap that counts as none [m].

    Returns:
        (size of the active set, pivots made); pivots is -1 where C proved singular.
    """
    _evaluate(matrix, g, active, count, L, multipliers, gaps)
    if _fits(matrix, active, count, multipliers, gaps, tolerance):
        return count, 0
    return _pivot(matrix, g, active, count, L, multipliers, gaps, tolerance)


@inner
def _fits(matrix, active, count, multipliers, gaps, tolerance):  # type: ignore[no-untyped-def]
    """Whether no gap is closed too far, active ones included, and no active multiplier pulls."""
    for a in range(count):
        i = active[a]
        if multipliers[i] < -tolerance / matrix.values[i, i]:
            return False
    closed = 0
    for k in range(len(matrix.block)):
        if matrix.near[k]:
            own = gaps[matrix.block[k, 0] : matrix.block[k, 1]]
            for i in range(len(own)):
                closed += own[i] < -tolerance
    return closed == 0


@inner
def _pivot(matrix, g, active, count, L, multipliers, gaps, tolerance):  # type: ignore[no-untyped-def]
    """Change the active set until it fits."""
    c, C = len(g), matrix.values
    is_active, is_near = np.zeros(c, np.bool_), np.zeros(c, np.bool_)
    for a in range(count):
        is_active[active[a]] = True
    for k in range(len(matrix.block)):
        is_near[matrix.block[k, 0] : matrix.block[k, 1]] = matrix.near[k]
    fewest, patience, pivots = c + 1, PATIENCE, 0
    while True:
        worst, last = 0, -1
        for i in range(c):
            # Rows that are not active may not have been made yet; only active ones need their diagonal.
            wrong = multipliers[i] < -tolerance / C[i, i] if is_active[i] else is_near[i] and gaps[i] < -tolerance
            if wrong:
                worst += 1
                last = i
        if worst == 0:
            return count, pivots
        if worst < fewest:
            fewest, patience, single = worst, PATIENCE, False
        elif patience > 0:
            patience, single = patience - 1, False
        else:
            single = True
        for i in range(last if single else 0, last + 1):
            if is_active[i]:
                if multipliers[i] < -tolerance / C[i, i]:
                    count = _remove(active, count, L, i)
                    is_active[i] = False
                    pivots += 1
            elif is_near[i] and gaps[i] < -tolerance:
                if not append(matrix, active, count, L, i):
                    return count, -1
                count += 1
                is_active[i] = True
                pivots += 1
        _evaluate(matrix, g, active, count, L, multipliers, gaps)


@inner
def _evaluate(matrix, g, active, count, L, multipliers, gaps):  # type: ignore[no-untyped-def]
    """λ on the active set from L Lᵀ λ = −g, then all gaps of contacts that are near."""
    multipliers[:] = 0.0
    y = np.empty(count)
    for a in range(count):
        total = -g[active[a]]
        for b in range(a):
            total -= L[a, b] * y[b]
        y[a] = total / L[a, a]
    for a in range(count - 1, -1, -1):
        y[a] /= L[a, a]
        for b in range(a):
            y[b] -= L[a, b] * y[a]
        multipliers[active[a]] = y[a]
    for k in range(len(matrix.block)):
        if matrix.near[k]:
            first, last = matrix.block[k, 0], matrix.block[k, 1]
            gaps[first:last] = g[first:last]
            combine(matrix.values, active, y, count, 1.0, first, last, gaps)


@inner
def append(matrix, active, count, L, row):  # type: ignore[no-untyped-def]
    """Add a row to the active set and to its Cholesky factor; False where it depends on the others."""
    prepare(matrix, row)
    C = matrix.values
    pivot = C[row, row]
    for a in range(count):
        total = C[row, active[a]]
        for b in range(a):
            total -= L[a, b] * L[count, b]
        L[count, a] = total / L[a, a]
        pivot -= L[count, a] ** 2
    if pivot <= SINGULAR * C[row, row]:
        return False
    L[count, count] = np.sqrt(pivot)
    active[count] = row
    return True


@inner
def _remove(active, count, L, row):  # type: ignore[no-untyped-def]
    """Take a row out of the active set and mend the factor with Givens rotations; returns the new size."""
    place = 0
    while active[place] != row:
        place += 1
    for a in range(place, count - 1):
        active[a] = active[a + 1]
        for b in range(a + 2):
            L[a, b] = L[a + 1, b]
    count -= 1
    for a in range(place, count):
        r = np.hypot(L[a, a], L[a, a + 1])
        cos, sin = L[a, a] / r, L[a, a + 1] / r
        for b in range(a, count):
            left, right = L[b, a], L[b, a + 1]
            L[b, a] = cos * left + sin * right
            L[b, a + 1] = cos * right - sin * left
        L[a, a + 1] = 0.0
    return count
