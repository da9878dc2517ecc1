"""Coefficients of collocation at the points of Lobatto (Lobatto IIIA; Hairer, Wanner, Solving ODE II, IV.5).

With the weights A of the stages behind the start, A⁻¹ = T Λ T⁻¹ parts the equations of Newton's method into one system
for each eigenvalue, of which those of a pair of conjugates are conjugates (IV.8 there).
"""

from typing import NamedTuple

import numpy as np
from scipy.special import roots_jacobi


class Table(NamedTuple):
    """Coefficients of a step of s stages, of which k = (s + 1)/2 eigenvalues count."""

    points: np.ndarray
    """Of the stages over the step, (s,)."""
    start: np.ndarray
    """Of the slope at the start, added to those of the stages, (s,)."""
    eigenvalues: np.ndarray
    """Of A⁻¹, the real one first, then one of each pair, complex, (k,)."""
    there: np.ndarray
    """Their rows of T⁻¹, complex, (k, s)."""
    back: np.ndarray
    """Their columns of T, those of pairs twice, (s, k): a change of stages is the real part of this times that of
    eigenvectors."""
    error_start: float
    """Of the slope at the start in the difference to an embedded method of order s, times the real eigenvalue."""
    error: np.ndarray
    """Of the increments of the stages over the step in it, (s,)."""
    polynomials: np.ndarray
    """Coefficients of powers, from the constant on, of the polynomials that are 1 at the start or at one of the stages
    and 0 at the others, (s + 1, s + 1)."""


def table_of(stages: int) -> Table:
    """Return the coefficients of an odd number of stages at the points of Lobatto behind the start."""
    inner = roots_jacobi(stages - 1, 1.0, 1.0)[0] if stages > 1 else np.empty(0)
    nodes = np.concatenate([[0.0], 0.5 * (1.0 + inner), [1.0]])
    powers = np.arange(stages + 1)
    every = (nodes[:, None] ** (powers + 1) / (powers + 1)) @ np.linalg.inv(nodes[:, None] ** powers)
    weights, w0 = every[1:, 1:], float(every[-1, 0])
    start = np.linalg.solve(weights, every[1:, 0])
    values, vectors = np.linalg.eig(np.linalg.inv(weights))
    rows = np.linalg.inv(vectors)
    chosen = [int(np.abs(np.imag(values)).argmin()), *np.flatnonzero(np.imag(values) > 1e-6)]
    real = float(np.real(values[chosen[0]]))
    twice = np.where(np.arange(len(chosen)) > 0, 2.0, 1.0)
    # The embedded method leaves out the slope at the start: what weights differ by integrates no power below s.
    dw = -w0 * np.linalg.solve((nodes[1:, None] ** powers[:-1]).T, np.eye(stages)[0])
    polynomials = np.ascontiguousarray(np.linalg.inv(nodes[:, None] ** powers).T)
    return Table(
        nodes[1:], start, values[chosen].astype(complex), np.ascontiguousarray(rows[chosen], complex),
        np.ascontiguousarray(vectors[:, chosen] * twice, complex), error_start=real * (w0 - float(dw @ start)),
        error=real * np.linalg.solve(weights.T, dw), polynomials=polynomials,
    )  # fmt: skip


def shares(polynomials: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return at places (p,) the values of `Table.polynomials`, (p, s + 1)."""
    return (positions[:, None] ** np.arange(len(polynomials))) @ polynomials.T
