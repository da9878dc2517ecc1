"""Block Lanczos method for the lowest elastic pairs of K φ = λ M φ, real or Hermitian.

An M-orthonormal basis V is extended by (K − σM)⁻¹ M times its last block (Golub & Underwood 1977; with a shift: Grimes,
Lewis & Simon 1994). All of V is orthogonalised against, twice, so that T = Vᴴ M (K − σM)⁻¹ M V is a projection:

  T y = θ y,  λ = σ + 1/θ,  (K − σM)⁻¹ M V y = θ V y + Q β y.

Q is the next block. One step of the inverse, x = V y + Q β y / θ, costs nothing, and filters stiff motion, which weighs
most in a residual, by the ratio of eigenvalues. A full basis is replaced by its Ritz vectors (Wu & Simon 2000).
"""

from collections.abc import Callable

import numpy as np
from scipy import linalg

from gudgeon.pipeline.modes.problem import Pairs, Problem

EVEN = 1e-3
"""If the weakest direction is stronger than this share of the strongest, one normalisation leaves 1e-13."""
BLOCK = 8
"""Columns of a step: of more the solves are cheaper each, but more of them are needed; 6 to 16 take the same time."""
DEPENDENT = 1e-24
"""Least share of a column's squared norm outside the basis: less is round-off. Bending of slender bodies reaches it."""
RANK_TOLERANCE = 1e-12
"""Directions of normalised columns below this share of the strongest are round-off too."""
STEP_TOLERANCE, LEAST_STEP = 3e-9, 3e-13
"""Of ‖β y‖ / θ: residuals of pairs that reach the first are computed; further steps do not improve those at the second.
"""
TOLERANCE, FLOORS = 3e-9, 3.0
"""Of ‖K φ − λ M φ‖ / ‖K φ‖; or so many times the round-off of the eigenvalues over the eigenvalue."""
GUARD_SHARE, GUARD_TOLERANCE = 8, 1e-3
"""One further pair per so many wanted ones, and two, converge to this: eigenvalues above the wanted are then known."""
MOST_RESTARTS = 10


class Basis:
    """M-orthonormal columns V and the projection T of the inverse onto them.

    Args:
        capacity: Most columns.
    """

    def __init__(self, problem: Problem, capacity: int) -> None:
        self._M, kind = problem.M, problem.K.dtype
        self._V = np.empty((problem.K.shape[0], capacity), kind, order="F")
        self._T = np.zeros((capacity, capacity), kind)
        self._gemm = linalg.get_blas_funcs("gemm", dtype=kind)
        self.count = 0

    @property
    def V(self) -> np.ndarray:
        """(free, count)"""
        return self._V[:, : self.count]

    def add(self, Q: np.ndarray) -> None:
        """Add M-orthonormal columns (free, b) that are M-orthogonal to V."""
        self._V[:, self.count : self.count + Q.shape[1]] = Q
        self.count += Q.shape[1]

    def beside(self, W: np.ndarray, inverted: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """Return Q, M-orthonormal, (free, c), and β (c, b), so that Q β is what columns W (free, b) have outside V.

        Args:
            inverted: Number of last columns of V of which W is the inverse: their part of T is stored.
        """
        beta, coefficients = np.eye(W.shape[1], dtype=W.dtype), np.zeros((self.count, W.shape[1]), W.dtype)
        Q, threshold = np.asfortranarray(W), 0.0
        for normalised in (False, True, True):
            if not Q.shape[1]:
                break
            MQ = np.asfortranarray(self._M @ Q)
            gram = Q.conj().T @ MQ
            if not normalised:
                threshold = DEPENDENT * np.real(gram.diagonal())
            within = self._gemm(1.0, self.V, MQ, trans_a=2) if self.count else coefficients[:, : Q.shape[1]]
            if self.count:
                Q = self._gemm(-1.0, self.V, within, 1.0, Q, overwrite_c=1)
                coefficients += within @ beta
            if not normalised:
                continue
            gram -= within.conj().T @ within
            residual = np.real(gram.diagonal())
            new, threshold = residual > threshold, DEPENDENT
            size = np.sqrt(np.where(new, residual, 0.0))
            scale = np.divide(1.0, size, out=np.zeros(len(size)), where=new)
            strength, turn = linalg.eigh(gram * scale * scale[:, None])
            independent = strength > RANK_TOLERANCE * max(strength[-1], 0.0)
            root = np.sqrt(strength[independent])
            Q = self._gemm(1.0, Q, scale[:, None] * turn[:, independent] / root)
            beta = (root[:, None] * turn[:, independent].conj().T * size) @ beta
            if new.all() and strength[0] > EVEN * strength[-1]:
                break
        if inverted:
            span = slice(self.count - inverted, self.count)
            self._T[: self.count, span] = coefficients
            self._T[span, : self.count] = coefficients.conj().T
        return Q, beta

    def ritz(self) -> tuple[np.ndarray, np.ndarray]:
        """Return all Ritz values θ of the inverse, descending, (count,), and their coordinates (count, count)."""
        T = self._T[: self.count, : self.count]
        theta, Y = linalg.eigh(0.5 * (T + T.conj().T))
        return theta[::-1], Y[:, ::-1]

    def combined(self, Y: np.ndarray) -> np.ndarray:
        """Return V Y, (free, k)."""
        return self._gemm(1.0, self.V, Y)

    def restart(self, theta: np.ndarray, Y: np.ndarray) -> None:
        """Replace the basis by Ritz vectors V Y, (k,) and (count, k)."""
        self._V[:, : len(theta)] = self.combined(Y)
        self._T[:] = 0.0
        self._T[range(len(theta)), range(len(theta))] = theta
        self.count = len(theta)


def guards(count: int) -> int:
    """Return how many pairs beyond the wanted ones are nearly exact."""
    return 2 + count // GUARD_SHARE


def capacity(count: int) -> int:
    """Return the most columns of a basis for so many pairs."""
    return 3 * (count + guards(count)) + 10 * BLOCK


def block_lanczos(
    problem: Problem, inverse: Callable[[np.ndarray], np.ndarray], shift: float, count: int
) -> Pairs | None:
    """Return the lowest `count` elastic pairs, and the values of some more; None if they did not converge.

    Args:
        inverse: From loads (free, k), which it may overwrite, to elastic displacements (K − σM)⁻¹ loads.
        shift: σ [rad²/s²], below all elastic eigenvalues.
    """
    size, target = problem.K.shape[0], count + guards(count)
    basis, restarts, step_tolerance = Basis(problem, capacity(count)), 0, STEP_TOLERANCE
    rng = np.random.default_rng(0)
    start = rng.standard_normal((size, BLOCK)).astype(problem.K.dtype)
    Q, _ = basis.beside(inverse(problem.M @ start))
    floor = FLOORS * np.finfo(float).eps * problem.highest
    while Q.shape[1]:
        basis.add(Q)
        Q, beta = basis.beside(inverse(problem.M @ Q), inverted=Q.shape[1])
        if basis.count < target:
            continue
        theta, Y = basis.ritz()
        ahead = beta @ Y[basis.count - beta.shape[1] :, :target]
        reached = np.linalg.norm(ahead, axis=0) / theta[:target]
        if reached[:count].max() <= step_tolerance and reached.max() <= GUARD_TOLERANCE:
            values, lowest = shift + 1 / theta[:target], slice(0, count)
            vectors = basis.combined(Y[:, lowest]) + Q @ (ahead[:, lowest] / theta[lowest])
            if step_tolerance < LEAST_STEP or _exact(problem, values[lowest], vectors, floor):
                return Pairs(values, vectors)
            step_tolerance /= 10
        if basis.count + Q.shape[1] > capacity(count):
            restarts += 1
            if restarts > MOST_RESTARTS:
                return None
            restart_count = target + BLOCK
            basis.restart(theta[:restart_count], Y[:, :restart_count])
    return None


def _exact(problem: Problem, values: np.ndarray, vectors: np.ndarray, floor: float) -> bool:
    """Return whether residuals of pairs (k,), (free, k) are within tolerance."""
    forces = problem.K @ vectors
    sizes = np.linalg.norm(forces, axis=0)
    forces -= (problem.M @ vectors) * values
    return bool(np.all(np.linalg.norm(forces, axis=0) <= sizes * np.maximum(TOLERANCE, floor / values)))
