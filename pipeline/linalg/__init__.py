"""Sparse symmetric factorisations behind one small interface: factorise, solve blocks, count negative pivots."""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from scipy import sparse

from gudgeon.pipeline.linalg.pardiso import PardisoFactor, find_library
from gudgeon.pipeline.linalg.superlu import SuperLUFactor


class Factor(Protocol):
    """One factorisation A = L D Lᵀ of a sparse symmetric matrix."""

    precision: np.dtype
    """That it was made in."""

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Return A⁻¹ loads, (n,) or (n, k), in its precision."""
        ...

    def refactorise(self, matrix: sparse.csr_matrix) -> None:
        """Factorise another matrix of the same size, in the same precision."""
        ...

    def negative_pivots(self) -> int:
        """Return the number of negative eigenvalues of A (Sylvester's law of inertia)."""
        ...

    def free(self) -> None:
        """Give the factor's memory back."""
        ...


BACKENDS: dict[str, Callable[[sparse.csr_matrix, bool, bool], Factor]] = {
    "pardiso": PardisoFactor,
    "superlu": SuperLUFactor,
}


def available_backend() -> str:
    """Return the backend that `factorise` takes on this machine."""
    return "superlu" if find_library() is None else "pardiso"


def factorise(matrix: sparse.spmatrix, definite: bool = False, single: bool = False) -> Factor:
    """Factorise a sparse symmetric matrix given in full.

    Args:
        definite: Whether it is known to be positive definite; a definite one has no negative pivots to count.
        single: Whether single precision will do; a backend without it takes double.
    """
    rows = sparse.csr_matrix(matrix)
    rows.sort_indices()
    return BACKENDS[available_backend()](rows, definite, single)


def evened(matrix: sparse.csr_matrix) -> sparse.csr_matrix:
    """Return S A S with a diagonal next to ±1, S diagonal of powers of two: its inertia is that of A.

    An indefinite factorisation perturbs pivots that are small beside the whole matrix. In a beam a turn's stiffness
    over a displacement's is the square of an element's length, so whether that happens would depend on its unit.
    """
    size = np.abs(matrix.diagonal())
    exponent = np.zeros(len(size))
    exponent[size > 0] = -0.5 * np.log2(size[size > 0])
    scale = sparse.diags_array(np.exp2(np.round(exponent)))
    return sparse.csr_matrix(scale @ matrix @ scale)
