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
