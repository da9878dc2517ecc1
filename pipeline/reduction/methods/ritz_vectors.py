"""Load-dependent Ritz vectors; for other loads only back-substitutions are repeated (Wu & Mani; the recurrence: Wilson,
Yuan & Dickens 1982).

K X₁ = f, K Xᵢ₊₁ = M Xᵢ, each block M-orthogonalised twice against all before it. The factor does not depend on the
load, so that a moving load needs one solve for each vector; several places are solved together in blocks. Beside kept
normal modes, with which Wu & Mani combine them, the first block is static correction and the next ones are its response
to inertia. On a body with rigid motions K⁻¹ is G, with inertia relief.
"""

from collections.abc import Generator, Sequence

import numpy as np
from scipy import linalg, sparse

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.normal import NormalModes
from gudgeon.pipeline.modes.static import BLOCK, RANK_TOLERANCE, Flexibility
from gudgeon.pipeline.reduction.methods.reduction import ritz_modes

Recurrence = Generator[np.ndarray, np.ndarray, tuple[np.ndarray, int]]
"""Yields loads and is sent their displacements; returns the vectors and the number of dropped dependent ones."""


class RitzVectors:
    """Vectors of one body for any loads, with one factorisation."""

    def __init__(self, model: FEModel) -> None:
        self._model, self.flexibility = model, Flexibility(model)
        self.solved = 0
        """Right-hand sides that the recurrence has solved."""

    def generate(self, loads: np.ndarray, count: int, normal: NormalModes | None = None) -> NormalModes:
        """Return the vectors of loads [N], (dofs, k); see `generate_all`."""
        return self.generate_all([loads], count, normal)[0]

    def generate_all(
        self, places: Sequence[np.ndarray], count: int, normal: NormalModes | None = None
    ) -> list[NormalModes]:
        """Return a set of elastic vectors for each place, K-diagonal and M-orthonormal, lowest frequency first.

        Args:
            places: Nodal forces [N] at each place, (dofs, k).
            count: Vectors of each set, kept normal modes included.
            normal: Normal modes, (m,), that are kept; count − m vectors of the loads are added.

        Raises:
            InputError: the loads are no forces on this body, or have fewer independent vectors.
        """
        size = self._model.K.shape[0]
        first = np.empty((size, 0)) if normal is None else normal.Phi
        for loads in places:
            if loads.ndim != 2 or loads.shape[0] != size or not np.isfinite(loads).all():
                raise InputError(f"loads: shape {loads.shape} given; expected finite nodal forces ({size}, k)")
        if count <= first.shape[1]:
            raise InputError(f"count: {count} given; expected more than the {first.shape[1]} kept normal modes")
        found = []
        for basis, _ in self._advance([_recurrence(self._model.M, loads, count, first) for loads in places]):
            modes = ritz_modes(self._model, basis) if basis.shape[1] == count else None
            if modes is None or modes.Phi.shape[1] < count:
                got = basis.shape[1] if modes is None else modes.Phi.shape[1]
                raise InputError(f"count: {count} given, loads and kept normal modes have {got} independent vectors")
            found.append(modes)
        return found

    def krylov(self, loads: np.ndarray, count: int) -> tuple[np.ndarray, int]:
        """Return at most `count` M-orthonormal vectors of loads (dofs, k), and the number of dropped dependent ones."""
        return self._advance([_recurrence(self._model.M, loads, count, np.empty((loads.shape[0], 0)))])[0]

    def free(self) -> None:
        """Release the memory of the factor."""
        self.flexibility.free()

    def _advance(self, recurrences: Sequence[Recurrence]) -> list[tuple[np.ndarray, int]]:
        """Run recurrences in parallel, with the loads of all solved in blocks."""
        results: dict[int, tuple[np.ndarray, int]] = {}
        answers: dict[int, np.ndarray | None] = dict.fromkeys(range(len(recurrences)))
        while answers:
            asked = {}
            for number, answer in answers.items():
                try:
                    asked[number] = next(recurrences[number]) if answer is None else recurrences[number].send(answer)
                except StopIteration as end:
                    results[number] = end.value
            answers = self._solved(asked)
        return [results[number] for number in range(len(recurrences))]

    def _solved(self, asked: dict[int, np.ndarray]) -> dict[int, np.ndarray | None]:
        """Return G·loads of each recurrence."""
        if not asked:
            return {}
        loads = np.column_stack(list(asked.values()))
        starts = range(0, loads.shape[1], BLOCK)
        shapes = np.column_stack([self.flexibility.solve(loads[:, start : start + BLOCK]) for start in starts])
        self.solved += loads.shape[1]
        ends = np.cumsum([block.shape[1] for block in asked.values()])
        return dict(zip(asked, np.split(shapes, ends[:-1], axis=1), strict=True))


def _recurrence(M: sparse.csr_matrix, loads: np.ndarray, count: int, basis: np.ndarray) -> Recurrence:
    """Return up to `count` M-orthonormal vectors, those of `basis` first."""
    images, dropped = M @ basis, 0
    while basis.shape[1] < count and loads.shape[1]:
        block = yield loads
        norms = np.sqrt(np.einsum("dk,dk->k", block, M @ block))
        block = block[:, norms > 0] / norms[norms > 0]
        for _ in range(2):
            block = block - basis @ (images.T @ block)
        strength, directions = linalg.eigh(block.T @ (M @ block))
        kept = np.flatnonzero(strength > RANK_TOLERANCE)[::-1]
        dropped += loads.shape[1] - len(kept)
        kept = kept[: count - basis.shape[1]]
        block = block @ (directions[:, kept] / np.sqrt(strength[kept]))
        # The rest of a nearly dependent block is orthogonal to few digits only: repeated.
        block = block - basis @ (images.T @ block)
        loads = M @ block
        basis, images = np.column_stack([basis, block]), np.column_stack([images, loads])
    return basis, dropped
