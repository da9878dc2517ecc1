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
    inverse: np.ndarray
    """One over each diagonal entry of the factor, (c,)."""
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
        factor=np.zeros(c * (c + 1) // 2), inverse=np.zeros(c), amounts=np.zeros(c), turns=np.zeros((2, c)),
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
        violated, first, last = 0, c, -1
        for a in range(active.size[0]):
            i = active.rows[a]
            if _pulls(matrix, multipliers, i, tolerance):
                violated, first, last = violated + 1, min(first, i), max(last, i)
        for i in range(c):
            # Rows that are not active may not be computed yet. Without a branch, which could not be foreseen.
            wrong = is_candidate[i] & (not is_active[i]) & (gaps[i] < -tolerance)
            violated += wrong
            first, last = min(first, i if wrong else c), max(last, i if wrong else -1)
        if violated == 0:
            return pivots
        if violated < fewest:
            fewest, patience, single = violated, PATIENCE, False
        elif patience > 0:
            patience, single = patience - 1, False
        else:
            single = True
        for i in range(last if single else first, last + 1):
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
    rows, count, y = active.rows, active.size[0], active.amounts
    multipliers[:] = 0.0
    for a in range(count):
        y[a] = -g[rows[a]]
    _solve_forward(active, 0)
    _solve_backward(active)
    for a in range(count):
        multipliers[rows[a]] = active.expected[rows[a]] + y[a]
    for k in range(len(matrix.block)):
        if matrix.candidate[k]:
            first, last = matrix.block[k, 0], matrix.block[k, 1]
            copy(g[first:last], gaps[first:last])
            combine_rows(matrix.pattern, matrix.values, Listed(rows, y, count), first, last, gaps)


@inner
def _alike(begin, a, count):  # type: ignore[no-untyped-def]
    """Whether four rows of a factor from a on begin at one column: they are solved for together."""
    return a + 4 <= count and begin[a] == begin[a + 1] and begin[a] == begin[a + 2] and begin[a] == begin[a + 3]


@inner
def _solve_forward(active, start):  # type: ignore[no-untyped-def]
    """Set the amounts y, zero before `start`, to the solution of L x = y."""
    L, begin, y, over = active.factor, active.begin, active.amounts, active.inverse
    count, a = active.size[0], start
    while a < count:
        first, p = begin[a], a * (a + 1) // 2
        known, one, row = y[first:a], y[a], L[p + first : p + a]
        if not _alike(begin, a, count):
            for b in range(len(known)):
                one -= row[b] * known[b]
            y[a] = one * over[a]
            a += 1
            continue
        q, r, s = p + a + 1, p + 2 * a + 3, p + 3 * a + 6
        two, three, four = y[a + 1], y[a + 2], y[a + 3]
        second, third, fourth = L[q + first : q + a], L[r + first : r + a], L[s + first : s + a]
        for b in range(len(known)):
            one -= row[b] * known[b]
            two -= second[b] * known[b]
            three -= third[b] * known[b]
            four -= fourth[b] * known[b]
        one *= over[a]
        two = (two - L[q + a] * one) * over[a + 1]
        three = (three - L[r + a] * one - L[r + a + 1] * two) * over[a + 2]
        four = (four - L[s + a] * one - L[s + a + 1] * two - L[s + a + 2] * three) * over[a + 3]
        y[a], y[a + 1], y[a + 2], y[a + 3] = one, two, three, four
        a += 4


@inner
def _solve_backward(active):  # type: ignore[no-untyped-def]
    """Set the amounts y to the solution of Lᵀ x = y."""
    L, begin, y, over = active.factor, active.begin, active.amounts, active.inverse
    a = active.size[0]
    while a > 0:
        if a < 4 or not _alike(begin, a - 4, a):
            a -= 1
            first, p = begin[a], a * (a + 1) // 2
            y[a] *= over[a]
            row, known, one = L[p + first : p + a], y[first:a], y[a]
            for b in range(len(known)):
                known[b] -= row[b] * one
            continue
        a -= 4
        first, p = begin[a], a * (a + 1) // 2
        q, r, s = p + a + 1, p + 2 * a + 3, p + 3 * a + 6
        four = y[a + 3] * over[a + 3]
        three = (y[a + 2] - L[s + a + 2] * four) * over[a + 2]
        two = (y[a + 1] - L[s + a + 1] * four - L[r + a + 1] * three) * over[a + 1]
        one = (y[a] - L[s + a] * four - L[r + a] * three - L[q + a] * two) * over[a]
        y[a], y[a + 1], y[a + 2], y[a + 3] = one, two, three, four
        row, second, known = L[p + first : p + a], L[q + first : q + a], y[first:a]
        third, fourth = L[r + first : r + a], L[s + first : s + a]
        for b in range(len(known)):
            known[b] -= (row[b] * one + second[b] * two) + (third[b] * three + fourth[b] * four)


@inner
def append(matrix, active, row):  # type: ignore[no-untyped-def]
    """Add a row to the active set and to its Cholesky factor; returns False where it depends on the others."""
    prepare(matrix, row)
    rows, count, L, y = active.rows, active.size[0], active.factor, active.amounts
    at, first = count * (count + 1) // 2, count
    diagonal = pivot = between(matrix.pattern, matrix.values, row, row)
    for a in range(count):
        y[a] = between(matrix.pattern, matrix.values, row, rows[a])
        if first == count and y[a] != 0.0:
            first = a
    _solve_forward(active, first)
    for a in range(first, count):
        L[at + a] = y[a]
        pivot -= y[a] ** 2
    if pivot <= SINGULAR * diagonal:
        return False
    L[at + count] = np.sqrt(pivot)
    rows[count], active.begin[count], active.inverse[count] = row, first, 1.0 / L[at + count]
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
        rows[new], begin[new] = rows[a], first if first <= place else first - 1
        active.size[1] -= 1 if first <= place else 0
        if first < place:
            copy(L[here + first : here + place], L[there + first : there + place])
        start = max(begin[new], place)
        part, moved = L[there + start : there + new], L[here + start + 1 : here + a]
        turned, across = cos[start:new], sin[start:new]
        for b in range(len(part)):
            left = moved[b]
            part[b] = turned[b] * left + across[b] * right
            right = turned[b] * right - across[b] * left
        own = L[here + a]
        r = np.sqrt(own * own + right * right)
        active.inverse[new] = 1.0 / r
        cos[new], sin[new], L[there + new] = own / r, right / r, r
    active.size[0] = count - 1
