"""Rows and residual flexibility of ports as the loop over ports takes them, shapes as of `arrays`."""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.contact.pattern import Pattern


class Rows(NamedTuple):
    """W by bodies: the coordinates of at most two bodies in each row."""

    first: np.ndarray
    last: np.ndarray
    """Range of coordinates of each part, (p, 2)."""
    at: np.ndarray
    """Its place among the values, (p, 2)."""
    values: np.ndarray


class Residual(NamedTuple):
    """R of ports."""

    pattern: Pattern
    """That of all tables."""
    values: np.ndarray
    """Displacement of port i, in its row, by sides of ports [m/N], (s, t)."""
    turned: np.ndarray
    """What sides of port j, in its row, do to ports [m/N], (s, t); empty unless points slide."""
