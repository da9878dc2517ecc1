"""The eigenproblem K φ = λ M φ of a model's free dofs, beside its rigid motions, and what extracts pairs of it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from gudgeon.pipeline.fem.model import FEModel


@dataclass(frozen=True)
class Problem:
    """The dofs that no support holds."""

    K: sparse.csr_matrix
    M: sparse.csr_matrix
    rigid: np.ndarray
    """Φ_r, M-orthonormal, (free, r)."""

    @classmethod
    def of(cls, model: FEModel) -> "Problem":
        """Return that of a model."""
        return cls(*model.free_matrices(), model.rigid_modes[model.free])

    def in_order(self, order: np.ndarray) -> "Problem":
        """Return the problem with its dofs in another order, (free,)."""
        K, M = (sparse.csr_matrix(A[order][:, order]) for A in (self.K, self.M))
        K.sort_indices()
        M.sort_indices()
        return Problem(K, M, self.rigid[order])

    @cached_property
    def M_rigid(self) -> np.ndarray:
        """M Φ_r, (free, r)."""
        return self.M @ self.rigid

    @cached_property
    def highest(self) -> float:
        """max(K_ii / M_ii) [rad²/s²]: times the round-off unit, what the eigenvalues are uncertain by."""
        return float((self.K.diagonal() / self.M.diagonal()).max())

    def elastic(self, columns: np.ndarray) -> np.ndarray:
        """Return columns (free, k) without what they hold of the rigid motions."""
        return columns - self.rigid @ (self.M_rigid.T @ columns)


@dataclass(frozen=True)
class Pairs:
    """Elastic eigenpairs, the lowest ones."""

    values: np.ndarray
    """λ [rad²/s²], ascending, (k,); those behind the wanted ones need not be exact, but are upper bounds."""
    vectors: np.ndarray
    """M-orthonormal, (free, at least the wanted ones)."""
    proven: tuple[float, int] | None = None
    """A shift [rad²/s²] above the wanted ones, and how many elastic eigenvalues an inertia count found below it."""
