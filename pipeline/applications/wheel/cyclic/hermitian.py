"""Lowest eigenpairs of K v = λ M v with Hermitian sparse K = A + iB: shift-invert with the real factor of

  [A −B; B A],

which is symmetric and has every eigenvalue of K twice, so that the inertia count works as for real matrices.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg, sparse

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.linalg import factorise
from gudgeon.pipeline.modes.block_lanczos import block_lanczos, capacity
from gudgeon.pipeline.modes.block_method import LEAST_DOFS
from gudgeon.pipeline.modes.lanczos import inverse_lanczos, static_estimate
from gudgeon.pipeline.modes.problem import Problem, count_shift, refuse_stiff_rigid

DENSE = 400
"""Unknowns up to which eigenpairs are computed with dense matrices."""
SPARE = 3
"""Modes beyond the wanted ones, so that there is a gap for the inertia count."""


@dataclass(frozen=True)
class Pairs:
    """Elastic eigenpairs."""

    values: np.ndarray
    """[rad²/s²], (count,), ascending."""
    vectors: np.ndarray
    """M-orthonormal, (m, count)."""
    residuals: np.ndarray
    """‖Kv − λMv‖ / ‖Kv‖ of each, (count,)."""
    quality: dict[str, float]
    """As in `CyclicHarmonic`: largest entry of VᴴMV − I, and Sylvester's count: K − σM has as many negative
    eigenvalues, by the signs of its factor's pivots, as there are eigenvalues below σ, in a gap above the wanted."""


class HermitianFactor:
    """A⁻¹ of a Hermitian matrix, by a real factor."""

    def __init__(self, matrix: sparse.csr_matrix, definite: bool = False) -> None:
        self.real = not np.iscomplexobj(matrix)
        real_form = matrix
        if not self.real:
            A, B = (
                sparse.csr_matrix((data, matrix.indices, matrix.indptr), shape=matrix.shape)
                for data in (np.real(matrix.data), np.imag(matrix.data))
            )
            real_form = sparse.bmat([[A, -B], [B, A]])
        self.factor = factorise(sparse.csr_matrix(real_form), definite=definite)

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Return A⁻¹ loads, (m,) or (m, k)."""
        if self.real:
            return self.factor.solve(np.ascontiguousarray(np.real(loads)))
        answer = self.factor.solve(np.concatenate([np.real(loads), np.imag(loads)]))
        return answer[: len(loads)] + 1j * answer[len(loads) :]

    def negative_pivots(self) -> int:
        """Return the number of negative eigenvalues of A."""
        return self.factor.negative_pivots() // (1 if self.real else 2)

    def free(self) -> None:
        """Release the memory of the factor."""
        self.factor.free()


def orthonormal(vectors: np.ndarray, M: sparse.csr_matrix) -> np.ndarray:
    """Return M-orthonormal columns of the same span."""
    if not vectors.shape[1]:
        return vectors
    L = linalg.cholesky(vectors.conj().T @ (M @ vectors), lower=True)
    return linalg.solve_triangular(L, vectors.conj().T, lower=True).conj().T


def lowest_pairs(problem: Problem, count: int) -> Pairs:
    """Return the lowest `count` elastic eigenpairs, none missed.

    Raises:
        StageError: there are fewer, one was missed, or one is not exact enough.
    """
    size = problem.K.shape[0]
    elastic_count = size - problem.rigid.shape[1]
    if count > elastic_count:
        raise StageError(
            f"modes: {count} requested, there are {elastic_count} elastic ones; refine the mesh or request fewer"
        )
    extracted = min(count + SPARE, elastic_count)
    vectors = _dense(problem, extracted) if size <= max(DENSE, 2 * extracted) else _lanczos(problem, extracted)
    values, vectors, residuals, orthogonality = _verified(problem, vectors, extracted)
    # Below the first gap after the last wanted one.
    shift, expected = count_shift(values, count, complete=extracted == elastic_count)
    factor = HermitianFactor(sparse.csr_matrix(problem.K - shift * problem.M))
    counted = factor.negative_pivots() - problem.rigid.shape[1]
    factor.free()
    if counted != expected:
        raise StageError(f"modes: the inertia count finds {counted} elastic modes, {expected} were extracted")
    quality = {"orthogonality": orthogonality, "shift": shift, "found": counted, "expected": expected}
    return Pairs(values[:count], vectors[:, :count], residuals[:count], quality)


def _dense(problem: Problem, count: int) -> np.ndarray:
    rigid = problem.rigid.shape[1]
    stop = rigid + count - 1
    values, vectors = linalg.eigh(problem.K.toarray(), problem.M.toarray(), subset_by_index=(0, stop))
    refuse_stiff_rigid(values, rigid, "in the whole problem")
    return vectors[:, rigid:]


def _lanczos(problem: Problem, count: int) -> np.ndarray:
    """Return `count` vectors, by blocks where the matrices are large, else or if that fails with single columns."""
    shift = -static_estimate(problem, HermitianFactor) if problem.rigid.shape[1] else 0.0
    factor = HermitianFactor(sparse.csr_matrix(problem.K - shift * problem.M), definite=True)
    size = problem.K.shape[0]
    if size >= LEAST_DOFS and size >= 2 * capacity(count):
        pairs = block_lanczos(problem, lambda loads: problem.elastic(factor.solve(loads)), shift, count)
        if pairs is not None:
            factor.free()
            return pairs.vectors
    return inverse_lanczos(problem, shift, count, factor)[1]


def _verified(problem: Problem, vectors: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return the checked Ritz pairs of the vectors' span: values, vectors, residuals, orthogonality."""
    K, M = problem.K, problem.M
    basis = orthonormal(problem.elastic(vectors), M)
    values, turn = linalg.eigh(basis.conj().T @ (K @ basis))
    values, vectors = values[:count], basis @ turn[:, :count]
    forces = K @ vectors
    residuals = np.linalg.norm(forces - (M @ vectors) * values, axis=0) / np.linalg.norm(forces, axis=0)
    orthogonality = float(np.abs(vectors.conj().T @ (M @ vectors) - np.eye(count)).max())
    problem.refuse_inexact(values, residuals, orthogonality)
    return values, vectors, residuals, orthogonality
