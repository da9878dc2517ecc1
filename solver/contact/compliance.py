"""The compliance matrix of a contact problem, computed row by row on demand, and the products of a step.

Where bodies slide over a traction space the matrix is base + N M Nᵀ with weights N that move; a row is computed when
its point first becomes active in an era, and an era ends when the weights have moved too far.
"""

from typing import NamedTuple

import numpy as np

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
