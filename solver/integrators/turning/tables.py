"""Coefficients of the methods of steps, which `core/turning` reads: Dormand and Prince's, collocation, exponential.

Those of DOP853 (Hairer, Nørsett, Wanner, Solving ODE I, II.5 and II.10), which scipy has; of collocation at the points
of Lobatto (Lobatto IIIA; Hairer, Wanner, Solving ODE II, IV.5), s stages behind the start. With the weights A of the
stages, A⁻¹ = T Λ T⁻¹ parts the equations of Newton's method into one system for each eigenvalue, of which those of a
pair of conjugates are conjugates (IV.8 there): k = (s + 1)/2 count.
"""

from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853
from scipy.special import roots_jacobi

STAGES = 5
"""Of a step by collocation, behind its start: order 10."""


class Tableau(NamedTuple):
    """Coefficients of an explicit step of 12 stages, of the 13th at its end, and of 3 more for interpolation."""

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
    """Return the coefficients of explicit steps, and the times of the 16 stages over the step."""
    weights = np.zeros((16, 16))
    weights[:12, :12] = DOP853.A[:12, :12]
    weights[12, :12] = DOP853.B
    weights[13:, :] = DOP853.A_EXTRA
    times = np.concatenate([DOP853.C[:12], [1.0], DOP853.C_EXTRA])
    arrays = (weights, DOP853.B, DOP853.E5, DOP853.E3, DOP853.D)
    return Tableau(*(np.ascontiguousarray(a, float) for a in arrays)), times


class Table(NamedTuple):
    """Coefficients of a step by collocation."""

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
    outer: np.ndarray
    """Those of the polynomials through the stages alone, (s, s)."""


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
    polynomials, outer = (
        np.ascontiguousarray(np.linalg.inv(x[:, None] ** powers[: len(x)]).T) for x in (nodes, nodes[1:])
    )
    return Table(
        nodes[1:], start, values[chosen].astype(complex), np.ascontiguousarray(rows[chosen], complex),
        np.ascontiguousarray(vectors[:, chosen] * twice, complex), error_start=real * (w0 - float(dw @ start)),
        error=real * np.linalg.solve(weights.T, dw), polynomials=polynomials, outer=outer,
    )  # fmt: skip


class Nodes(NamedTuple):
    """Coefficients of an exponential step. The slopes are interpolated by ℓ_l, the polynomials of `Table`."""

    points: np.ndarray
    """Of the stages over the step, (s,)."""
    weights: np.ndarray
    """Integrals of ℓ_l from the start to each stage, (s, 1 + s)."""
    powers: np.ndarray
    """k! times the coefficient of the power k of ℓ_l, (1 + s, 1 + s)."""
    leading: np.ndarray
    """That of the highest power of ℓ_l, (1 + s,)."""
    missed: np.ndarray
    """k! times the coefficient of the power k of Π (x − x_i) over the stages, by which slopes times `leading` differ
    from those of the polynomial without the start, (1 + s,)."""
    lost: float
    """The integral of this product over the step."""


def nodes_of(table: Table) -> Nodes:
    """Return the coefficients for the points of a table."""
    powers = np.arange(len(table.polynomials))
    missed = np.polynomial.polynomial.polyfromroots(table.points)
    missed_integral = float(np.sum(missed / (powers + 1)))
    factorials = np.cumprod(np.append(1.0, powers[1:]))
    weights = (table.points[:, None] ** (powers + 1) / (powers + 1)) @ table.polynomials.T
    leading = np.ascontiguousarray(table.polynomials[:, -1])
    return Nodes(table.points, weights, table.polynomials * factorials, leading, missed * factorials, missed_integral)
