"""Points and rows of which a mechanism is built."""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.integrators.turning.arrays import NONE


class Point(NamedTuple):
    """A point of a body or the ground."""

    owner: int
    """Number of its body, `NONE` of the ground."""
    arm: np.ndarray
    """From the centre of the undeformed body, or a place in the scene [m], (3,)."""
    rows: np.ndarray = np.zeros((6, 0))
    """Displacement and rotation per elastic coordinate, (6, m)."""
    bend: np.ndarray = np.zeros((6, 0, 0))
    """Their second order, (6, m, m)."""
    drive: int = NONE
    """First of the three drives that move a point of the ground from its arm."""


class Row(NamedTuple):
    """One constraint: Σ factor · term = constant + drive."""

    joint: str
    terms: tuple[tuple[int, float], ...]
    constant: float = 0.0
    drive: int = NONE
    length: bool = False
    """Whether its unit is m."""
