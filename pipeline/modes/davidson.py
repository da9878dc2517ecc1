"""Block Davidson method for the lowest elastic pairs of K φ = λ M φ.

An M-orthonormal subspace V is extended by solutions of K − σM for the residuals of its lowest Ritz pairs:

  Vᵀ K V y = θ y,   r = K V y − θ M V y,   V ← [V, (K − σM)⁻¹ r]

Residuals, orthogonalisation and the Ritz problem are in double precision, so the factor may be in single: it affects
the rate of convergence, not the result. All right-hand sides of a step are solved together. The method is that of
Davidson (1975) with the shift-and-invert operator as preconditioner; it restarts when the subspace is full.
"""

from collections.abc import Callable

import numpy as np
from scipy import linalg
from scipy.linalg.blas import dgemm

from gudgeon.pipeline.linalg import Factor
from gudgeon.pipeline.modes.problem import Pairs, Problem

RANK_TOLERANCE = 1e-12
"""Squared norms below this share of the largest are round-off of dependent columns, which are dropped."""
PASSES, CANCELLED = 3, 1e-2
"""If orthogonalisation leaves less than this share of a squared norm, it is repeated: otherwise the lack of
orthogonality grows by the root of its inverse from step to step, until a direction counts twice."""
DEPENDENT = 1e-8
"""Diagonal entries of R below this mark dependent coordinates at a restart."""
LEAST_COLUMNS = 8
"""Least number of loads of a step: fewer take the same time."""
EAGERNESS = 0.5
"""Guard pairs below this share of the tolerance are left out of a step."""


class Subspace:
    """An M-orthonormal basis V, M-orthogonal to the rigid motions, with K V and G = Vᵀ K V; columns are added in place.

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
        """Add the components of columns (free, k) that the basis lacks; return the number of new directions."""
        W = self._beside(np.asfortranarray(columns, dtype=float))
        first, last = self.count, self.count + W.shape[1]
        self._V[:, first:last] = W
        self._KV[:, first:last] = KW = self.problem.K @ W
        self.count = last
        self._G[:last, first:last] = block = self.V.T @ KW
        self._G[first:last, :last] = block.T
        return last - first

    def _beside(self, W: np.ndarray) -> np.ndarray:
        """Return an M-orthonormal basis of what columns W have outside V; W is overwritten."""
        for _ in range(PASSES):
            MW = self.problem.M @ W
            gram = W.T @ MW
            before = gram.diagonal().copy()
            for basis, M_basis in ((self.problem.rigid, self.problem.M_rigid), (self.V, None)):
                # M Φ_r is known, and MW needs no update: V is M-orthogonal to Φ_r.
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
        """Reduce the basis to the span of coordinates Y (columns, k)."""
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
    *,
    most_steps: int,
    capacity: int,
) -> tuple[Pairs, bool]:
    """Return the lowest elastic Ritz pairs from start vectors, as many as these, and whether they converged.

    Args:
        start: (free, b), b at least `count`: further pairs guard the last wanted ones.
        factor: Returns a factor of K − σM for Ritz values (b,) and residuals (free, b).
        count: How many pairs have to converge.
        tolerance: Of ‖K x − θ M x‖ / ‖K x‖: relative [1], or absolute over θ [rad²/s²], whichever is larger.
        most_steps: After these the pairs are returned unconverged.
        capacity: Most columns of the subspace, at least 4 b.
    """
    block, space, before, step = start.shape[1], Subspace(problem, capacity), None, 0
    space.add(start)
    while True:
        values, Y = space.ritz(block)
        # dgemm is twice as fast here as numpy's product, whose result is stored by rows.
        rest = dgemm(1.0, space.KV, Y)
        reached = 1 / np.linalg.norm(rest, axis=0)
        rest -= problem.M @ dgemm(1.0, space.V, Y * values)
        reached *= np.linalg.norm(rest, axis=0)
        reached /= np.maximum(tolerance[0], tolerance[1] / values)
        converged = bool(np.all(reached[:count] <= 1))
        if converged or step == most_steps:
            return Pairs(values, dgemm(1.0, space.V, Y)), converged
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
        # Without a new direction the pairs cannot improve.
        step = step + 1 if grown else most_steps
