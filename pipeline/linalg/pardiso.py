"""MKL PARDISO called from its wheel: symmetric indefinite, upper triangle, blocks of loads."""

import ctypes
import sys
from functools import cache
from pathlib import Path

import numpy as np
from scipy import sparse

from pipeline.errors import StageError

SYMMETRIC_INDEFINITE, POSITIVE_DEFINITE = -2, 2
ANALYSE_AND_FACTORISE, SOLVE, RELEASE = 12, 33, -1
NEGATIVE_EIGENVALUES = 22
SETTINGS = {0: 1, 1: 2, 9: 8, 20: 1, 34: 1}
"""iparm by C index. 0: no defaults; 1: METIS ordering; 9: pivots below 1e-8 are perturbed; 20: 1×1 and 2×2 pivots;
34: indices count from zero. Refinement (7) stays off unless a pivot was perturbed."""
ONE_THREAD_BELOW = 8
"""Blocks of fewer loads than this are bound by memory, and a second thread slows them down."""


class PardisoFactor:
    """LDLᵀ of a symmetric matrix with Bunch-Kaufman pivoting.

    Args:
        matrix: The whole symmetric matrix, (n, n), sorted rows; its upper triangle is used.
        definite: Whether it is positive definite: Cholesky, whose solves are a third faster.

    Raises:
        StageError: PARDISO refused the matrix.
    """

    def __init__(self, matrix: sparse.csr_matrix, definite: bool = False) -> None:
        self._type = POSITIVE_DEFINITE if definite else SYMMETRIC_INDEFINITE
        upper = sparse.csr_matrix(sparse.triu(matrix))
        upper.sort_indices()
        self._values = np.ascontiguousarray(upper.data, dtype=float)
        self._starts = upper.indptr.astype(np.int32)
        self._columns = upper.indices.astype(np.int32)
        self._size = matrix.shape[0]
        self._handle = np.zeros(64, np.int64)
        self._iparm = np.zeros(64, np.int32)
        for index, value in SETTINGS.items():
            self._iparm[index] = value
        self._held = True
        self._call(ANALYSE_AND_FACTORISE, np.zeros((self._size, 1), order="F"))

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Return A⁻¹ loads, (n,) or (n, k)."""
        block = np.asfortranarray(loads.reshape(self._size, -1), dtype=float)
        return self._call(SOLVE, block).reshape(loads.shape)

    def negative_pivots(self) -> int:
        """Return the number of negative eigenvalues of A."""
        return int(self._iparm[NEGATIVE_EIGENVALUES])

    def free(self) -> None:
        """Give the factor's memory back; a second call does nothing."""
        if self._held:
            self._held = False
            self._call(RELEASE, np.zeros((self._size, 1), order="F"))

    def _call(self, phase: int, loads: np.ndarray) -> np.ndarray:
        answer, error, library = np.empty_like(loads), ctypes.c_int32(0), _library()

        def whole(value: int) -> object:
            return ctypes.byref(ctypes.c_int32(value))

        threads = 1 if phase == SOLVE and loads.shape[1] < ONE_THREAD_BELOW else 0
        previous = library.MKL_Set_Num_Threads_Local(threads)
        library.pardiso(
            self._handle.ctypes, whole(1), whole(1), whole(self._type), whole(phase), whole(self._size),
            self._values.ctypes, self._starts.ctypes, self._columns.ctypes, whole(0), whole(loads.shape[1]),
            self._iparm.ctypes, whole(0), loads.ctypes, answer.ctypes, ctypes.byref(error),
        )  # fmt: skip
        library.MKL_Set_Num_Threads_Local(previous)
        if error.value:
            raise StageError(f"linear solver: PARDISO error {error.value} in phase {phase} ({self._size} unknowns)")
        return answer


def find_library() -> Path | None:
    """Return where the `mkl` wheel put its run-time library, or None where it is not installed."""
    found = sorted(Path(sys.prefix, "lib").glob("libmkl_rt.so*"))
    return found[0] if found else None


@cache
def _library() -> ctypes.CDLL:
    path = find_library()
    if path is None:
        raise StageError("linear solver: MKL is not installed")
    return ctypes.CDLL(str(path))
