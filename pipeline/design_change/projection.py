"""A body in a basis of few displacements V: its modes, static responses and flexibility by Galerkin's method.

With the rigid motions Φ_r of the body taken off, V' = V − Φ_r (Φ_rᵀ M V), the eigenpairs of VᵀKV and V'ᵀMV' are Ritz
pairs, whose values are upper bounds, and B V' (VᵀKV)⁻¹ (B V')ᵀ is a lower bound of the flexibility B G Bᵀ. What this
lacks is the flexibility of displacements outside V, positive semidefinite, which hardly depends on the shape of the
body where V has its global displacements.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import linalg, sparse

from gudgeon.pipeline.fem.model import FEModel

INDEPENDENT = 1e-13
"""Directions of K-normalised columns below this share of the largest are dropped as dependent."""


@dataclass(frozen=True)
class Target:
    """A body whose modes and static responses are wanted."""

    model: FEModel
    B: sparse.csr_matrix
    """Displacement conjugate to each force on its rows, (c, dofs)."""
    loads: np.ndarray
    """Forces on the rows, smooth pressures and unit loads, whose response is wanted and certified, (c, k)."""
    pressures: np.ndarray
    """Forces on the rows whose response is wanted, (c, p)."""
    weights: np.ndarray
    """Nodal forces whose response is wanted, (dofs, w)."""
    count: int
    """Number of normal modes."""

    @cached_property
    def rigid(self) -> np.ndarray:
        """Rigid motions Φ_r, (dofs, r)."""
        return self.model.rigid_modes

    @cached_property
    def M_rigid(self) -> np.ndarray:
        """M Φ_r, (dofs, r)."""
        return self.model.M @ self.rigid

    def elastic(self, displacements: np.ndarray) -> np.ndarray:
        """Return displacements (dofs, k) without their rigid motions."""
        return displacements - self.rigid @ (self.M_rigid.T @ displacements)

    def balanced(self, forces: np.ndarray) -> np.ndarray:
        """Return forces (dofs, k) less those that inertia balances, zero where the body is held."""
        remainder = forces - self.M_rigid @ (self.rigid.T @ forces)
        remainder[self.model.held] = 0.0
        return remainder


class Projection:
    """A body in a basis."""

    def __init__(self, target: Target, columns: np.ndarray, inner: "Projection | None" = None) -> None:
        """Project the matrices of a body.

        Args:
            columns: Displacements, zero where the body is held, (dofs, w); they may be dependent.
            inner: The body in a basis that these columns extend.
        """
        K_columns, M_columns = target.model.K @ columns, target.model.M @ columns
        self.target, self._basis = target, columns
        self._stiffness, self._mass = columns.T @ K_columns, columns.T @ M_columns
        self._momentum, self._at_rows = M_columns.T @ target.rigid, target.B @ columns
        if inner is not None:
            self._basis = np.column_stack([inner._basis, columns])
            self._stiffness = _bordered(inner._stiffness, inner._basis.T @ K_columns, self._stiffness)
            self._mass = _bordered(inner._mass, inner._basis.T @ M_columns, self._mass)
            self._momentum = np.concatenate([inner._momentum, self._momentum])
            self._at_rows = np.column_stack([inner._at_rows, self._at_rows])
        self._turn = independent(self._stiffness)
        self._rigid_parts = self._turn.T @ self._momentum
        M = self._turn.T @ self._mass @ self._turn - self._rigid_parts @ self._rigid_parts.T
        inverse_values, Z = linalg.eigh(0.5 * (M + M.T))
        self.values = 1 / inverse_values[::-1]
        """Ritz values [rad²/s²], ascending, (v,)."""
        self._Z = Z[:, ::-1]
        self.rows = self._at_rows @ self._turn - (target.B @ target.rigid) @ self._rigid_parts.T
        """B V' of the K-orthonormal combinations V of the basis, (c, v)."""

    @property
    def flexibility(self) -> np.ndarray:
        """B V' (VᵀKV)⁻¹ (B V')ᵀ [m/N], (c, c)."""
        return self.rows @ self.rows.T

    def shapes(self, count: int) -> np.ndarray:
        """Return the lowest M-orthonormal Ritz vectors, (dofs, count)."""
        return self._displaced(self._Z[:, :count] * np.sqrt(self.values[:count]))

    def responses(self, loads: np.ndarray) -> np.ndarray:
        """Return the static displacement under forces on the rows (c, k), (dofs, k)."""
        return self._displaced(self.rows.T @ loads)

    def uncertified(self) -> np.ndarray:
        """Return the static displacement under the target's pressures and weights, (dofs, p + w)."""
        weighed = self._displaced(self._turn.T @ (self._basis.T @ self.target.balanced(self.target.weights)))
        return np.column_stack([self.responses(self.target.pressures), weighed])

    def _displaced(self, coordinates: np.ndarray) -> np.ndarray:
        return self._basis @ (self._turn @ coordinates) - self.target.rigid @ (self._rigid_parts.T @ coordinates)


def _bordered(inner: np.ndarray, across: np.ndarray, outer: np.ndarray) -> np.ndarray:
    return np.block([[inner, across], [across.T, outer]])


def independent(stiffness: np.ndarray, least: float = INDEPENDENT) -> np.ndarray:
    """Return the combinations of columns with a stiffness (v, v) that are K-orthonormal, (v, w).

    Args:
        least: Share of the largest of normalised columns below which a direction is dropped.
    """
    scale = 1 / np.sqrt(np.maximum(stiffness.diagonal(), np.finfo(float).tiny))
    strength, directions = linalg.eigh(0.5 * (stiffness + stiffness.T) * scale * scale[:, None])
    significant = strength > least * strength.max(initial=0.0)
    return scale[:, None] * directions[:, significant] / np.sqrt(strength[significant])
