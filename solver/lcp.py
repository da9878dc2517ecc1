"""The linear complementarity problem of frictionless contact: 0 ≤ λ ⊥ g + C λ ≥ 0, C symmetric positive definite.

Block principal pivoting (Júdice & Pires 1994) with Murty's single pivot as its way out of cycles, warm-started from
the last active set. The active block's Cholesky factor is kept and changed row by row, so an unchanged set costs two
triangular solves. R couples points with either sign: pressing one can close its neighbour, so every candidate is
checked at every solve.
"""

import numpy as np
from numba import njit

from solver.compliance import FAST, inner, prepare

PATIENCE = 3
"""Block pivots without fewer infeasible rows before single pivots take over."""
SINGULAR = 1e-14
"""A new pivot below this share of its diagonal means dependent contact rows."""


@njit(cache=True, fastmath=FAST)
def solve_lcp(matrix, g, active, count, L, multipliers, gaps, tolerance):  # type: ignore[no-untyped-def]
    """Solve in place.

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
    c, C = len(g), matrix.values
    is_active = np.zeros(c, np.bool_)
    for a in range(count):
        is_active[active[a]] = True
    fewest, patience, pivots = c + 1, PATIENCE, 0
    while True:
        _evaluate(C, g, active, count, L, multipliers, gaps)
        worst, last = 0, -1
        for i in range(c):
            # Rows that are not active may not have been made yet; only active ones need their diagonal.
            wrong = multipliers[i] < -tolerance / C[i, i] if is_active[i] else gaps[i] < -tolerance
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
            elif gaps[i] < -tolerance:
                if not append(matrix, active, count, L, i):
                    return count, -1
                count += 1
                is_active[i] = True
                pivots += 1


@inner
def _evaluate(C, g, active, count, L, multipliers, gaps):  # type: ignore[no-untyped-def]
    """λ on the active set from L Lᵀ λ = −g, then all gaps."""
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
    gaps[:] = g
    for a in range(count):
        i = active[a]
        multipliers[i] = y[a]
        for j in range(len(g)):
            gaps[j] += C[i, j] * y[a]


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
