"""The matrix of a contact problem, row by row as it is asked for.

Where bodies slide over a traction space the matrix is base + N M Nᵀ with weights N that move; a row is made when its
point first becomes active in an era, and an era ends when the weights have moved too far.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

FAST = {"reassoc", "contract"}
"""Sums may be reordered for vector units; NaN and infinity keep their meaning."""


inner = njit(cache=True, fastmath=FAST, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[call-overload]
"""For functions that only compiled ones call: no wrapper for the interpreter, which takes longest to compile."""


class Compliance(NamedTuple):
    """Shapes: c rows, k contacts, F functions of all traction spaces."""

    values: np.ndarray
    """[m/N], (c, c); row i is valid where stamp[i] is the era."""
    base: np.ndarray
    """What does not move [m/N], (c, c)."""
    stamp: np.ndarray
    """(c,)"""
    era: np.ndarray
    """(1,)"""
    master: np.ndarray
    """M, compliance of the functions [m/N], (F, F)."""
    contact: np.ndarray
    """Contact of each row, (c,)."""
    space: np.ndarray
    """Of each contact: first function, functions across, functions along; no functions where nothing slides, (k, 3)."""
    place: np.ndarray
    """First function across of each row, and along at this era, negative outside of the space, (c, 2)."""
    across: np.ndarray
    """Spline values across of each row, (c, 4)."""
    along: np.ndarray
    """Spline values along of each row at this era, (c, 4)."""
    window: np.ndarray
    """First and last + 1 function along that any row touches at this era, (k, 2)."""
    scratch: np.ndarray
    """(F,)"""


def fixed(matrix: np.ndarray) -> Compliance:
    """Return a matrix that does not move."""
    c = len(matrix)
    whole, none = np.zeros(c, np.int64), np.zeros((0, 0))
    return Compliance(
        matrix, matrix, whole, np.zeros(1, np.int64), none, whole, np.zeros((1, 3), np.int64),
        np.full((c, 2), -1), np.zeros((c, 4)), np.zeros((c, 4)), np.zeros((1, 2), np.int64), np.zeros(0),
    )  # fmt: skip


@inner
def prepare(matrix, i):  # type: ignore[no-untyped-def]
    """Make row i valid."""
    if matrix.stamp[i] == matrix.era[0]:
        return
    row, base, place, space = matrix.values[i], matrix.base[i], matrix.place, matrix.space
    row[:] = base
    matrix.stamp[i] = matrix.era[0]
    if place[i, 1] < 0:
        return
    image, master, contact, along, across = matrix.scratch, matrix.master, matrix.contact, matrix.along, matrix.across
    image[:] = 0.0
    own = contact[i]
    for b in range(4):
        for a in range(4):
            f = space[own, 0] + (place[i, 1] + b) * space[own, 1] + place[i, 0] + a
            weight = along[i, b] * across[i, a]
            source = master[f]
            for k in range(len(space)):
                first = space[k, 0] + matrix.window[k, 0] * space[k, 1]
                last = space[k, 0] + matrix.window[k, 1] * space[k, 1]
                for g in range(first, last):
                    image[g] += weight * source[g]
    gather(matrix.space, contact, place, across, along, image, 1.0, row)


@inner
def gather(space, contact, place, across, along, field, sign, out):  # type: ignore[no-untyped-def]
    """Add sign · N field to `out`, (c,): the field of functions at every point, nothing beyond its space."""
    # Scalars only: a slice of an array costs more than the sixteen products.
    for i in range(len(out)):
        if place[i, 1] >= 0:
            k = contact[i]
            f = space[k, 0] + place[i, 1] * space[k, 1] + place[i, 0]
            total = 0.0
            for b in range(4):
                part = across[i, 0] * field[f] + across[i, 1] * field[f + 1]
                part += across[i, 2] * field[f + 2] + across[i, 3] * field[f + 3]
                total += along[i, b] * part
                f += space[k, 1]
            out[i] += sign * total
