"""Exact motion of undamped coordinates: free, and from rest under forces ÿ + ω² y = Σ α_m τ^m."""

from functools import cache
from math import factorial

import numpy as np

from gudgeon.solver import core

TERMS = 9
"""Number of terms of the series; the next one is below 1e-19 of the first."""


def responses(omega: np.ndarray, degree: int, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return displacement and velocity under forces τ^m, m = 0 … degree, at times [s] (t,), each (degree + 1, t, n).

    Args:
        omega: [rad/s], (n,), zero for coordinates without stiffness.
    """
    place, rate = _coefficients(degree)
    late, speed = np.ascontiguousarray(time, float), np.ascontiguousarray(omega, float)
    y, v = np.empty((2, degree + 1, len(late), len(speed)))
    core.polynomial_responses(speed, late, place, rate, y, v)
    return y, v


@cache
def _coefficients(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the coefficients of the series of displacement and velocity, (degree + 1, TERMS) each."""
    place, rate = np.empty((2, degree + 1, TERMS))
    for m in range(degree + 1):
        for j in range(TERMS):
            place[m, j] = factorial(m) / factorial(m + 2 + 2 * j)
            rate[m, j] = factorial(m) / factorial(m + 1 + 2 * j)
    return place, rate


def free(omega: np.ndarray, time: np.ndarray | float) -> np.ndarray:
    """Return y←y, y←ẏ, ẏ←y, ẏ←ẏ of free coordinates, omega [rad/s] (n,), over times [s] (t,) or one: (4, [t,] n)."""
    late = np.asarray(time, float)[..., None]
    x = omega * late
    cosine = np.cos(x)
    return np.array([cosine, late * np.sinc(x / np.pi), -omega * np.sin(x), cosine])
