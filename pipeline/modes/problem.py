"""The eigenproblem K φ = λ M φ of a body beside its rigid motions, and the checks that every extraction has to pass."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import linalg, sparse
from scipy.sparse.linalg import eigsh

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.model import FEModel

RESIDUAL_TOLERANCE = 1e-8
"""‖Kφ − λMφ‖ / ‖Kφ‖ of each mode: Lanczos at full precision gives 1e-10 or better on tet10 solids."""
ROUND_OFF_SHARE = 10.0
"""Accepted residual over (round-off of the eigenvalues / eigenvalue): bending of fine beams reaches it."""
ORTHOGONALITY_TOLERANCE = 1e-10
RIGID_SHARE = 1e-6
"""Eigenvalues of the rigid motions over the first elastic one, at most."""
GAP = 1e-6
"""Eigenvalues closer than this share are equal: one for the inertia count, and a group whose vectors are arbitrary."""

Count = tuple[float, int]
"""A shift [rad²/s²], and how many elastic eigenvalues an inertia count found below it."""


@dataclass(frozen=True)
class Problem:
    """Stiffness and mass of the free dofs, real or Hermitian, and the rigid motions in their null space."""

    K: sparse.csr_matrix
    M: sparse.csr_matrix
    rigid: np.ndarray
    """Φ_r, M-orthonormal, (free, r)."""

    @classmethod
    def of(cls, model: FEModel) -> "Problem":
        """Return the problem of a model's free dofs."""
        return cls(*model.free_matrices(), model.rigid_modes[model.free])

    @cached_property
    def M_rigid(self) -> np.ndarray:
        """M Φ_r, (free, r)."""
        return self.M @ self.rigid

    @cached_property
    def highest(self) -> float:
        """max(K_ii / M_ii) [rad²/s²]: times the round-off unit, the least uncertainty of the eigenvalues."""
        return float((np.real(self.K.diagonal()) / np.real(self.M.diagonal())).max())

    @cached_property
    def largest(self) -> float:
        """Largest eigenvalue to a tenth [rad²/s²]: up to twenty times `highest` of beams in space; M is factorised."""
        start = np.random.default_rng(0).standard_normal(self.K.shape[0]).astype(self.K.dtype)
        options: dict[str, Any] = {"M": self.M.tocsc(), "which": "LM", "tol": 0.1, "return_eigenvectors": False}
        values = eigsh(self.K.tocsc(), 1, v0=start, **options) if len(start) > 1 else [self.highest]
        return max(self.highest, float(values[0]))

    def elastic(self, columns: np.ndarray) -> np.ndarray:
        """Return columns (free, k) without their rigid motions."""
        return columns - self.rigid @ (self.M_rigid.conj().T @ columns)

    def refuse_inexact(self, values: np.ndarray, residual: np.ndarray, orthogonality: float) -> None:
        """Raise a StageError if eigenpairs are not exact enough.

        Args:
            values: λ [rad²/s²], (k,).
            residual: ‖Kφ − λMφ‖ / ‖Kφ‖ of each, (k,).
            orthogonality: Largest entry of ΦᴴMΦ − I.
        """
        relative = ROUND_OFF_SHARE * np.finfo(float).eps / values
        allowed = np.maximum(RESIDUAL_TOLERANCE, relative * self.highest)
        if not (residual <= allowed).all():
            allowed = np.maximum(RESIDUAL_TOLERANCE, relative * self.largest)
        worst = int(np.argmax(residual / allowed))
        if not residual[worst] <= allowed[worst]:
            raise StageError(
                f"modes: residual {residual[worst]:.2g} of mode {worst + 1}, allowed: {allowed[worst]:.2g}"
            )
        if not orthogonality <= ORTHOGONALITY_TOLERANCE:
            raise StageError(f"modes: orthogonality {orthogonality:.2g}, allowed: {ORTHOGONALITY_TOLERANCE:g}")


@dataclass(frozen=True)
class Pairs:
    """The lowest elastic eigenpairs."""

    values: np.ndarray
    """λ [rad²/s²], ascending, (k,); those behind the wanted ones need not be exact, but are upper bounds."""
    vectors: np.ndarray
    """M-orthonormal, (free, at least the wanted ones)."""
    proven: Count | None = None
    """With a shift above the wanted ones."""


def count_shift(values: np.ndarray, count: int, *, complete: bool = False) -> tuple[float, int]:
    """Return a shift [rad²/s²] in the first gap above the last wanted eigenvalue, and how many values are below it.

    Args:
        values: Extracted eigenvalues [rad²/s²], ascending, more than wanted.
        count: Wanted ones.
        complete: Whether there are no others, so that the shift may be above all of them.
    """
    highest = whole_groups(values, count) - 1
    if highest + 1 == len(values) and not complete:
        highest -= 1  # No gap: the count shows whether the last extracted eigenvalue is the last of its cluster.
    sigma = 0.5 * (values[highest] + values[highest + 1]) if highest + 1 < len(values) else 2 * values[highest]
    return float(sigma), highest + 1


def whole_groups(values: np.ndarray, count: int) -> int:
    """Return the count that keeps the last wanted eigenvalue's group of equal ones whole: the wanted one if it does.

    Which vectors of a group are found is a matter of round-off, and so is what depends on those that are kept.

    Args:
        values: Extracted eigenvalues [rad²/s²], ascending.
        count: Wanted ones.
    """
    while 0 < count < len(values) and values[count] / values[count - 1] - 1 < GAP:
        count += 1
    return count


def grounding(rigid: np.ndarray) -> np.ndarray:
    """Return as many dofs as there are rigid motions (dofs, r), chosen to hold the body firmly (pivoted QR of Φ_r)."""
    return linalg.qr(rigid.conj().T, mode="economic", pivoting=True)[2][: rigid.shape[1]]


def null_motions(motions: np.ndarray, tolerance: float) -> np.ndarray:
    """Return the orthonormal combinations (l, r) of motions (k, r) whose norm is at most a tolerance."""
    _, strength, combinations = np.linalg.svd(motions, full_matrices=True)
    strength = np.concatenate([strength, np.zeros(motions.shape[1] - len(strength))])
    return combinations[strength <= tolerance]


def dense_pairs(
    K: np.ndarray, M: np.ndarray, rigid: int, count: int | None, basis: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest elastic eigenvalues [rad²/s²], (k,), and M-orthonormal vectors (n, k) of dense K v = λ M v.

    Args:
        rigid: Number of rigid motions, which are left out.
        count: Number of elastic pairs; None is all.
        basis: What the matrices are over, for messages.

    Raises:
        StageError: eigenvalues of the rigid motions are not small.
    """
    scale = 1 / np.sqrt(M.diagonal())
    size = np.outer(scale, scale)
    subset = None if count is None else (0, rigid + count - 1)
    values, vectors = linalg.eigh(K * size, M * size, subset_by_index=subset)
    refuse_stiff_rigid(values, rigid, basis)
    return values[rigid:], scale[:, None] * vectors[:, rigid:]


def refuse_stiff_rigid(values: np.ndarray, rigid: int, basis: str) -> None:
    """Raise a StageError if the first of ascending eigenvalues, those of rigid motions, are above `RIGID_SHARE`."""
    if rigid and np.abs(values[:rigid]).max() > RIGID_SHARE * values[rigid]:
        raise StageError(
            f"modes: rigid motions have the eigenvalue {values[rigid - 1]:.2g} rad²/s² {basis}, allowed:"
            f" {RIGID_SHARE:g} of the first elastic one, {values[rigid]:.2g} rad²/s²"
        )
