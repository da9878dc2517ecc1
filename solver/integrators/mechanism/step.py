"""Coefficients of Dormand and Prince's method of order 8, by which `core/turning/explicit.hpp` takes a step.

Coefficients are those of DOP853 (Hairer, Nørsett, Wanner, Solving ODE I, II.5 and II.10), which scipy has.
"""

from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853

ORDER = 8
MAIN = 12
"""Stages of a step; the next one is the first of the step that follows."""


class Tableau(NamedTuple):
    """Coefficients of a step of 12 stages, of the 13th at its end, and of 3 more for interpolation."""

    inner: np.ndarray
    """Weights of earlier slopes at each stage, (16, 16)."""
    end: np.ndarray
    """(12,)"""
    fifth: np.ndarray
    """Of the error of an embedded method of order 5, (13,)."""
    third: np.ndarray
    """(13,)"""
    dense: np.ndarray
    """(4, 16)"""


def tableau() -> tuple[Tableau, np.ndarray]:
    """Return the coefficients, and the times of the 16 stages over the step."""
    weights = np.zeros((16, 16))
    weights[:12, :12] = DOP853.A[:12, :12]
    weights[12, :12] = DOP853.B
    weights[13:, :] = DOP853.A_EXTRA
    times = np.concatenate([DOP853.C[:12], [1.0], DOP853.C_EXTRA])
    arrays = (weights, DOP853.B, DOP853.E5, DOP853.E3, DOP853.D)
    return Tableau(*(np.ascontiguousarray(one, float) for one in arrays)), times


class Course(NamedTuple):
    """What a step is taken with: arrays that are written anew before it."""

    table: Tableau
    given: np.ndarray
    """Drives at the times of the stages, (16, d, 3)."""
    amounts: np.ndarray
    """Loads at these times, (16, l)."""
    weight: np.ndarray
    """Of the error of each number, of a spin that of the angular velocity, (13 n + SUMS,)."""
    project: bool
    """Whether stages are projected, too: near positions in which joints depend on each other."""


class Call(NamedTuple):
    """What tells a step from others with the same course."""

    time: float
    """Of its start [s]."""
    project: bool
