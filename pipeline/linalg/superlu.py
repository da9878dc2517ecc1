"""scipy's SuperLU on a symmetric matrix: diagonal pivots on a minimum-degree ordering."""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.linalg.counter import COUNTS


class SuperLUFactor:
    """LU with diagonal pivots, so that the signs of U's diagonal give the inertia.

    `definite` and `single` have no effect: every matrix is factorised in the same way, in double precision.

    Raises:
        StageError: the matrix (n, n) is singular to machine precision.
    """

    precision = np.dtype(np.float64)

    def __init__(self, matrix: sparse.csr_matrix, definite: bool = False, single: bool = False) -> None:
        self.refactorise(matrix)

    def refactorise(self, matrix: sparse.csr_matrix) -> None:
        """Factorise another matrix, with a new ordering."""
        COUNTS["factorisations"] += 1
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
        """Do nothing: Python releases the memory with the object."""
