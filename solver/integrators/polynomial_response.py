"""Exact motion of undamped coordinates: free, and from rest under forces ÿ + ω² y = Σ α_m τ^m."""

from functools import cache
from math import factorial

import numpy as np

from gudgeon.solver.compiled import compiled

SMALL = 0.5
"""ωτ up to which the power series is used; above it the closed form loses less than three digits."""
TERMS = 9
"""Number of terms of the series; the next one is below 1e-19 of the first."""


_inner = compiled(no_cpython_wrapper=True, no_cfunc_wrapper=True)
"""As `compiled.inner`, but sums keep their order: the series is summed to the last digit."""


def responses(omega: np.ndarray, degree: int, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return displacement and velocity under forces τ^m, m = 0 … degree, at times [s] (t,), each (degree + 1, t, n).

    Args:
        omega: [rad/s], (n,), zero for coordinates without stiffness.
    """
    place, rate = _coefficients(degree)
    late, speed = np.ascontiguousarray(time, float), np.ascontiguousarray(omega, float)
    y, v = np.empty((2, degree + 1, len(late), len(speed)))
    _respond(speed, late, place, rate, y, v)
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


@compiled(no_cfunc_wrapper=True)
def _respond(omega, time, place, rate, y, v):  # type: ignore[no-untyped-def]
    """Fill displacement and velocity under each unit force, `y` and `v` of `responses`."""
    for i in range(len(time)):
        tau = time[i]
        for k in range(len(omega)):
            if omega[k] * tau <= SMALL:
                _series(omega[k] * tau, tau, place, rate, y[:, i, k], v[:, i, k])
            else:
                _forward(omega[k], tau, y[:, i, k], v[:, i, k])


@_inner
def _series(x, tau, place, rate, y, v):  # type: ignore[no-untyped-def]
    """Sum the power series of both in x = ωτ, smallest term first."""
    power = tau
    for m in range(len(y)):
        here, fast = 0.0, 0.0
        for j in range(TERMS - 1, -1, -1):
            here = place[m, j] - here * x * x
            fast = rate[m, j] - fast * x * x
        v[m] = fast * power
        power *= tau
        y[m] = here * power


@_inner
def _forward(omega, tau, y, v):  # type: ignore[no-untyped-def]
    """Integrate by parts from m = 0 up: y_m = (τ^m − m (m−1) y_{m−2}) / ω², v_m = m y_{m−1}."""
    sine, half, power = np.sin(omega * tau), np.sin(0.5 * omega * tau), 1.0
    for m in range(len(y)):
        if m == 0:
            y[0], v[0] = 2 * half**2 / omega**2, sine / omega
        elif m == 1:
            y[1], v[1] = (tau - sine / omega) / omega**2, y[0]
        else:
            y[m], v[m] = (power - m * (m - 1) * y[m - 2]) / omega**2, m * y[m - 1]
        power *= tau


def free(omega: np.ndarray, time: np.ndarray | float) -> np.ndarray:
    """Return y←y, y←ẏ, ẏ←y, ẏ←ẏ of free coordinates, omega [rad/s] (n,), over times [s] (t,) or one: (4, [t,] n)."""
    late = np.asarray(time, float)[..., None]
    x = omega * late
    cosine = np.cos(x)
    return np.array([cosine, late * np.sinc(x / np.pi), -omega * np.sin(x), cosine])
