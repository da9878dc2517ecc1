"""The linear complementarity problem of frictionless contact: 0 ≤ λ ⊥ g + C (λ − μ) ≥ 0, C symmetric positive definite.

Block principal pivoting (Júdice & Pires 1994) with Murty's single pivot against cycles, warm-started from the
last active set. The active block's Cholesky factor is kept and changed row by row, so an unchanged set costs two
triangular solves. Each row of it begins where it is not zero: late, where the contacts of many bodies stand in the
order of their bodies. Once rows that were added later have made it much longer, it is made anew in that order.
R couples points with either sign: a force at one point can close its neighbour, so every candidate
is checked at every solve, except those of contacts that are proved to stay open. Gaps may be given at forces μ that are
expected, zero but on closed rows: where the matrix is of an earlier era, only the change from them meets it.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.compiled import copy, entry, inner
from gudgeon.solver.contact.compliance import Listed, prepare
from gudgeon.solver.contact.pattern import between, combine_rows

PATIENCE = 3
"""Block pivots without fewer infeasible rows before single pivots take over."""
SMALL, GROWN = 4096, 2
"""Entries of the factor up to which its order does not matter, and growth since it was ordered after which it does."""
SINGULAR = 1e-14
"""A new pivot below this share of its diagonal means dependent contact rows."""


class ActiveSet(NamedTuple):
    """The closed rows of a contact problem, kept from solve to solve."""

    rows: np.ndarray
    """Numbers of the closed rows, in the first `size` entries, (c,)."""
    size: np.ndarray
    """Number of closed rows, entries of the factor from where its rows begin, and the same when it was last ordered,
    (3,)."""
    begin: np.ndarray
    """First column of each row of the factor that is not zero, (c,)."""
    factor: np.ndarray
    """Lower Cholesky factor of C[rows, rows], row after row, (c (c + 1) / 2,)."""
    amounts: np.ndarray
    """λ of the closed rows [N], (c,)."""
    turns: np.ndarray
    """Cosines and sines of rotations, (2, c)."""
    expected: np.ndarray
    """μ [N], (c,)."""
    closed: np.ndarray
    """Whether each row is closed, and whether its gap is computed, (2, c)."""


def empty_set(c: int) -> ActiveSet:
    """Return the active set of c rows that are all open."""
    return ActiveSet(
        rows=np.zeros(c, np.int64), size=np.zeros(3, np.int64), begin=np.zeros(c, np.int64),
        factor=np.zeros(c * (c + 1) // 2), amounts=np.zeros(c), turns=np.zeros((2, c)),
        expected=np.zeros(c), closed=np.zeros((2, c), np.bool_),
    )  # fmt: skip


@entry
def solve_lcp(matrix, g, active, multipliers, gaps, tolerance):  # type: ignore[no-untyped-def]
    """Compute the contact forces λ ≥ 0 [N] that keep all gaps ≥ 0, over the rows of candidate contacts.

    Args:
        matrix: The Compliance C [m/N] of c rows.
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
    pivots = _pivot(matrix, g, active, multipliers, gaps, tolerance)
    if active.size[1] > max(SMALL, GROWN * active.size[2]) and not _order(matrix, active):
        return -1
    return pivots


@inner
def _fits(matrix, active, multipliers, gaps, tolerance):  # type: ignore[no-untyped-def]
    """Whether no gap, active ones included, and no active multiplier is below −tolerance."""
    for a in range(active.size[0]):
        i = active.rows[a]
        if _pulls(matrix, multipliers, i, tolerance):
            return False
    closed = 0
    for k in range(len(matrix.block)):
        if matrix.candidate[k]:
            own = gaps[matrix.block[k, 0] : matrix.block[k, 1]]
            for i in range(len(own)):
                closed += own[i] < -tolerance
    return closed == 0


@inner
def _pulls(matrix, multipliers, i, tolerance):  # type: ignore[no-untyped-def]
    """Whether the multiplier of a closed row is below −tolerance."""
    return multipliers[i] < 0.0 and multipliers[i] < -tolerance / between(matrix.pattern, matrix.values, i, i)


@inner
def _pivot(matrix, g, active, multipliers, gaps, tolerance):  # type: ignore[no-untyped-def]
    """Change the active set until gaps and multipliers fit; returns the number of changes, −1 where C is singular."""
    c = len(g)
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
            if is_active[i]:
                wrong = _pulls(matrix, multipliers, i, tolerance)
            else:
                wrong = is_candidate[i] and gaps[i] < -tolerance
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
                if _pulls(matrix, multipliers, i, tolerance):
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
        active.rows[active.size[0]], active.amounts[0] = row, -amount
        one = Listed(active.rows[active.size[0] :], active.amounts, 1)
        for k in range(len(matrix.block)):
            if matrix.candidate[k]:
                combine_rows(matrix.pattern, matrix.values, one, matrix.block[k, 0], matrix.block[k, 1], g)


@inner
def _evaluate(matrix, g, active, multipliers, gaps):  # type: ignore[no-untyped-def]
    """Set λ on the active set from L Lᵀ (λ − μ) = −g, then all gaps of candidate contacts."""
    rows, count, L, begin = active.rows, active.size[0], active.factor, active.begin
    multipliers[:] = 0.0
    y = active.amounts
    for a in range(count):
        total, first, own = -g[rows[a]], begin[a], a * (a + 1) // 2
        row, known = L[own + first : own + a], y[first:a]
        for b in range(len(known)):
            total -= row[b] * known[b]
        y[a] = total / L[own + a]
    for a in range(count - 1, -1, -1):
        first, own = begin[a], a * (a + 1) // 2
        y[a] /= L[own + a]
        row, known, amount = L[own + first : own + a], y[first:a], y[a]
        for b in range(len(known)):
            known[b] -= row[b] * amount
        multipliers[rows[a]] = active.expected[rows[a]] + y[a]
    for k in range(len(matrix.block)):
        if matrix.candidate[k]:
            first, last = matrix.block[k, 0], matrix.block[k, 1]
            copy(g[first:last], gaps[first:last])
            combine_rows(matrix.pattern, matrix.values, Listed(rows, y, count), first, last, gaps)


@inner
def append(matrix, active, row):  # type: ignore[no-untyped-def]
    """Add a row to the active set and to its Cholesky factor; returns False where it depends on the others."""
    prepare(matrix, row)
    rows, count, L, begin = active.rows, active.size[0], active.factor, active.begin
    pattern, values, at, first = matrix.pattern, matrix.values, count * (count + 1) // 2, count
    diagonal = pivot = between(pattern, values, row, row)
    for a in range(count):
        total = between(pattern, values, row, rows[a])
        if first == count:
            if total == 0.0:
                continue
            first = a
        begins = max(first, begin[a])
        other, own = L[a * (a + 1) // 2 + begins : a * (a + 1) // 2 + a], L[at + begins : at + a]
        for b in range(len(own)):
            total -= other[b] * own[b]
        L[at + a] = total / L[a * (a + 1) // 2 + a]
        pivot -= L[at + a] ** 2
    if pivot <= SINGULAR * diagonal:
        return False
    L[at + count] = np.sqrt(pivot)
    rows[count], begin[count] = row, first
    active.size[0] = count + 1
    active.size[1] += count + 1 - first
    return True


@inner
def _order(matrix, active):  # type: ignore[no-untyped-def]
    """Make the factor anew with the rows in the order of their numbers; returns False where they depend on others."""
    rows, count = active.rows, active.size[0]
    for a in range(1, count):
        row, place = rows[a], a
        while place > 0 and rows[place - 1] > row:
            rows[place] = rows[place - 1]
            place -= 1
        rows[place] = row
    active.size[0] = active.size[1] = 0
    for a in range(count):
        if not append(matrix, active, rows[a]):
            return False
    active.size[2] = active.size[1]
    return True


@inner
def remove(active, row):  # type: ignore[no-untyped-def]
    """Take a row out of the active set; the later rows' part of the factor takes up its column by Givens rotations.

    Each later row is turned with all rows before it, so that what is zero before it begins stays so.
    """
    rows, count, L, begin, place = active.rows, active.size[0], active.factor, active.begin, 0
    cos, sin = active.turns[0], active.turns[1]
    while rows[place] != row:
        place += 1
    active.size[1] -= place + 1 - begin[place]
    for a in range(place + 1, count):
        here, there, first, new = a * (a + 1) // 2, a * (a - 1) // 2, begin[a], a - 1
        right = L[here + place] if first <= place else 0.0
        for b in range(first, place):
            L[there + b] = L[here + b]
        for b in range(max(first - 1, place), new + 1):
            L[there + b] = L[here + b + 1]
        rows[new], begin[new] = rows[a], first if first <= place else first - 1
        active.size[1] -= 1 if first <= place else 0
        for b in range(max(begin[new], place), new):
            left = L[there + b]
            L[there + b] = cos[b] * left + sin[b] * right
            right = cos[b] * right - sin[b] * left
        own = L[there + new]
        r = np.hypot(own, right)
        cos[new], sin[new], L[there + new] = own / r, right / r, r
    active.size[0] = count - 1
