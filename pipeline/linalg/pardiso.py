"""MKL PARDISO called from its wheel: symmetric matrices by their upper triangle, blocks of loads.

A matrix of full d × d blocks, one per pair of nodes, is passed in blocks: the ordering then works on the graph of nodes
instead of dofs, which takes a third of the time.
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
ANALYSE, ANALYSE_AND_FACTORISE, FACTORISE, SOLVE, FORWARD, BACKWARD, RELEASE = 11, 12, 22, 33, 331, 333, -1
SOLVES = (SOLVE, FORWARD, BACKWARD)
NOT_DEFINITE = (-4, -13)
"""Error codes of a Cholesky factorisation: the matrix is not positive definite, found at a column or within a block."""
NEGATIVE_EIGENVALUES, SINGLE_PRECISION, SCHUR_COMPLEMENT, BLOCK_SIZE = 22, 27, 35, 36
SETTINGS = {0: 1, 1: 2, 9: 8, 20: 1, 34: 1}
"""iparm by C index. 0: no defaults; 1: METIS ordering; 9: pivots below 1e-8 are perturbed; 20: 1×1 and 2×2 pivots;
34: indices count from zero. Iterative refinement (7) is off unless a pivot was perturbed."""
ONE_THREAD_BELOW = 8
"""Solves of fewer loads than this are bound by memory access, and a second thread slows them down."""
BLOCK_SIZES = (3, 2)
FILLED = 1.1
"""Largest ratio of entries stored in blocks to entries of the matrix."""
SAMPLED_ROWS = 1000
"""Block rows from which this ratio is estimated."""


class Pardiso:
    """One symmetric matrix in PARDISO: its upper triangle, its settings and its memory.

    Args:
        upper: Values, row starts and columns of the upper triangle.
        size: Number of unknowns.
        block: Size of the blocks of values.
    """

    def __init__(
        self, upper: tuple[np.ndarray, np.ndarray, np.ndarray], size: int, *, block: int, definite: bool, single: bool
    ) -> None:
        self._type = POSITIVE_DEFINITE if definite else SYMMETRIC_INDEFINITE
        self.precision = np.dtype(np.float32 if single else np.float64)
        self._values, self._starts, self._columns = upper
        self._size, self._block = size, block
        self._handle = np.zeros(64, np.int64)
        self._order = np.zeros(size, np.int32)
        self._iparm = np.zeros(64, np.int32)
        for index, value in SETTINGS.items():
            self._iparm[index] = value
        self._iparm[SINGLE_PRECISION] = single
        self._iparm[BLOCK_SIZE] = block if block > 1 else 0
        self._held, self._narrowed = True, False

    def free(self) -> None:
        """Release the memory of the factor; a second call does nothing."""
        if self._held:
            self._held = False
            self._call(RELEASE)

    def _call(self, phase: int, loads: np.ndarray | None = None, answer: np.ndarray | None = None) -> np.ndarray:
        """Run a phase of PARDISO; return the solution for loads (n, k) by columns, or what it writes to `answer`."""
        if loads is None:
            loads = np.zeros((self._size, 1), self.precision, order="F")
        if answer is None:
            answer = np.empty_like(loads)
        error, library = ctypes.c_int32(0), _library()

        def integer(value: int) -> object:
            return ctypes.byref(ctypes.c_int32(value))

        def start(array: np.ndarray) -> ctypes.c_void_p:
            # Not `array.ctypes`, which Python code converts within the call: ctypes makes an error of another kind of
            # an interrupt that comes then.
            return ctypes.c_void_p(array.ctypes.data)

        threads = 1 if phase in SOLVES and loads.shape[1] < ONE_THREAD_BELOW else 0
        self._narrowed |= threads == 1
        previous = library.MKL_Set_Num_Threads_Local(threads)
        library.pardiso(
            start(self._handle), integer(1), integer(1), integer(self._type), integer(phase),
            integer(self._size // self._block), start(self._values), start(self._starts), start(self._columns),
            start(self._order), integer(loads.shape[1]), start(self._iparm), integer(0), start(loads), start(answer),
            ctypes.byref(error),
        )  # fmt: skip
        library.MKL_Set_Num_Threads_Local(previous)
        if error.value in NOT_DEFINITE and self._type == POSITIVE_DEFINITE:
            raise StageError(
                f"linear solver: the stiffness matrix ({self._size} unknowns) is singular to machine precision. A part"
                " is not connected, or element sizes differ too much"
            )
        if error.value:
            raise StageError(f"linear solver: PARDISO error {error.value} in phase {phase} ({self._size} unknowns)")
        return answer


class PardisoFactor(Pardiso):
    """LDLᵀ of a symmetric matrix (n, n), both triangles given, with Bunch-Kaufman pivoting.

    Args:
        definite: Use Cholesky, whose solves are a third faster.
        single: Factorise and solve in single precision: half the time and the memory, seven digits.

    Raises:
        StageError: PARDISO refused the matrix.
    """

    def __init__(self, matrix: sparse.csr_matrix, definite: bool = False, single: bool = False) -> None:
        precision, block = np.dtype(np.float32 if single else np.float64), _block_size(matrix)
        super().__init__(
            upper_triangle(matrix, block, precision), matrix.shape[0], block=block, definite=definite, single=single
        )
        COUNTS["factorisations"] += 1
        self._call(ANALYSE_AND_FACTORISE)

    def refactorise(self, matrix: sparse.csr_matrix) -> None:
        """Factorise another matrix; ordering and analysis are reused if the pattern is the same.

        After a solve of fewer than `ONE_THREAD_BELOW` loads the analysis is repeated: PARDISO 2026.2 crashes if it
        factorises on more threads than it solved on.

        Raises:
            StageError: PARDISO refused the matrix.
        """
        COUNTS["factorisations"] += 1
        values, starts, columns = upper_triangle(matrix, self._block, self.precision)
        same = np.array_equal(starts, self._starts) and np.array_equal(columns, self._columns)
        if same and not self._narrowed:
            # In place: PARDISO keeps reading the arrays that it analysed.
            self._values[:] = values
            self._call(FACTORISE)
            return
        self._call(RELEASE)
        self._narrowed = False
        self._values, self._starts, self._columns = values, starts, columns
        self._call(ANALYSE_AND_FACTORISE)

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Return A⁻¹ loads, (n,) or (n, k), in the factor's precision."""
        block = np.asfortranarray(loads.reshape(self._size, -1), dtype=self.precision)
        return self._call(SOLVE, block).reshape(loads.shape)

    def negative_pivots(self) -> int:
        """Return the number of negative eigenvalues of A."""
        return int(self._iparm[NEGATIVE_EIGENVALUES])


def upper_triangle(
    matrix: sparse.csr_matrix, block: int, precision: np.dtype
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return values, row starts and columns of the upper triangle, in blocks or single entries."""
    blocks = (matrix if matrix.has_sorted_indices else matrix.sorted_indices()).tobsr((block, block))
    count = len(blocks.indptr) - 1
    rows = np.repeat(np.arange(count, dtype=np.int32), np.diff(blocks.indptr))
    upper = blocks.indices >= rows
    values, columns = blocks.data[upper].ravel(), blocks.indices[upper]
    starts = np.concatenate([[0], np.cumsum(np.bincount(rows[upper], minlength=count))])
    return np.ascontiguousarray(values, precision), starts.astype(np.int32), columns.astype(np.int32)


def find_library() -> Path | None:
    """Return the path of the run-time library of the `mkl` wheel, or None if it is not installed."""
    return min(Path(sys.prefix, "lib").glob("libmkl_rt.so*"), default=None)


def _block_size(matrix: sparse.csr_matrix) -> int:
    """Return the size of the full blocks of a matrix, estimated from some of its rows; 1 if it has none."""
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
