"""Load-dependent Ritz vectors; for other loads only back-substitutions are repeated (Wu & Mani; the recurrence: Wilson,
Yuan & Dickens 1982).

K X₁ = f, K Xᵢ₊₁ = M Xᵢ, each block M-orthogonalised twice against all before it. The factor does not depend on the
load, so that a load at another place needs one solve for each vector. Beside kept normal modes, with which Wu & Mani
combine them, the first block is static correction and the next ones are its response to inertia. On a body with rigid
motions K⁻¹ is G, with inertia relief.
"""

import numpy as np
from scipy import linalg

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.modes.normal import NormalModes
from gudgeon.pipeline.modes.static import BLOCK, RANK_TOLERANCE
from gudgeon.pipeline.reduction.methods.reduction import ritz_modes


class RitzVectors:
    """Vectors of one body for any loads, with one factorisation."""

    def __init__(self, model: FEModel) -> None:
        self._model, self.flexibility = model, Flexibility(model)
        self.solved = 0
        """Right-hand sides that the recurrence has solved."""

    def generate(self, loads: np.ndarray, count: int, normal: NormalModes | None = None) -> NormalModes:
        """Return elastic vectors of loads, K-diagonal and M-orthonormal, lowest frequency first.

        Args:
            loads: Nodal forces [N], (dofs, k).
            count: Number of vectors, kept normal modes included.
            normal: Normal modes, (m,), that are kept; count − m vectors of the loads are added.

        Raises:
            InputError: the loads are no forces on this body, or have fewer independent vectors.
        """
        size = self._model.K.shape[0]
        start = np.empty((size, 0)) if normal is None else normal.Phi
        if loads.ndim != 2 or loads.shape[0] != size or not np.isfinite(loads).all():
            raise InputError(f"loads: shape {loads.shape} given; expected finite nodal forces ({size}, k)")
        if count <= start.shape[1]:
            raise InputError(f"count: {count} given; expected more than the {start.shape[1]} kept normal modes")
        basis, _ = self.krylov(loads, count, start)
        modes = ritz_modes(self._model, basis) if basis.shape[1] == count else None
        if modes is None or modes.Phi.shape[1] < count:
            got = basis.shape[1] if modes is None else modes.Phi.shape[1]
            raise InputError(f"count: {count} given, loads and kept normal modes have {got} independent vectors")
        return modes

    def krylov(self, loads: np.ndarray, count: int, start: np.ndarray | None = None) -> tuple[np.ndarray, int]:
        """Return at most `count` M-orthonormal vectors of loads (dofs, k), and the number of dropped dependent ones.

        Args:
            start: M-orthonormal vectors that precede them, (dofs, m).
        """
        M = self._model.M
        basis, dropped = np.empty((loads.shape[0], 0)) if start is None else start, 0
        images = M @ basis
        while basis.shape[1] < count and loads.shape[1]:
            block = self._solved(loads)
            norms = np.sqrt(np.einsum("dk,dk->k", block, M @ block))
            block = block[:, norms > 0] / norms[norms > 0]
            for _ in range(2):
                block = block - basis @ (images.T @ block)
            strength, directions = linalg.eigh(block.T @ (M @ block))
            independent = np.flatnonzero(strength > RANK_TOLERANCE)[::-1]
            dropped += loads.shape[1] - len(independent)
            independent = independent[: count - basis.shape[1]]
            block = block @ (directions[:, independent] / np.sqrt(strength[independent]))
            # The rest of a nearly dependent block is orthogonal to few digits only: repeated.
            block = block - basis @ (images.T @ block)
            loads = M @ block
            basis, images = np.column_stack([basis, block]), np.column_stack([images, loads])
        return basis, dropped

    def free(self) -> None:
        """Release the memory of the factor."""
        self.flexibility.free()

    def _solved(self, loads: np.ndarray) -> np.ndarray:
        """Return G·loads."""
        self.solved += loads.shape[1]
        starts = range(0, loads.shape[1], BLOCK)
        return np.column_stack([self.flexibility.solve(loads[:, start : start + BLOCK]) for start in starts])
