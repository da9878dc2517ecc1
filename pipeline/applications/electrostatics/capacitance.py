"""Charges and capacitances of conductors at given potentials, by Galerkin's method on panels of uniform density.

Of ∫ σ/(4πεR) dS = V the densities σ minimise the energy, so each C_kk is a lower bound of the true one and rises as
panels are divided. The coarse panels are a part of the space, and what they lack is found from the same matrix.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from gudgeon.pipeline.applications.electrostatics.panels import Panels
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.stages.run_report import Progress
from gudgeon.solver import core

VACUUM = 8.8541878128e-12
"""ε₀ [F/m], CODATA 2018."""
COARSE_SHARE = 1 / 3
"""Estimated error of C over its difference from that of the coarse panels: the error falls at least with the square of
the panels' size, by a factor of four. Measured factors are 5 to 8, so that the estimate is above the error."""
RULES = 5e-6
"""Relative error of C by the rules of integration: with rules that are cheaper nowhere, spheres change by 3e-6."""
BLOCK = 256
"""Rows that are computed between two calls of the progress function."""


class HalfSpace(NamedTuple):
    """A dielectric or a conductor behind a plane, which acts as image charges."""

    point: np.ndarray
    """Of the plane [m], (3,)."""
    normal: np.ndarray
    """Unit vector into the medium of the conductors, (3,)."""
    factor: float
    """Image charge over charge: (ε₁ − ε₂)/(ε₁ + ε₂) with ε₂ behind the plane; −1 for a grounded conductor."""

    def mirrored(self, panels: Panels) -> Panels:
        """Return the mirror images of panels."""
        height = (panels.facets - self.point) @ self.normal
        return replace(panels, facets=panels.facets - 2 * height[:, :, None] * self.normal)


class Charged(NamedTuple):
    """Conductors at potentials of 1 V, one after the other."""

    capacitance: np.ndarray
    """Maxwell's matrix C [F], (k, k): charges Q = C V."""
    coarse: np.ndarray
    """The same of the coarse panels [F], (k, k)."""
    shape_error: np.ndarray
    """Estimated error of C by the distance of the panels from the true surface [F], (k, k)."""
    density: np.ndarray
    """Charge density of each panel with one conductor at 1 V, the others at 0 [F/m²], (panels, k)."""

    @property
    def panel_error(self) -> np.ndarray:
        """Estimated error of C by the size of the panels and the rules of integration [F], (k, k)."""
        return COARSE_SHARE * np.abs(self.capacitance - self.coarse) + RULES * np.abs(self.capacitance)


@dataclass(frozen=True)
class Factor:
    """A Cholesky factor of a matrix of integrals, and what is needed of it."""

    factor: np.ndarray

    @classmethod
    def of(cls, matrix: np.ndarray, owner: str) -> "Factor":
        """Factorise a symmetric matrix, which is overwritten; `owner` it is of is named in errors.

        Raises:
            StageError: the matrix is not positive definite.
        """
        try:
            # Transposed, the matrix of C's order is one of Fortran's, which is not copied.
            return cls(cho_factor(matrix.T, lower=True, overwrite_a=True, check_finite=False)[0])
        except np.linalg.LinAlgError as error:
            raise StageError(f"{owner}: the matrix of its panels is not positive definite; panels overlap") from error

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Return the solutions for right-hand sides, (panels, k)."""
        return cho_solve((self.factor, True), right, check_finite=False)


def integrals(panels: Panels, half_space: HalfSpace | None, tell: Progress) -> np.ndarray:
    """Return the symmetric matrix of ∬ 1/R dS dS of all pairs of panels, images included [m³], (panels, panels)."""
    group = panels.group()
    matrix = np.zeros((len(panels), len(panels)))
    sources = [(group, 1.0)]
    if half_space is not None:
        sources.append((half_space.mirrored(panels).group(), half_space.factor))
    for start in range(0, len(panels), BLOCK):
        end = min(start + BLOCK, len(panels))
        for source, factor in sources:
            core.panels.fill_symmetric(group, source, factor, start, end, matrix)
        tell("solve", 0.9 * (end / len(panels)) ** 2)
    return matrix


def areas_by_conductor(panels: Panels, areas: np.ndarray, count: int) -> np.ndarray:
    """Return the right-hand sides for 1 V on each conductor, the areas of its panels [m²], (panels, count)."""
    return areas[:, None] * (panels.conductor[:, None] == np.arange(count))


def coarsened(values: np.ndarray, coarse: np.ndarray) -> np.ndarray:
    """Return the sums of rows over coarse panels, (panels, …) → (coarse panels, …)."""
    return np.add.reduceat(values, np.searchsorted(coarse, np.arange(coarse[-1] + 1)), axis=0)


def coarse_matrix(matrix: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return the integrals of coarse panels [m³] from those of panels; `rows`, `columns` are their coarse panels."""
    coarse = np.empty((rows[-1] + 1, columns[-1] + 1))
    for start in range(0, len(coarse), BLOCK):
        span = slice(*np.searchsorted(rows, (start, start + BLOCK)))
        panel_rows = coarsened(matrix[span], rows[span] - start)
        coarse[start : start + BLOCK] = coarsened(panel_rows.T, columns).T
    return coarse


def charge(panels: Panels, count: int, permittivity: float, half_space: HalfSpace | None, tell: Progress) -> Charged:
    """Charge conductors, each at 1 V in turn.

    Args:
        count: Number of conductors.
        permittivity: Of the medium around them [F/m].

    Raises:
        StageError: panels of two conductors coincide.
    """
    matrix = integrals(panels, half_space, tell)
    areas = panels.group().areas
    right = areas_by_conductor(panels, areas, count)
    small = coarse_matrix(matrix, panels.coarse, panels.coarse)
    right_small = coarsened(right, panels.coarse)
    coarse = right_small.T @ Factor.of(small, "conductors").solve(right_small)
    density = Factor.of(matrix, "conductors").solve(right)
    scale = 4 * np.pi * permittivity
    # δC = ∫ σ_k σ_l/ε δn dS, with δn the outward motion of the surface.
    weights = areas * panels.deviation
    shape_error = scale**2 / permittivity * (np.abs(density).T @ (weights[:, None] * np.abs(density)))
    return Charged(_symmetric(scale * (right.T @ density)), _symmetric(scale * coarse), shape_error, scale * density)


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return 0.5 * (matrix + matrix.T)


class State(NamedTuple):
    """Potentials and charges of conductors."""

    potentials: np.ndarray
    """[V], (k,)"""
    charges: np.ndarray
    """[C], (k,)"""

    @property
    def co_energy(self) -> float:
        """½ Vᵀ C V [J]."""
        return float(0.5 * self.potentials @ self.charges)


def state(capacitance: np.ndarray, potentials: np.ndarray, charges: np.ndarray) -> State:
    """Return all potentials and charges of conductors, of which some have a potential and the others a charge.

    Args:
        capacitance: Maxwell's matrix [F], (k, k).
        potentials: [V], (k,); NaN for a floating conductor.
        charges: [C], (k,); used of floating conductors only.
    """
    floating = np.isnan(potentials)
    V = np.where(floating, 0.0, potentials)
    if floating.any():
        charge_left = (charges - capacitance @ V)[floating]
        V[floating] = np.linalg.solve(capacitance[np.ix_(floating, floating)], charge_left)
    return State(V, capacitance @ V)
