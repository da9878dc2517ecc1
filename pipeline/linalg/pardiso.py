"""MKL PARDISO called from its wheel: symmetric indefinite, upper triangle, blocks of loads.

Where the matrix consists of full d × d blocks, one per pair of nodes, it is handed over as blocks: the graph that is
ordered then has nodes instead of dofs, which takes a third of the time.
"""

import ctypes
import sys
from functools import cache
from pathlib import Path

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.linalg.counter import COUNTS

SYMMETRIC_INDEFINITE, POSITIVE_DEFINITE = -2, 2
ANALYSE_AND_FACTORISE, FACTORISE, SOLVE, RELEASE = 12, 22, 33, -1
NOT_DEFINITE = -4
"""Error of a Cholesky factorisation."""
NEGATIVE_EIGENVALUES, SINGLE_PRECISION, BLOCK_SIZE = 22, 27, 36
SETTINGS = {0: 1, 1: 2, 9: 8, 20: 1, 34: 1}
"""iparm by C index. 0: no defaults; 1: METIS ordering; 9: pivots below 1e-8 are perturbed; 20: 1×1 and 2×2 pivots;
34: indices count from zero. Refinement (7) stays off unless a pivot was perturbed."""
ONE_THREAD_BELOW = 8
"""Blocks of fewer loads than this are bound by memory, and a second thread slows them down."""
BLOCK_SIZES = (3, 2)
FILLED = 1.1
"""Blocks may hold this many times the matrix's own entries."""
SAMPLED_ROWS = 1000
"""Rows of blocks that are looked at for it."""


class PardisoFactor:
    """LDLᵀ of a symmetric matrix with Bunch-Kaufman pivoting.

    Args:
        matrix: The whole symmetric matrix, (n, n); its upper triangle is used.
        definite: Whether it is positive definite: Cholesky, whose solves are a third faster.
        single: Whether to factorise and solve in single precision: half the time and the memory, seven digits.

    Raises:
        StageError: PARDISO refused the matrix.
    """

    def __init__(self, matrix: sparse.csr_matrix, definite: bool = False, single: bool = False) -> None:
        self._type = POSITIVE_DEFINITE if definite else SYMMETRIC_INDEFINITE
        self.precision = np.dtype(np.float32 if single else np.float64)
        self._block = _block_size(matrix)
        self._values, self._starts, self._columns = self._upper(matrix)
        self._size = matrix.shape[0]
        self._handle = np.zeros(64, np.int64)
        self._iparm = np.zeros(64, np.int32)
        for index, value in SETTINGS.items():
            self._iparm[index] = value
        self._iparm[SINGLE_PRECISION] = single
        self._iparm[BLOCK_SIZE] = self._block if self._block > 1 else 0
        self._held, self._narrowed = True, False
        COUNTS.factorisations += 1
        self._call(ANALYSE_AND_FACTORISE, self._nothing())

    def refactorise(self, matrix: sparse.csr_matrix) -> None:
        """Factorise another matrix; ordering and analysis are kept where the pattern is the same.

        After a solve of fewer than `ONE_THREAD_BELOW` loads the analysis is made anew: PARDISO 2026.2 crashes when it
        factorises again on more threads than it solved on.

        Raises:
            StageError: PARDISO refused the matrix.
        """
        COUNTS.factorisations += 1
        values, starts, columns = self._upper(matrix)
        same = np.array_equal(starts, self._starts) and np.array_equal(columns, self._columns)
        if same and not self._narrowed:
            # In place: PARDISO goes on reading the arrays that it analysed.
            self._values[:] = values
            self._call(FACTORISE, self._nothing())
            return
        self._call(RELEASE, self._nothing())
        self._narrowed = False
        self._values, self._starts, self._columns = values, starts, columns
        self._call(ANALYSE_AND_FACTORISE, self._nothing())

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Return A⁻¹ loads, (n,) or (n, k), in the factor's precision."""
        block = np.asfortranarray(loads.reshape(self._size, -1), dtype=self.precision)
        return self._call(SOLVE, block).reshape(loads.shape)

    def negative_pivots(self) -> int:
        """Return the number of negative eigenvalues of A."""
        return int(self._iparm[NEGATIVE_EIGENVALUES])

    def free(self) -> None:
        """Give the factor's memory back; a second call does nothing."""
        if self._held:
            self._held = False
            self._call(RELEASE, self._nothing())

    def _nothing(self) -> np.ndarray:
        return np.zeros((self._size, 1), self.precision, order="F")

    def _upper(self, matrix: sparse.csr_matrix) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return values, row starts and columns of the upper triangle, in blocks or single entries."""
        if self._block == 1:
            upper = sparse.csr_matrix(sparse.triu(matrix))
            upper.sort_indices()
            values, starts, columns = upper.data, upper.indptr, upper.indices
        else:
            whole = (matrix if matrix.has_sorted_indices else matrix.sorted_indices()).tobsr((self._block, self._block))
            count = len(whole.indptr) - 1
            rows = np.repeat(np.arange(count, dtype=np.int32), np.diff(whole.indptr))
            kept = whole.indices >= rows
            values, columns = whole.data[kept].ravel(), whole.indices[kept]
            starts = np.concatenate([[0], np.cumsum(np.bincount(rows[kept], minlength=count))])
        return np.ascontiguousarray(values, self.precision), starts.astype(np.int32), columns.astype(np.int32)

    def _call(self, phase: int, loads: np.ndarray) -> np.ndarray:
        answer, error, library = np.empty_like(loads), ctypes.c_int32(0), _library()

        def whole(value: int) -> object:
            return ctypes.byref(ctypes.c_int32(value))

        threads = 1 if phase == SOLVE and loads.shape[1] < ONE_THREAD_BELOW else 0
        self._narrowed |= threads == 1
        previous = library.MKL_Set_Num_Threads_Local(threads)
        library.pardiso(
            self._handle.ctypes, whole(1), whole(1), whole(self._type), whole(phase),
            whole(self._size // self._block), self._values.ctypes, self._starts.ctypes, self._columns.ctypes, whole(0),
            whole(loads.shape[1]), self._iparm.ctypes, whole(0), loads.ctypes, answer.ctypes, ctypes.byref(error),
        )  # fmt: skip
        library.MKL_Set_Num_Threads_Local(previous)
        if error.value == NOT_DEFINITE:
            raise StageError(
                f"linear solver: a stiffness of {self._size} unknowns is not positive to the last digit; something"
                " hangs loose, or elements differ too much in size"
            )
        if error.value:
            raise StageError(f"linear solver: PARDISO error {error.value} in phase {phase} ({self._size} unknowns)")
        return answer


def find_library() -> Path | None:
    """Return where the `mkl` wheel put its run-time library, or None where it is not installed."""
    found = sorted(Path(sys.prefix, "lib").glob("libmkl_rt.so*"))
    return found[0] if found else None


def _block_size(matrix: sparse.csr_matrix) -> int:
    """Return the size of the blocks that a matrix consists of, as far as some of its rows tell; 1 where it has none."""
    size = matrix.shape[0]
    for d in BLOCK_SIZES:
        if size % d:
            continue
        step = d * max(1, size // (d * SAMPLED_ROWS))
        rows = (np.arange(0, size - d + 1, step)[:, None] + np.arange(d)).ravel()
        sample = sparse.csr_matrix(matrix[rows])
        if sample.tobsr((d, d)).data.size <= FILLED * sample.nnz:
            return d
    return 1


@cache
def _library() -> ctypes.CDLL:
    path = find_library()
    if path is None:
        raise StageError("linear solver: MKL is not installed")
    return ctypes.CDLL(str(path))
