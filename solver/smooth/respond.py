"""Exact motion of coordinates under forces that are polynomials of time: ÿ + ω² y = Σ α_m τ^m, at rest at τ = 0."""

from math import factorial

import numpy as np

SMALL = 0.5
"""ωτ up to which the series is summed; beyond it the polynomial solution loses less than three digits."""
TERMS = 9
"""Of the series: the first one left out is below 1e-19 of the first."""


def responses(omega: np.ndarray, degree: int, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return displacement and velocity under forces τ^m, m = 0 … degree, each (degree + 1, t, n).

    Args:
        omega: [rad/s], (n,), zero for coordinates without stiffness.
        time: [s], (t,).
    """
    late = np.asarray(time, float)[:, None]
    x, tau, speed = np.broadcast_arrays(omega * late, late, omega)
    low = x <= SMALL
    y, v = np.empty((degree + 1, *x.shape)), np.empty((degree + 1, *x.shape))
    _series(x[low], tau[low], y, v, low)
    _forward(speed[~low], x[~low], tau[~low], y, v, ~low)
    return y, v


def _series(x: np.ndarray, tau: np.ndarray, y: np.ndarray, v: np.ndarray, where: np.ndarray) -> None:
    square = -(x**2)
    for m in range(len(y)):
        place, rate = np.zeros_like(x), np.zeros_like(x)
        for j in reversed(range(TERMS)):
            place = place * square + factorial(m) / factorial(m + 2 + 2 * j)
            rate = rate * square + factorial(m) / factorial(m + 1 + 2 * j)
        y[m, where], v[m, where] = place * tau ** (m + 2), rate * tau ** (m + 1)


def _forward(
    omega: np.ndarray, x: np.ndarray, tau: np.ndarray, y: np.ndarray, v: np.ndarray, where: np.ndarray
) -> None:
    """Integrate by parts from m = 0 up: y_m = (τ^m − m (m−1) y_{m−2}) / ω², v_m = m y_{m−1}."""
    found = [2 * np.sin(x / 2) ** 2 / omega**2, (tau - np.sin(x) / omega) / omega**2]
    for m in range(2, len(y)):
        found.append((tau**m - m * (m - 1) * found[m - 2]) / omega**2)
    for m in range(len(y)):
        y[m, where] = found[m]
        v[m, where] = m * found[m - 1] if m else np.sin(x) / omega


def free(omega: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return y←y, y←ẏ, ẏ←y, ẏ←ẏ over times (t,), (4, t, n)."""
    late = np.asarray(time, float)[:, None]
    x = omega * late
    return np.array([np.cos(x), late * np.sinc(x / np.pi), -omega * np.sin(x), np.cos(x)])
