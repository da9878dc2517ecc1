"""Which ports share a body, and products with tables of what they do to each other.

Ports that follow each other on the same bodies are a group. Row j of a table holds what port j does to the ports of all
groups that share a body with its own, in the order of their numbers, as a few runs of ports that follow each other:
ports of bodies that are apart do not couple, and take no room.
"""

from typing import NamedTuple

import numpy as np


class Pattern(NamedTuple):
    """Shapes: p ports, G groups, r runs of all groups."""

    at: np.ndarray
    """Place of each row's first value, (p,)."""
    group: np.ndarray
    """Group of each port, in the order of the ports, (p,)."""
    runs: np.ndarray
    """First and last + 1 port of a run, and what is added to a port for its place in the row, (r, 3)."""
    span: np.ndarray
    """First and last + 1 run of each group, (G, 2)."""


def whole(p: int) -> Pattern:
    """Return the pattern of p ports that all couple: rows follow each other, of p values each."""
    return Pattern(p * np.arange(p), np.zeros(p, np.int64), np.array([[0, p, 0]]), np.array([[0, 1]]))
