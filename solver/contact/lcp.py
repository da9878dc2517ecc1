"""The linear complementarity problem of frictionless contact: 0 ≤ λ ⊥ g + C λ ≥ 0, C symmetric positive definite.

Block principal pivoting (Júdice & Pires 1994) with Murty's single pivot against cycles, warm-started from the
last active set. The active block's Cholesky factor is kept and changed row by row, so an unchanged set costs two
triangular solves. R couples points with either sign: a force at one point can close its neighbour, so every candidate
is checked at every solve, except those of contacts that are proved to stay open.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.compiled import copy, entry, inner
from gudgeon.solver.contact.compliance import Listed, combine, prepare

PATIENCE = 3
"""Block pivots without fewer infeasible rows before single pivots take over."""
SINGULAR = 1e-14
"""A new pivot below this share of its diagonal means dependent contact rows."""


class ActiveSet(NamedTuple):
    """The closed rows of a contact problem, kept from solve to solve."""

    rows: np.ndarray
    """Numbers of the closed rows, in the first `size` entries, (c,)."""
    size: np.ndarray
    """Number of closed rows, (1,)."""
    factor: np.ndarray
    """Lower Cholesky factor of C[rows, rows], (c, c)."""


def empty_set(c: int) -> ActiveSet:
    """Return the active set of c rows that are all open."""
    return ActiveSet(np.zeros(c, np.int64), np.zeros(1, np.int64), np.zeros((c, c)))


@entry
def solve_lcp(matrix, g, active, multipliers, gaps, tolerance):  # type: ignore[no-untyped-def]
    """Compute the contact forces λ ≥ 0 [N] that keep all gaps ≥ 0, over the rows of candidate contacts.

    Args:
        matrix: The Compliance C [m/N], (c, c).
        g: Free gaps [m], (c,).
        active: The ActiveSet to start from; changed in place.
        multipliers: λ [N] on exit, (c,).
        gaps: g + C λ [m] on exit, (c,).
        tolerance: Allowed violation of a gap [m].

    Returns:
        Number of rows opened and closed; −1 where C is singular.
    """
    _evaluate(matrix, g, active, multipliers, gaps)
    if _fits(matrix, active, multipliers, gaps, tolerance):
        return 0
    return _pivot(matrix, g, active, multipliers, gaps, tolerance)


@inner
def _fits(matrix, active, multipliers, gaps, tolerance):  # type: ignore[no-untyped-def]
    """Whether no gap, active ones included, and no active multiplier is below −tolerance."""
    for a in range(active.size[0]):
        i = active.rows[a]
        if multipliers[i] < -tolerance / matrix.values[i, i]:
            return False
    closed = 0
    for k in range(len(matrix.block)):
        if matrix.candidate[k]:
            own = gaps[matrix.block[k, 0] : matrix.block[k, 1]]
            for i in range(len(own)):
                closed += own[i] < -tolerance
    return closed == 0


@inner
def _pivot(matrix, g, active, multipliers, gaps, tolerance):  # type: ignore[no-untyped-def]
    """Change the active set until gaps and multipliers fit; returns the number of changes, −1 where C is singular."""
    c, C = len(g), matrix.values
    is_active, is_candidate = np.zeros(c, np.bool_), np.zeros(c, np.bool_)
    for a in range(active.size[0]):
        is_active[active.rows[a]] = True
    for k in range(len(matrix.block)):
        is_candidate[matrix.block[k, 0] : matrix.block[k, 1]] = matrix.candidate[k]
    fewest, patience, pivots = c + 1, PATIENCE, 0
    while True:
        violated, last = 0, -1
        for i in range(c):
            # Rows that are not active may not be computed yet; only active ones need their diagonal.
            wrong = multipliers[i] < -tolerance / C[i, i] if is_active[i] else is_candidate[i] and gaps[i] < -tolerance
            if wrong:
                violated += 1
                last = i
        if violated == 0:
            return pivots
        if violated < fewest:
            fewest, patience, single = violated, PATIENCE, False
        elif patience > 0:
            patience, single = patience - 1, False
        else:
            single = True
        for i in range(last if single else 0, last + 1):
            if is_active[i]:
                if multipliers[i] < -tolerance / C[i, i]:
                    remove(active, i)
                    is_active[i] = False
                    pivots += 1
            elif is_candidate[i] and gaps[i] < -tolerance:
                if not append(matrix, active, i):
                    return -1
                is_active[i] = True
                pivots += 1
        _evaluate(matrix, g, active, multipliers, gaps)


@inner
def _evaluate(matrix, g, active, multipliers, gaps):  # type: ignore[no-untyped-def]
    """Set λ on the active set from L Lᵀ λ = −g, then all gaps of candidate contacts."""
    rows, count, L = active.rows, active.size[0], active.factor
    multipliers[:] = 0.0
    y = np.empty(count)
    for a in range(count):
        total = -g[rows[a]]
        for b in range(a):
            total -= L[a, b] * y[b]
        y[a] = total / L[a, a]
    for a in range(count - 1, -1, -1):
        y[a] /= L[a, a]
        for b in range(a):
            y[b] -= L[a, b] * y[a]
        multipliers[rows[a]] = y[a]
    for k in range(len(matrix.block)):
        if matrix.candidate[k]:
            first, last = matrix.block[k, 0], matrix.block[k, 1]
            copy(g[first:last], gaps[first:last])
            combine(matrix.values, Listed(rows, y, count), 1.0, first, last, gaps)


@inner
def append(matrix, active, row):  # type: ignore[no-untyped-def]
    """Add a row to the active set and to its Cholesky factor; returns False where it depends on the others."""
    prepare(matrix, row)
    C, rows, count, L = matrix.values, active.rows, active.size[0], active.factor
    pivot = C[row, row]
    for a in range(count):
        total = C[row, rows[a]]
        for b in range(a):
            total -= L[a, b] * L[count, b]
        L[count, a] = total / L[a, a]
        pivot -= L[count, a] ** 2
    if pivot <= SINGULAR * C[row, row]:
        return False
    L[count, count] = np.sqrt(pivot)
    rows[count] = row
    active.size[0] = count + 1
    return True


@inner
def remove(active, row):  # type: ignore[no-untyped-def]
    """Take a row out of the active set and update its factor by Givens rotations."""
    rows, count, L, place = active.rows, active.size[0], active.factor, 0
    while rows[place] != row:
        place += 1
    for a in range(place, count - 1):
        rows[a] = rows[a + 1]
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
    active.size[0] = count
