"""Lowest eigenpairs of K v = λ M v with Hermitian sparse K = A + iB: shift-invert with the real factor of

  [A −B; B A],

which is symmetric and has every eigenvalue of K twice, so that the inertia count works as for real matrices.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg, sparse
from scipy.sparse.linalg import LinearOperator, eigsh

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.linalg import factorise
from gudgeon.pipeline.modes.lanczos import eigenvalue_unit
from gudgeon.pipeline.modes.normal import ROUND_OFF_SHARE

DENSE = 400
"""Unknowns up to which all eigenpairs are computed at once."""
SPARE = 3
"""Modes beyond those wanted, so that the inertia count finds a gap to stand in."""
GAP = 1e-6
"""Eigenvalues closer than this share are one for the inertia count."""
RESIDUAL_TOLERANCE = 1e-8
ORTHOGONALITY_TOLERANCE = 1e-10
RIGID_SHARE = 1e-6
"""Eigenvalues of the rigid motions over the first elastic one, at most."""


@dataclass(frozen=True)
class Problem:
    """Stiffness and mass, real or Hermitian, and the rigid motions in their null space."""

    K: sparse.csr_matrix
    M: sparse.csr_matrix
    rigid: np.ndarray
    """M-orthonormal, (m, r)."""


@dataclass(frozen=True)
class Inertia:
    """Sylvester's count: K − σM has as many negative eigenvalues as there are eigenvalues below σ."""

    shift: float
    """σ, in a gap above the wanted ones [rad²/s²]."""
    found: int
    """Elastic eigenvalues below it, by the signs of the factor's pivots."""
    expected: int
    """Elastic eigenvalues below it among those extracted."""


@dataclass(frozen=True)
class Pairs:
    """Elastic eigenpairs."""

    values: np.ndarray
    """[rad²/s²], (count,), ascending."""
    vectors: np.ndarray
    """M-orthonormal, (m, count)."""
    residuals: np.ndarray
    """‖Kv − λMv‖ / ‖Kv‖ of each, (count,)."""
    orthogonality: float
    """Largest entry of VᴴMV − I."""
    inertia: Inertia


class _Inverse:
    """(K − σM)⁻¹ of a Hermitian matrix, by a real factor."""

    def __init__(self, matrix: sparse.csr_matrix) -> None:
        self.real = not np.iscomplexobj(matrix)
        whole = matrix
        if not self.real:
            A, B = (
                sparse.csr_matrix((part, matrix.indices, matrix.indptr), shape=matrix.shape)
                for part in (np.real(matrix.data), np.imag(matrix.data))
            )
            whole = sparse.bmat([[A, -B], [B, A]])
        self.factor = factorise(sparse.csr_matrix(whole))

    def solve(self, load: np.ndarray) -> np.ndarray:
        if self.real:
            return self.factor.solve(np.ascontiguousarray(np.real(load)))
        answer = self.factor.solve(np.concatenate([np.real(load), np.imag(load)]))
        half = len(load)
        return answer[:half] + 1j * answer[half:]

    def negative(self) -> int:
        return self.factor.negative_pivots() // (1 if self.real else 2)


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
    size, rigid = problem.K.shape[0], problem.rigid.shape[1]
    most = size - rigid
    if count > most:
        raise StageError(f"modes: {count} asked of {most} elastic ones; refine the mesh or ask for fewer")
    extracted = min(count + SPARE, most)
    vectors = _dense(problem, extracted) if size <= max(DENSE, 2 * extracted) else _lanczos(problem, extracted)
    values, vectors, residuals, orthogonality = _verified(problem, vectors, extracted)
    inertia = _counted(problem, values, count, extracted == most)
    if inertia.found != inertia.expected:
        raise StageError(
            f"modes: the inertia count finds {inertia.found} elastic modes, {inertia.expected} were extracted"
        )
    return Pairs(values[:count], vectors[:, :count], residuals[:count], orthogonality, inertia)


def _dense(problem: Problem, count: int) -> np.ndarray:
    rigid = problem.rigid.shape[1]
    last = rigid + count - 1
    values, vectors = linalg.eigh(problem.K.toarray(), problem.M.toarray(), subset_by_index=(0, last))
    if rigid and np.abs(values[:rigid]).max() > RIGID_SHARE * values[rigid]:
        raise StageError(f"modes: rigid motions have the eigenvalue {values[rigid - 1]:.2g}")
    return vectors[:, rigid:]


def _lanczos(problem: Problem, count: int) -> np.ndarray:
    K, M, rigid = problem.K, problem.M, problem.rigid
    kind = complex if np.iscomplexobj(K) else float
    M_rigid = M @ rigid
    shift = -_estimate(problem) if rigid.shape[1] else 0.0
    inverse = _Inverse(sparse.csr_matrix(K - shift * M))

    def invert(load: np.ndarray) -> np.ndarray:
        answer = inverse.solve(np.ravel(load))
        return answer - rigid @ (M_rigid.conj().T @ answer)

    start = np.random.default_rng(0).standard_normal(K.shape[0]).astype(kind)
    start -= rigid @ (M_rigid.conj().T @ start)
    unit = eigenvalue_unit(invert(M @ start), start, M)
    operator = LinearOperator(K.shape, lambda load: unit * invert(load), dtype=kind)
    vectors = eigsh(K, count, M=M, sigma=shift / unit, v0=start, OPinv=operator)[1]
    inverse.factor.free()
    return vectors


def _estimate(problem: Problem) -> float:
    """Return an eigenvalue scale below the first elastic one: the quotient of a static answer / 100."""
    K, M, rigid = problem.K, problem.M, problem.rigid
    grounded = linalg.qr(rigid.conj().T, mode="economic", pivoting=True)[2][: rigid.shape[1]]
    free = np.setdiff1d(np.arange(K.shape[0]), grounded)
    inverse = _Inverse(sparse.csr_matrix(K[free][:, free]))
    u = np.random.default_rng(0).standard_normal(K.shape[0]).astype(K.dtype)
    for _ in range(2):
        load = M @ u
        load -= (M @ rigid) @ (rigid.conj().T @ load)
        u = np.zeros(K.shape[0], K.dtype)
        u[free] = inverse.solve(load[free])
        u -= rigid @ (rigid.conj().T @ (M @ u))
    inverse.factor.free()
    return float(np.real(np.vdot(u, K @ u)) / np.real(np.vdot(u, M @ u))) / 100


def _counted(problem: Problem, values: np.ndarray, count: int, whole: bool) -> Inertia:
    """Count the elastic eigenvalues below the first gap after the last wanted one.

    Args:
        values: Of the extracted ones, (extracted,).
        whole: Whether these are all there are, so that any shift above the last one stands in a gap.
    """
    last = count - 1
    while last + 1 < len(values) and values[last + 1] / values[last] - 1 < GAP:
        last += 1
    if last + 1 == len(values) and not whole:
        last -= 1  # No gap among the spare ones: the count says whether the last extracted ones are all of their kind.
    sigma = 0.5 * (values[last] + values[last + 1]) if last + 1 < len(values) else 2 * values[last]
    inverse = _Inverse(sparse.csr_matrix(problem.K - sigma * problem.M))
    found = inverse.negative() - problem.rigid.shape[1]
    inverse.factor.free()
    return Inertia(float(sigma), found, last + 1)


def _verified(problem: Problem, vectors: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return the Ritz pairs of the vectors' span, checked: values, vectors, residuals, orthogonality."""
    K, M = problem.K, problem.M
    basis = orthonormal(vectors - problem.rigid @ ((M @ problem.rigid).conj().T @ vectors), M)
    values, turn = linalg.eigh(basis.conj().T @ (K @ basis))
    vectors = basis @ turn[:, :count]
    forces = K @ vectors
    rest = np.linalg.norm(forces - (M @ vectors) * values[:count], axis=0) / np.linalg.norm(forces, axis=0)
    orthogonality = float(np.abs(vectors.conj().T @ (M @ vectors) - np.eye(count)).max())
    floor = np.finfo(float).eps * float((np.real(K.diagonal()) / np.real(M.diagonal())).max())
    allowed = np.maximum(RESIDUAL_TOLERANCE, ROUND_OFF_SHARE * floor / values[:count])
    if np.any(rest > allowed) or orthogonality > ORTHOGONALITY_TOLERANCE:
        raise StageError(f"modes: residual {rest.max():.2g}, orthogonality {orthogonality:.2g}: not accepted")
    return values[:count], vectors, rest, orthogonality
