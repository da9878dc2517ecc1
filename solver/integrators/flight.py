"""Exact motion of each coordinate over a step: q̈ + c q̇ + ω² q = f with f constant in the step.

The energy ∫ c q̇² dt that damping takes is an exact quadratic form of (q, q̇, f) at the start of the step (Van
Loan 1978), computed independently of the propagator, so that the energy balance detects an error in either.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import expm


class Flight(NamedTuple):
    """The propagator of m coordinates over one step."""

    motion: np.ndarray
    """q←q, q←q̇, q̇←q, q̇←q̇, (4, m)."""
    push: np.ndarray
    """Response to a unit force: q←f [s²], q̇←f [s], (2, m)."""
    loss: np.ndarray
    """Energy lost: factors of q², q q̇, q̇², q f, q̇ f, f², (6, m)."""


def flight(stiffness: np.ndarray, damping: np.ndarray, dt: float) -> Flight:
    """Return the propagator over dt [s] of coordinates with stiffness ω² [rad²/s²], (m,), and damping c [1/s], (m,)."""
    # Scaled by the step, the state is (q, q̇ dt, f dt²): it has one unit, and exponents are near ω dt.
    A = np.zeros((len(stiffness), 3, 3))
    A[:, 0, 1], A[:, 1, 0], A[:, 1, 1], A[:, 1, 2] = 1.0, -stiffness * dt**2, -damping * dt, 1.0
    step, Q = _doubled(A)
    Q *= (damping / dt)[:, None, None]
    return Flight(
        np.array([step[:, 0, 0], step[:, 0, 1] * dt, step[:, 1, 0] / dt, step[:, 1, 1]]),
        np.array([step[:, 0, 2] * dt**2, step[:, 1, 2] * dt]),
        np.array(
            [
                Q[:, 0, 0], 2 * Q[:, 0, 1] * dt, Q[:, 1, 1] * dt**2,
                2 * Q[:, 0, 2] * dt**2, 2 * Q[:, 1, 2] * dt**3, Q[:, 2, 2] * dt**4,
            ]
        ),
    )  # fmt: skip


def _doubled(A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return exp(A) and ∫₀¹ exp(A s)ᵀ diag(0, 1, 0) exp(A s) ds of each coordinate, by doubling from a short time.

    Van Loan's block exponential has exp(−A), whose size would leave the integral no digits under strong damping.
    """
    size = np.abs(A[:, :2, :2]).sum(axis=(1, 2))
    halvings = np.maximum(0, np.ceil(np.log2(size + 1e-300))).astype(int)
    block = np.zeros((len(A), 6, 6))
    block[:, :3, :3], block[:, 3:, 3:] = -A.transpose(0, 2, 1), A
    block[:, 1, 4] = 1.0
    both = expm(block / 2.0 ** halvings[:, None, None])
    step = both[:, 3:, 3:].copy()
    Q = step.transpose(0, 2, 1) @ both[:, :3, 3:]
    for halving in range(halvings.max(initial=0)):
        on = halvings > halving
        Q[on] += step[on].transpose(0, 2, 1) @ Q[on] @ step[on]
        step[on] = step[on] @ step[on]
    return step, Q


def memory_of(beta: np.ndarray, dt: float) -> np.ndarray:
    """Return what r + β ṙ = f keeps of r, of f at the start and of f at the end of a step, f linear in it, (3, n).

    Args:
        beta: [s], (n,).
        dt: Step [s].
    """
    ratio = beta / dt
    with np.errstate(divide="ignore"):
        kept = np.exp(-1 / ratio)
    gone = ratio * (1 - kept)
    return np.array([kept, gone - kept, 1 - gone])
