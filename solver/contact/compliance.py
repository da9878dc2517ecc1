"""The compliance matrix of a contact problem, computed row by row on demand, and the products of a step.

Where bodies slide over a traction space the matrix is base + N M Nᵀ with weights N that move; a row is computed when
its point first becomes active in an era, and an era ends when the weights have moved too far.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.compiled import copy, inner
from gudgeon.solver.contact.pattern import Pattern, whole

ONE, TWO, THREE = np.uint64(1), np.uint64(2), np.uint64(3)


class Compliance(NamedTuple):
    """Shapes: c rows, k contacts, F functions of all traction spaces."""

    pattern: Pattern
    """Which rows couple; all where contacts slide."""
    values: np.ndarray
    """A table over them [m/N]; row i is valid where stamp[i] is the era."""
    base: np.ndarray
    """Constant part [m/N], (c, c)."""
    stamp: np.ndarray
    """(c,)"""
    era: np.ndarray
    """(1,)"""
    master: np.ndarray
    """M, compliance of the functions [m/N], (F, F)."""
    block: np.ndarray
    """First and last + 1 row of each contact, (k, 2)."""
    candidate: np.ndarray
    """Whether points of each contact may touch in this step, (k,); gaps of other contacts are not computed."""
    space: np.ndarray
    """Of each contact: first function, functions across, functions along; zero without sliding, (k, 3)."""
    corner: np.ndarray
    """First function that each row touches at this era, negative outside of the space, (c,)."""
    across: np.ndarray
    """Spline values across of each row, (c, 4)."""
    along: np.ndarray
    """Spline values along of each row at this era, (4, c)."""
    known: np.ndarray
    """Whether rows of this era have the columns of each contact, (k,)."""
    window: np.ndarray
    """First and last + 1 function along that any row touches at this era, (k, 2)."""
    scratch: np.ndarray
    """(F,)"""
    touched: np.ndarray
    weights: np.ndarray
    """Functions that a row touches, and their weights, (16,)."""


class Listed(NamedTuple):
    """A sparse vector: the numbers and amounts of its entries that are not zero."""

    numbers: np.ndarray
    amounts: np.ndarray
    size: int
    """Number of entries in use."""


def fixed(matrix: np.ndarray) -> Compliance:
    """Return a constant compliance matrix [m/N], (c, c), of one contact."""
    return coupled(whole(len(matrix)), np.ascontiguousarray(matrix).ravel())


def coupled(pattern: Pattern, values: np.ndarray) -> Compliance:
    """Return a constant compliance matrix of one contact, a table [m/N]."""
    c = len(pattern.at)
    return Compliance(
        pattern=pattern, values=values, base=np.zeros((0, 0)), stamp=np.zeros(c, np.int64), era=np.zeros(1, np.int64),
        master=np.zeros((0, 0)),
        block=np.array([[0, c]]), candidate=np.ones(1, np.bool_), space=np.zeros((1, 3), np.int64),
        corner=np.full(c, -1), across=np.zeros((c, 4)), along=np.zeros((4, c)), known=np.ones(1, np.bool_),
        window=np.zeros((1, 2), np.int64), scratch=np.zeros(0), touched=np.zeros(16, np.int64), weights=np.zeros(16),
    )  # fmt: skip


@inner
def combine(matrix, listed, share, first, last, out):  # type: ignore[no-untyped-def]
    """Add share · Σₙ amounts[n] · matrix[numbers[n]] to `out`, in columns first to last − 1."""
    numbers, amounts, count = listed
    # Slices: an index from a range that does not begin at 0 could be negative, which prevents vectorisation.
    target = out[first:last]
    size, n = len(target), 0
    while n + 4 <= count:
        a, b = matrix[numbers[n], first:last], matrix[numbers[n + 1], first:last]
        c, d = matrix[numbers[n + 2], first:last], matrix[numbers[n + 3], first:last]
        p, q, r, s = share * amounts[n], share * amounts[n + 1], share * amounts[n + 2], share * amounts[n + 3]
        for i in range(size):
            target[i] += (p * a[i] + q * b[i]) + (r * c[i] + s * d[i])
        n += 4
    while n < count:
        a, p = matrix[numbers[n], first:last], share * amounts[n]
        for i in range(size):
            target[i] += p * a[i]
        n += 1


@inner
def window(matrix, k):  # type: ignore[no-untyped-def]
    """Return the first and last + 1 function in the window of a contact."""
    first, across = matrix.space[k, 0], matrix.space[k, 1]
    return first + matrix.window[k, 0] * across, first + matrix.window[k, 1] * across


@inner
def prepare(matrix, i):  # type: ignore[no-untyped-def]
    """Compute row i of the matrix, in the columns of contacts that are known, if it is not valid in this era."""
    if matrix.stamp[i] != matrix.era[0]:
        matrix.stamp[i] = matrix.era[0]
        for k in range(len(matrix.space)):
            if matrix.known[k]:
                _prepare_part(matrix, i, k)


@inner
def _prepare_part(matrix, i, k):  # type: ignore[no-untyped-def]
    """Compute row i of the matrix in the columns of contact k."""
    space, corner, along, across = matrix.space, matrix.corner, matrix.along, matrix.across
    first, last, at = matrix.block[k, 0], matrix.block[k, 1], matrix.pattern.at[i]
    copy(matrix.base[i, first:last], matrix.values[at + first : at + last])
    if corner[i] < 0:
        return
    response, numbers, weights, own = matrix.scratch, matrix.touched, matrix.weights, 0
    while matrix.block[own, 1] <= i:
        own += 1
    for b in range(4):
        for a in range(4):
            numbers[4 * b + a] = corner[i] + b * space[own, 1] + a
            weights[4 * b + a] = along[b, i] * across[i, a]
    first, last = window(matrix, k)
    response[first:last] = 0.0
    combine(matrix.master, Listed(numbers, weights, 16), 1.0, first, last, response)
    gather(matrix, k, corner, along, response, matrix.values[at : at + len(corner)])


@inner
def gather(matrix, k, corner, along, field, out):  # type: ignore[no-untyped-def]
    """Add N field to `out`, (c,): the field of functions at the points of contact k, zero outside of its space."""
    first, last, width = matrix.block[k, 0], matrix.block[k, 1], np.uint64(matrix.space[k, 1])
    corners, across, target = corner[first:last], matrix.across[first:last], out[first:last]
    p, q, r, s = along[0, first:last], along[1, first:last], along[2, first:last], along[3, first:last]
    for i in range(len(target)):
        if corners[i] >= 0:
            # Unsigned, which cannot be negative, so that four functions across are one vector.
            e = np.uint64(corners[i])
            f, g, h = e + width, e + width + width, e + width + width + width
            w = p[i] * field[e] + q[i] * field[f] + r[i] * field[g] + s[i] * field[h]
            x = p[i] * field[e + ONE] + q[i] * field[f + ONE] + r[i] * field[g + ONE] + s[i] * field[h + ONE]
            y = p[i] * field[e + TWO] + q[i] * field[f + TWO] + r[i] * field[g + TWO] + s[i] * field[h + TWO]
            z = p[i] * field[e + THREE] + q[i] * field[f + THREE] + r[i] * field[g + THREE] + s[i] * field[h + THREE]
            target[i] += across[i, 0] * w + across[i, 1] * x + across[i, 2] * y + across[i, 3] * z
