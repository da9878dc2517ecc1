"""Sparse symmetric factorisations behind one small interface: factorise, solve blocks, count negative pivots."""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from scipy import sparse

from gudgeon.pipeline.linalg.condensed import PardisoCondensed
from gudgeon.pipeline.linalg.pardiso import PardisoFactor, find_library
from gudgeon.pipeline.linalg.superlu import SuperLUFactor


class Solver(Protocol):
    """A factor of a sparse matrix A, symmetric or Hermitian."""

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Return A⁻¹ loads, (n,) or (n, k)."""
        ...

    def negative_pivots(self) -> int:
        """Return the number of negative eigenvalues of A (Sylvester's law of inertia)."""
        ...

    def free(self) -> None:
        """Release the memory of the factor."""
        ...


class Factor(Solver, Protocol):
    """A factor A = L D Lᵀ of a real symmetric matrix."""

    precision: np.dtype
    """Of the factor and its solutions."""

    def refactorise(self, matrix: sparse.csr_matrix) -> None:
        """Factorise another matrix of the same size, in the same precision."""
        ...


BACKENDS: dict[str, Callable[[sparse.csr_matrix, bool, bool], Factor]] = {
    "pardiso": PardisoFactor,
    "superlu": SuperLUFactor,
}


def available_backend() -> str:
    """Return the backend that `factorise` uses on this machine."""
    return "superlu" if find_library() is None else "pardiso"


def factorise(matrix: sparse.spmatrix, definite: bool = False, single: bool = False) -> Factor:
    """Factorise a sparse symmetric matrix, both triangles given, (n, n).

    Args:
        definite: Whether it is known to be positive definite; its negative pivots are then not counted.
        single: Whether single precision is enough; a backend without it uses double.
    """
    rows = sparse.csr_matrix(matrix)
    rows.sort_indices()
    return BACKENDS[available_backend()](rows, definite, single)


def condense(matrix: sparse.csr_matrix, rows: sparse.csr_matrix) -> PardisoCondensed | None:
    """Return a factor of a positive definite matrix (n, n) with its flexibility at rows (c, n).

    None if there are no rows, or if the backend of this machine solves for each of them as fast.
    """
    if not rows.shape[0] or available_backend() != "pardiso":
        return None
    return PardisoCondensed(matrix, rows)


class EvenedFactor:
    """A factor of S A S with a diagonal close to ±1, S diagonal of powers of two, that solves with A.

    An indefinite factorisation perturbs pivots that are small relative to the whole matrix. In a beam the ratio of
    rotational to translational stiffness is the square of an element's length, so the perturbation would depend on the
    unit of length. The inertia of S A S is that of A.
    """

    def __init__(self, matrix: sparse.csr_matrix) -> None:
        """Factorise a sparse symmetric matrix, (n, n)."""
        size = np.abs(matrix.diagonal())
        exponent = np.zeros(len(size))
        exponent[size > 0] = -0.5 * np.log2(size[size > 0])
        self._scale = np.exp2(np.round(exponent))
        scale = sparse.diags_array(self._scale)
        self._factor = factorise(scale @ matrix @ scale)

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Return A⁻¹ loads, (n,) or (n, k)."""
        scale = self._scale if loads.ndim == 1 else self._scale[:, None]
        return scale * self._factor.solve(scale * loads)

    def negative_pivots(self) -> int:
        """Return the number of negative eigenvalues of A."""
        return self._factor.negative_pivots()

    def free(self) -> None:
        """Release the memory of the factor."""
        self._factor.free()
