"""Multipliers of constraint rows that may depend on each other: a factor that reveals the rank, and least norm."""

import numpy as np

from gudgeon.solver.compiled import inner

INDEPENDENT = 1e-12
"""Square of the sine of the least angle, in the metric of the inertia, between a row and those before it."""
APART = 1e-6
"""The same up to which rows are factored without pivots."""


@inner
def factor(model, work):  # type: ignore[no-untyped-def]
    """Scale S to a diagonal of about one and factor it, S = L Lᵀ; sets scale, order, begin and rank.

    Within the envelope of S where this is cheaper and no row is near to depend on others, or else by pivots on the
    diagonal.
    """
    if work.within[0] == 0 or not _factor_within(model, work):
        _factor_by_pivots(model, work)


@inner
def _factor_within(model, work):  # type: ignore[no-untyped-def]
    """Factor S within its envelope, in the order of the model; False where a pivot is below `APART`."""
    S, L, order, begin, scale = work.matrix, work.lower, work.order, work.begin, work.scale
    m, least = len(order), 1.0
    for i in range(m):
        row, first = model.envelope[i, 0], model.envelope[i, 1]
        order[i], begin[i], work.end[i] = row, first, model.envelope[i, 2]
        if not 0.0 < S[row, row] < np.inf:
            return False
        scale[row] = np.sqrt(S[row, row])
        pivot = 1.0
        for j in range(first, i):
            total = S[row, order[j]] / (scale[row] * scale[order[j]])
            for k in range(max(first, begin[j]), j):
                total -= L[i, k] * L[j, k]
            L[i, j] = total / L[j, j]
            pivot -= L[i, j] * L[i, j]
        if not pivot > APART:
            return False
        least = min(least, pivot)
        L[i, i] = np.sqrt(pivot)
    work.least[0] = min(work.least[0], least)
    work.rank[0] = m
    return True


@inner
def _factor_by_pivots(model, work):  # type: ignore[no-untyped-def]
    """Factor S by pivots on the diagonal.

    Rows of one joint along axes at right angles are scaled alike, so that least norms do not depend on these axes. One
    that the others imply leaves a pivot of round-off; it and those after it are left out. The least pivot that is kept,
    the square of the sine of an angle between rows, lowers `least`. Where S is infinite, of bodies far from their
    joints, all multipliers become NaN, which ends the step.
    """
    S, L, order, left, scale = work.matrix, work.lower, work.order, work.left, work.scale
    m, sums, whole = len(order), work.spare[1], 0.0
    for i in range(m):
        sums[i] = 0.0
        whole += S[i, i]
    for i in range(m):
        sums[model.group[i, 0]] += S[i, i] / model.group[i, 1]
    for i in range(m):
        mean = sums[model.group[i, 0]]
        scale[i] = np.sqrt(mean) if mean > 0 else 1.0
        order[i], work.begin[i], work.end[i] = i, 0, m
    if not whole < np.inf:
        work.rank[0] = m
        for i in range(m):
            L[i, i] = np.nan
        return
    for i in range(m):
        for j in range(i):
            S[i, j] /= scale[i] * scale[j]
            S[j, i] = S[i, j]
        S[i, i] /= scale[i] * scale[i]
        left[i] = 1.0 if S[i, i] > 0 else 0.0
    rank = 0
    for k in range(m):
        best = k
        for i in range(k + 1, m):
            if left[i] > left[best]:
                best = i
        if not left[best] > INDEPENDENT:
            break
        rank += 1
        if left[best] < work.least[0]:
            work.least[0] = left[best]
        if best != k:
            order[k], order[best] = order[best], order[k]
            left[k], left[best] = left[best], left[k]
            for l in range(k):
                L[k, l], L[best, l] = L[best, l], L[k, l]
        pivot = np.sqrt(left[k] * S[order[k], order[k]])
        L[k, k] = pivot
        for i in range(k + 1, m):
            total = S[order[i], order[k]]
            for l in range(k):
                total -= L[i, l] * L[k, l]
            L[i, k] = total / pivot
            if left[i] > 0.0:
                left[i] -= L[i, k] * L[i, k] / S[order[i], order[i]]
    work.rank[0] = rank


@inner
def solve(work):  # type: ignore[no-untyped-def]
    """Set multipliers that satisfy S λ = right on independent rows; those left out have none."""
    L, order, scale, right, found, y = work.lower, work.order, work.scale, work.right, work.multiplier, work.spare[0]
    r = work.rank[0]
    for i in range(r):
        total = right[order[i]] / scale[order[i]]
        for k in range(work.begin[i], i):
            total -= L[i, k] * y[k]
        y[i] = total / L[i, i]
    for i in range(len(order)):
        found[order[i]] = 0.0
    for step in range(r):
        i = r - 1 - step
        total = y[i]
        for k in range(i + 1, min(work.end[i], r)):
            if work.begin[k] <= i:
                total -= L[k, i] * y[k]
        y[i] = total / L[i, i]
        found[order[i]] = y[i] / scale[order[i]]


@inner
def solve_least(work):  # type: ignore[no-untyped-def]
    """Set the multipliers of least norm that satisfy S λ = right: λ = L (LᵀL)⁻² Lᵀ right, rows scaled as by `factor`.

    The norm is that of λ_i times the scale of its row, a root of S, whose unit is the same for forces and moments. Of
    independent rows λ is unique.
    """
    if work.rank[0] == len(work.order):
        solve(work)
        return
    L, N, order, scale = work.lower, work.small, work.order, work.scale
    right, found, y, m, r = work.right, work.multiplier, work.spare[0], len(work.order), work.rank[0]
    for i in range(r):
        for j in range(i + 1):
            total = 0.0
            for k in range(i, m):
                total += L[k, i] * L[k, j]
            N[i, j] = total
        total = 0.0
        for k in range(i, m):
            total += L[k, i] * right[order[k]] / scale[order[k]]
        y[i] = total
    for i in range(r):
        for j in range(i + 1):
            total = N[i, j]
            for k in range(j):
                total -= N[i, k] * N[j, k]
            N[i, j] = total / N[j, j] if i > j else np.sqrt(total)
    for _ in range(2):
        for i in range(r):
            total = y[i]
            for k in range(i):
                total -= N[i, k] * y[k]
            y[i] = total / N[i, i]
        for step in range(r):
            i = r - 1 - step
            total = y[i]
            for k in range(i + 1, r):
                total -= N[k, i] * y[k]
            y[i] = total / N[i, i]
    for k in range(m):
        total = 0.0
        for i in range(min(k + 1, r)):
            total += L[k, i] * y[i]
        found[order[k]] = total / scale[order[k]]
