"""The flexibility G of a model: its elastic displacement under forces, by one factorisation.

G = Pᵀ K_c⁻¹ P with P = I − M Φ_r Φ_rᵀ (K_c: enough dofs held to prevent rigid motion): displacement with inertia
relief. A body held by supports has no rigid modes: there P = I, and K_c is the stiffness of its free dofs.
"""

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.linalg import condense, factorise
from gudgeon.pipeline.modes.problem import grounding

SOLVED = 1e-5
"""Unbalanced share of the load of a static solution: solids leave 1e-9, beams of 400 elements 1e-6 by round-off."""


class Flexibility:
    """G of a model: its elastic displacement under forces, with inertia relief if it has rigid motions."""

    at_rows: np.ndarray | None = None
    """B K_c⁻¹ Bᵀ of the given rows, (c, c); None if the backend has no faster way to it than solves."""

    def __init__(self, model: FEModel, rows: sparse.csr_matrix | None = None) -> None:
        """Factorise K_c.

        Args:
            rows: B, if its flexibility is wanted, (c, dofs).
        """
        self.rigid = model.rigid_modes
        self.M_rigid = model.M @ self.rigid
        self.dofs = np.setdiff1d(model.free, grounding(self.rigid))
        """Dofs that neither a support nor the grounding of the rigid motions holds."""
        self._K = model.K
        # Forces and moments of beams have different units: each is scaled by the mass of its dof.
        mass = model.M.diagonal()[self.dofs] if model.parts is not None else np.ones(len(self.dofs))
        self._weight = 1 / np.sqrt(mass)[:, None]
        free = model.free
        self._places, self._size = np.searchsorted(free, self.dofs), len(free)
        self._rigid_free, self._M_rigid_free = self.rigid[free], self.M_rigid[free]
        self._pinned = np.setdiff1d(np.arange(len(free)), self._places, True)
        pinned = _pinned(model.free_matrices()[0], self._pinned)
        condensed = None
        if rows is not None and model.parts is None:
            selected = np.zeros(model.K.shape[0])
            selected[self.dofs] = 1.0
            condensed = condense(pinned, sparse.csr_matrix((rows @ sparse.diags_array(selected))[:, free]))
        if condensed is not None:
            self.at_rows = condensed.flexibility
        self.factor = condensed or factorise(pinned, definite=True)

    def grounded(self, loads: np.ndarray) -> np.ndarray:
        """Return K_c⁻¹ loads over `dofs`, (c, k).

        All solutions are checked by one product with K: that of their sum with random signs. Where that leaves more of
        the load than allowed, as round-off of slender parts does, the error of the displacement decides.

        Raises:
            StageError: the solutions do not balance their loads, and are wrong.
        """
        padded = np.zeros((self._size, loads.shape[1]), order="F")
        padded[self._places] = loads
        answer = self.factor.solve(padded)[self._places]
        sizes = np.linalg.norm(self._weight * loads, axis=0)
        signs = np.random.default_rng(0).choice([-1.0, 1.0], len(sizes)) / np.where(sizes > 0, sizes, np.inf)
        mixture = np.zeros(self._K.shape[0])
        mixture[self.dofs] = answer @ signs
        residual = loads @ signs - (self._K @ mixture)[self.dofs]
        unbalanced = float(np.linalg.norm(self._weight[:, 0] * residual)) if len(sizes) else 0.0
        if not unbalanced < SOLVED and not self._error(residual, answer @ signs, loads @ signs) < SOLVED:
            raise StageError(
                f"modes: static solutions leave {unbalanced:.2g} of their load unbalanced, allowed: {SOLVED:g}."
                " A part is connected by too few nodes, the mesh has slivers, or the mesh is much finer than its shape"
                " needs"
            )
        return answer

    def _error(self, residual: np.ndarray, answer: np.ndarray, load: np.ndarray) -> float:
        """Return the error of a solution over `dofs` by what the unbalanced load (c,) displaces, in energy."""
        padded = np.zeros((self._size, 1), order="F")
        padded[self._places, 0] = residual
        again = self.factor.solve(padded)[self._places, 0]
        return float(np.sqrt(abs(again @ residual) / abs(answer @ load)))

    def displaced(self, loads: np.ndarray) -> np.ndarray:
        """Return G·loads over the free dofs, (free, k), unchecked; the loads [N] are overwritten."""
        loads -= self._M_rigid_free @ (self._rigid_free.T @ loads)
        loads[self._pinned] = 0.0
        answer = self.factor.solve(loads)
        answer -= self._rigid_free @ (self._M_rigid_free.T @ answer)
        return answer

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """Return G·forces [m], (dofs, k), for forces [N], (dofs, k); errors as of `grounded`."""
        balanced = forces - self.M_rigid @ (self.rigid.T @ forces)
        answer = np.zeros(forces.shape)
        answer[self.dofs] = self.grounded(balanced[self.dofs])
        return answer - self.rigid @ (self.M_rigid.T @ answer)

    def of_rows(self, B: sparse.csr_matrix) -> np.ndarray:
        """Return B G Bᵀ of the rows B that were given (c, dofs), (c, c)."""
        if self.at_rows is None:
            return B @ self.solve(B.T.toarray())
        C_rigid, E = B @ self.rigid, self.M_rigid[self.dofs]
        X = self.grounded(E) if E.shape[1] else E
        across = (B[:, self.dofs] @ X) @ C_rigid.T
        return self.at_rows - across - across.T + C_rigid @ (E.T @ X) @ C_rigid.T

    def free(self) -> None:
        """Release the memory of the factor."""
        self.factor.free()


def _pinned(K: sparse.csr_matrix, pinned: np.ndarray) -> sparse.csr_matrix:
    """Return K (n, n) with pinned dofs (p,) uncoupled from the others; its blocks of dofs stay full."""
    answer = sparse.csr_matrix(K, copy=True)
    if len(pinned):
        constrained = np.zeros(K.shape[0], bool)
        constrained[pinned] = True
        answer.data[constrained[answer.indices]] = 0.0
        for dof in pinned.tolist():
            row = slice(answer.indptr[dof], answer.indptr[dof + 1])
            answer.data[row] = 0.0
            answer.data[row][answer.indices[row] == dof] = K[dof, dof]
    return answer
