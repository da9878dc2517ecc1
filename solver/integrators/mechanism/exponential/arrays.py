"""The arrays of exponential steps, which `core/turning` reads.

Shapes as of `mechanism.arrays`, s stages behind the start, N numbers of a state.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.integrators.mechanism.arrays import Model
from gudgeon.solver.integrators.mechanism.collocation.table import Table


class Nodes(NamedTuple):
    """Coefficients of a step. The slopes are interpolated by ℓ_l, the polynomials that are 1 at one node alone."""

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


class Course(NamedTuple):
    """What a step is taken with."""

    nodes: Nodes
    h: float
    """[s]"""
    given: np.ndarray
    """Drives at the start and at the times of the stages, (1 + s, d, 3)."""
    amounts: np.ndarray
    """Loads at these times, (1 + s, l)."""
    weight: np.ndarray
    """Of the error of each number, as of `step.Course`, (N,)."""
    energy: float
    """Of the error of the energy balance [1/J]."""
    fresh: bool
    """Whether nothing is guessed of the slopes."""
    renew: bool
    """Whether the step has another size than the last one."""
    tolerance: float
    """Of the stages."""
    limits: tuple[float, float]
    """Ratio of two changes beyond which they do not converge, and the least that is believed."""


class Inside(NamedTuple):
    """A place within a step."""

    nodes: Nodes
    h: float
    """Of the step [s]."""
    at: float
    """Over the step, between 0 and 1."""


class Waves(NamedTuple):
    """Arrays that the core writes, but for the first. Of each mode z' = λ z + … with z = v − conj(λ) q."""

    root: np.ndarray
    """λ [1/s], complex, (n, E)."""
    kept: np.ndarray
    """exp(λ t) at the stages, complex, (n, E, s)."""
    weights: np.ndarray
    """Of the slopes in z at the stages [s], complex, (n, E, s, 1 + s)."""
    missed: np.ndarray
    """Of the highest difference of the slopes in its estimated error [s], complex, (n, E)."""
    slopes: np.ndarray
    """At the start and at the stages, of modes without λ z: its parts, imaginary at q, real at the momentum,
    (1 + s, N)."""
    states: np.ndarray
    """(s, N)"""
    other: np.ndarray
    """(N,)"""
    apart: np.ndarray
    """(N,)"""
    series: np.ndarray
    """φ_k(z) up to k = s + 1, complex, (s + 2,)."""
    rate: np.ndarray
    """Ratio of changes in the last step that needed more than one, (1,)."""
    energy: np.ndarray
    """Kinetic, at the start [J], (1,)."""
    counts: np.ndarray
    """Stages computed, (1,)."""


def roots_of(model: Model) -> np.ndarray:
    """Return λ of all modes [1/s], complex, (n, E); zero where a body has none. Those that do not vibrate are real."""
    mass = np.einsum("bkk->bk", model.modal_root) ** 2
    mass[mass == 0.0] = 1.0
    half, square = 0.5 * model.modal_damping / mass, model.modal_stiffness / mass
    return -half + np.sqrt(np.maximum(square - half**2, 0.0)) * 1j


def waves_of(model: Model, size: int, stages: int) -> Waves:
    """Return work arrays of steps from states of a size."""
    n, e = model.modal_stiffness.shape
    real = {
        "slopes": (1 + stages, size), "states": (stages, size), "other": (size,), "apart": (size,), "rate": (1,),
        "energy": (1,),
    }  # fmt: skip
    paired = {
        "kept": (n, e, stages), "weights": (n, e, stages, 1 + stages), "missed": (n, e), "series": (stages + 2,),
    }  # fmt: skip
    arrays = {name: np.zeros(shape) for name, shape in real.items()}
    arrays |= {name: np.zeros(shape, np.complex128) for name, shape in paired.items()}
    return Waves(root=roots_of(model), counts=np.zeros(1, np.int64), **arrays)
