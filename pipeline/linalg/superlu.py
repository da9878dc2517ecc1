"""scipy's SuperLU on a symmetric matrix: diagonal pivots on a minimum-degree ordering."""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.linalg.counter import COUNTS


class SuperLUFactor:
    """LU with diagonal pivots, so that the signs of U's diagonal give the inertia.

    Args:
        matrix: The whole symmetric matrix, (n, n).
        definite: Whether it is positive definite; makes no difference here.
        single: Whether single precision would do; double is all there is.

    Raises:
        StageError: it is singular to the last digit.
    """

    precision = np.dtype(np.float64)

    def __init__(self, matrix: sparse.csr_matrix, definite: bool = False, single: bool = False) -> None:
        self.refactorise(matrix)

    def refactorise(self, matrix: sparse.csr_matrix) -> None:
        """Factorise another matrix; nothing of the one before is used."""
        COUNTS.factorisations += 1
        try:
            self._lu = splu(
                sparse.csc_matrix(matrix),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True, "Equil": False},
            )
        except RuntimeError as error:
            raise StageError(f"linear solver: {error} ({matrix.shape[0]} unknowns)") from error

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Return A⁻¹ loads, (n,) or (n, k)."""
        return self._lu.solve(np.asarray(loads, dtype=float))

    def negative_pivots(self) -> int:
        """Return the number of negative eigenvalues of A."""
        return int(np.count_nonzero(self._lu.U.diagonal() < 0))

    def free(self) -> None:
        """Give the factor's memory back (with the object)."""
