"""The linear complementarity problem of frictionless contact: 0 ≤ λ ⊥ g + C (λ − μ) ≥ 0, C symmetric positive definite.

Block principal pivoting (Júdice & Pires 1994) with Murty's single pivot against cycles, warm-started from the
last active set. The active block's Cholesky factor is kept and changed row by row, so an unchanged set costs two
triangular solves. R couples points with either sign: a force at one point can close its neighbour, so every candidate
is checked at every solve, except those of contacts that are proved to stay open. Gaps may be given at forces μ that are
expected, zero but on closed rows: where the matrix is of an earlier era, only the change from them meets it.
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
    """Lower Cholesky factor of C[rows, rows], row after row, (c (c + 1) / 2,)."""
    amounts: np.ndarray
    """λ of the closed rows [N], (c,)."""
    expected: np.ndarray
    """μ [N], (c,)."""
    closed: np.ndarray
    """Whether each row is closed, and whether its gap is computed, (2, c)."""


def empty_set(c: int) -> ActiveSet:
    """Return the active set of c rows that are all open."""
    return ActiveSet(
        rows=np.zeros(c, np.int64), size=np.zeros(1, np.int64), factor=np.zeros(c * (c + 1) // 2), amounts=np.zeros(c),
        expected=np.zeros(c), closed=np.zeros((2, c), np.bool_),
    )  # fmt: skip


@entry
def solve_lcp(matrix, g, active, multipliers, gaps, tolerance):  # type: ignore[no-untyped-def]
    """Compute the contact forces λ ≥ 0 [N] that keep all gaps ≥ 0, over the rows of candidate contacts.

    Args:
        matrix: The Compliance C [m/N], (c, c).
        g: Gaps under the forces μ [m], (c,); changed with μ where a row with one opens.
        active: The ActiveSet to start from; changed in place.
        multipliers: λ [N] on exit, (c,).
        gaps: g + C (λ − μ) [m] on exit, (c,).
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
    is_active, is_candidate = active.closed[0], active.closed[1]
    active.closed[:] = False
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
                    drop_expected(matrix, g, active, i)
            elif is_candidate[i] and gaps[i] < -tolerance:
                if not append(matrix, active, i):
                    return -1
                is_active[i] = True
                pivots += 1
        _evaluate(matrix, g, active, multipliers, gaps)


@inner
def drop_expected(matrix, g, active, row):  # type: ignore[no-untyped-def]
    """Take what is expected of a row that opened off the gaps [m]."""
    amount = active.expected[row]
    if amount != 0.0:
        active.expected[row] = 0.0
        for k in range(len(matrix.block)):
            if matrix.candidate[k]:
                source, target = matrix.values[row], g[matrix.block[k, 0] : matrix.block[k, 1]]
                source = source[matrix.block[k, 0] : matrix.block[k, 1]]
                for i in range(len(target)):
                    target[i] -= amount * source[i]


@inner
def _evaluate(matrix, g, active, multipliers, gaps):  # type: ignore[no-untyped-def]
    """Set λ on the active set from L Lᵀ (λ − μ) = −g, then all gaps of candidate contacts."""
    rows, count, L = active.rows, active.size[0], active.factor
    multipliers[:] = 0.0
    y = active.amounts
    for a in range(count):
        total, row = -g[rows[a]], L[a * (a + 1) // 2 : (a + 1) * (a + 2) // 2]
        for b in range(a):
            total -= row[b] * y[b]
        y[a] = total / row[a]
    for a in range(count - 1, -1, -1):
        row = L[a * (a + 1) // 2 : (a + 1) * (a + 2) // 2]
        y[a] /= row[a]
        amount = y[a]
        for b in range(a):
            y[b] -= row[b] * amount
        multipliers[rows[a]] = active.expected[rows[a]] + y[a]
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
    pivot, own = C[row, row], L[count * (count + 1) // 2 : (count + 1) * (count + 2) // 2]
    for a in range(count):
        total, other = C[row, rows[a]], L[a * (a + 1) // 2 : (a + 1) * (a + 2) // 2]
        for b in range(a):
            total -= other[b] * own[b]
        own[a] = total / other[a]
        pivot -= own[a] ** 2
    if pivot <= SINGULAR * C[row, row]:
        return False
    own[count] = np.sqrt(pivot)
    rows[count] = row
    active.size[0] = count + 1
    return True


@inner
def remove(active, row):  # type: ignore[no-untyped-def]
    """Take a row out of the active set; the later rows' part of the factor takes up its column by Givens rotations."""
    rows, count, L, column, place = active.rows, active.size[0], active.factor, active.amounts, 0
    while rows[place] != row:
        place += 1
    for a in range(place + 1, count):
        here, there = a * (a + 1) // 2, a * (a - 1) // 2
        column[a - 1] = L[here + place]
        rows[a - 1] = rows[a]
        for b in range(place):
            L[there + b] = L[here + b]
        for b in range(place, a):
            L[there + b] = L[here + b + 1]
    count -= 1
    for a in range(place, count):
        own = a * (a + 1) // 2 + a
        r = np.hypot(L[own], column[a])
        cos, sin = L[own] / r, column[a] / r
        L[own] = r
        for b in range(a + 1, count):
            at = b * (b + 1) // 2 + a
            left, right = L[at], column[b]
            L[at] = cos * left + sin * right
            column[b] = cos * right - sin * left
    active.size[0] = count
