"""A⁻¹ of a sparse symmetric matrix and its flexibility B A⁻¹ Bᵀ at many rows, by one factorisation.

  [A Bᵀ; B 0] = [L 0; B L⁻ᵀ D⁻¹ I] [D 0; 0 −B A⁻¹ Bᵀ] [Lᵀ …; 0 I]

is factorised up to the rows of B, whose Schur complement is left: dense products of small blocks gather it along the
elimination tree, where solves would run through the whole factor for each row. On solids of 1e5 unknowns 1000 rows take
half of the factorisation's time.
"""

import numpy as np
from scipy import sparse

from gudgeon.pipeline.linalg.counter import COUNTS
from gudgeon.pipeline.linalg.pardiso import (
    ANALYSE,
    BACKWARD,
    FACTORISE,
    FORWARD,
    SCHUR_COMPLEMENT,
    Pardiso,
    upper_triangle,
)

WITH_FACTOR = 2
"""The Schur complement and the factor that solves with A."""


class PardisoCondensed(Pardiso):
    """Factor of a symmetric positive definite matrix A (n, n), both triangles given, with rows B (c, n), c > 0.

    Raises:
        StageError: PARDISO refused the matrix.
    """

    flexibility: np.ndarray
    """B A⁻¹ Bᵀ, (c, c), symmetric."""

    def __init__(self, matrix: sparse.csr_matrix, rows: sparse.csr_matrix) -> None:
        self._inner, count = matrix.shape[0], rows.shape[0]
        # A pivot is perturbed where it is small beside the largest entry, which must be one of A: rows are scaled, by
        # powers of two.
        sums = np.asarray(abs(rows).sum(axis=1)).ravel()
        scale = np.exp2(np.floor(np.log2(matrix.diagonal().min() / np.where(sums > 0, sums, 1.0))))
        B = sparse.csr_matrix(sparse.diags_array(scale) @ rows)
        # Its diagonal has to be stored.
        corner = sparse.csr_matrix((np.zeros(count), np.arange(count), np.arange(count + 1)), shape=(count, count))
        bordered = sparse.csr_matrix(sparse.vstack([sparse.hstack([matrix, B.T]), sparse.hstack([B, corner])]))
        bordered.sort_indices()
        upper = upper_triangle(bordered, 1, np.dtype(float))
        super().__init__(upper, self._inner + count, block=1, definite=False, single=False)
        # PARDISO replaces these marks.
        self._order[self._inner :] = 1
        self._iparm[SCHUR_COMPLEMENT] = WITH_FACTOR
        COUNTS["factorisations"] += 1
        self._call(ANALYSE)
        schur = self._call(FACTORISE, answer=np.zeros((count, count), order="F"))
        self.flexibility = -0.5 * (schur + schur.T) / np.outer(scale, scale)

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Return A⁻¹ loads, (n,) or (n, k)."""
        columns = loads.reshape(self._inner, -1)
        block = np.zeros((self._size, columns.shape[1]), order="F")
        block[: self._inner] = columns
        half = self._call(FORWARD, block)
        half[self._inner :] = 0.0
        return self._call(BACKWARD, half, answer=block)[: self._inner].reshape(loads.shape)
