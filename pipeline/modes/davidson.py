"""Block Davidson method for the lowest elastic pairs of K φ = λ M φ.

A subspace V, M-orthonormal, grows by what a factor of K − σM makes of the residuals of its lowest Ritz pairs:

  Vᵀ K V y = θ y,   r = K V y − θ M V y,   V ← [V, (K − σM)⁻¹ r]

Residuals, orthogonalisation and the Ritz problem are in double precision, so the factor may be in single: it decides
how fast the pairs converge, not to what. All right-hand sides of a step are solved together. The method is that of
Davidson (1975) with the shift-and-invert operator as preconditioner; no pair restarts before the store is full.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import linalg
from scipy.linalg.blas import dgemm

from gudgeon.pipeline.linalg import Factor
from gudgeon.pipeline.modes.problem import Problem

RANK_TOLERANCE = 1e-12
"""Squares below this share of the largest are round-off of dependent columns, which are dropped."""
PASSES, CANCELLED = 3, 1e-2
"""Where less than this share of a square is left by orthogonalisation, it is orthogonalised again: what is lacking
grows by the root of its inverse from step to step, and a direction must not come to count twice."""
DEPENDENT = 1e-8
"""Coordinates of a restart below this are dependent."""
LEAST_COLUMNS = 8
"""Of a step: fewer cost the same."""
EAGERNESS = 0.5
"""A pair whose residual is below this share of what is asked takes no part in a step."""


@dataclass(frozen=True)
class Ritz:
    """The lowest Ritz pairs."""

    values: np.ndarray
    """θ [rad²/s²], ascending, (b,)."""
    vectors: np.ndarray
    """M-orthonormal, (free, b)."""
    converged: bool


class Subspace:
    """An M-orthonormal basis V beside the rigid motions, with K V and G = Vᵀ K V; columns are added in place.

    Args:
        capacity: Most columns.
    """

    def __init__(self, problem: Problem, capacity: int) -> None:
        self.problem, self.capacity, self.count = problem, capacity, 0
        size = problem.K.shape[0]
        self._V, self._KV = (np.empty((size, capacity), order="F") for _ in range(2))
        self._G = np.empty((capacity, capacity))

    @property
    def V(self) -> np.ndarray:
        """(free, count)"""
        return self._V[:, : self.count]

    @property
    def KV(self) -> np.ndarray:
        """(free, count)"""
        return self._KV[:, : self.count]

    def add(self, columns: np.ndarray) -> int:
        """Add what columns (free, k) hold beside the basis; return how many directions that was."""
        W = self._beside(np.asfortranarray(columns, dtype=float))
        first, last = self.count, self.count + W.shape[1]
        self._V[:, first:last] = W
        self._KV[:, first:last] = KW = self.problem.K @ W
        self.count = last
        self._G[:last, first:last] = block = self.V.T @ KW
        self._G[first:last, :last] = block.T
        return last - first

    def _beside(self, W: np.ndarray) -> np.ndarray:
        """Return an M-orthonormal basis of columns W beside V; W is overwritten."""
        for _ in range(PASSES):
            MW = self.problem.M @ W
            gram = W.T @ MW
            before = gram.diagonal().copy()
            for basis, M_basis in ((self.problem.rigid, self.problem.M_rigid), (self.V, None)):
                # The rigid motions' products are at hand; what they take off MW is none of V's.
                inside = basis.T @ MW if M_basis is None else M_basis.T @ W
                W = dgemm(-1.0, basis, inside, 1.0, W, overwrite_c=1)
                gram -= inside.T @ inside
            left = gram.diagonal()
            new = left > RANK_TOLERANCE * before
            if not new.any():
                return W[:, :0]
            scale = 1 / np.sqrt(left[new])
            strength, directions = linalg.eigh(gram[np.ix_(new, new)] * scale * scale[:, None])
            kept = strength > RANK_TOLERANCE * strength[-1]
            W = np.asfortranarray(W[:, new]) if not new.all() else W
            W = dgemm(1.0, W, scale[:, None] * directions[:, kept] / np.sqrt(strength[kept]))
            if (left[new] / before[new]).min() * strength[kept].min() > CANCELLED:
                break
        return W

    def ritz(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest Ritz values (count,) and their coordinates (columns, count)."""
        G = self._G[: self.count, : self.count]
        return linalg.eigh(0.5 * (G + G.T), subset_by_index=[0, min(count, self.count) - 1])

    def restart(self, Y: np.ndarray) -> None:
        """Keep the span of coordinates Y (columns, k) alone."""
        Q, R, _ = linalg.qr(Y, mode="economic", pivoting=True)
        Q = Q[:, np.abs(R.diagonal()) > DEPENDENT]
        G = Q.T @ self._G[: self.count, : self.count] @ Q
        kept = Q.shape[1]
        for whole, columns in ((self._V, self.V), (self._KV, self.KV)):
            whole[:, :kept] = dgemm(1.0, columns, Q)
        self._G[:kept, :kept] = G
        self.count = kept


def davidson(
    problem: Problem,
    start: np.ndarray,
    factor: Callable[[np.ndarray, np.ndarray], Factor],
    count: int,
    tolerance: tuple[float, float],
    most_steps: int,
    capacity: int,
) -> Ritz:
    """Converge the lowest pairs from a start.

    Args:
        start: (free, b), b at least `count`: the rest guards the last wanted pairs.
        factor: Returns a factor of K − σM for Ritz values (b,) and residuals (free, b).
        count: How many pairs have to converge.
        tolerance: Of ‖K x − θ M x‖ / ‖K x‖, or over θ where that is more [1, rad²/s²].
        most_steps: After these the pairs are given back as they are.
        capacity: Most columns of the subspace, at least 4 b.
    """
    block, space, before, step = start.shape[1], Subspace(problem, capacity), None, 0
    space.add(start)
    while True:
        values, Y = space.ritz(block)
        # By dgemm, twice as fast here as numpy's product, whose result is by rows.
        rest = dgemm(1.0, space.KV, Y)
        reached = 1 / np.linalg.norm(rest, axis=0)
        rest -= problem.M @ dgemm(1.0, space.V, Y * values)
        reached *= np.linalg.norm(rest, axis=0)
        reached /= np.maximum(tolerance[0], tolerance[1] / values)
        converged = bool(np.all(reached[:count] <= 1))
        if converged or step == most_steps:
            return Ritz(values, dgemm(1.0, space.V, Y), converged)
        wanted = (reached > EAGERNESS) | (np.arange(len(values)) >= count)
        wanted[np.argsort(-reached)[:LEAST_COLUMNS]] = True
        if space.count + wanted.sum() > capacity:
            # With the last step's pairs a restart loses little (Stathopoulos & Saad 1998).
            held = before if before is not None else Y[:, :0]
            space.restart(np.column_stack([Y, np.pad(held, ((0, space.count - len(held)), (0, 0)))]))
            before = None
        else:
            before = Y
        shifted, rest = factor(values, rest), rest[:, wanted]
        grown = space.add(shifted.solve(rest))
        # Where nothing is left to add the pairs are what they can be.
        step = step + 1 if grown else most_steps
