"""Static correction: the displacement under contact forces and loads that the kept modes do not contain.

Attachment shapes with inertia relief are G Bᵀ with the flexibility G of `flexibility`; the residual shapes are
W = (G − Φ Λ⁻¹ Φᵀ) Bᵀ and the residual flexibility is R = B W. W is M-orthogonal to Φ, and its stiffness Wᵀ K W is R
itself.

With E = M [Φ_r Φ] and the coordinates C = B [Φ_r Φ] of the rows, the loads without rigid motions and modes are
B̃ᵀ = Bᵀ − E Cᵀ, and

  R = B̃ K_c⁻¹ B̃ᵀ = B K_c⁻¹ Bᵀ − B X Cᵀ − C Xᵀ Bᵀ + C (Eᵀ X) Cᵀ,  X = K_c⁻¹ E.

One factorisation gives B K_c⁻¹ Bᵀ (`linalg.condensed`). In a slender body nearly all of it cancels: there B̃ᵀ is solved
row by row.

The rows of B have different units (N, Pa), so that entries of R may differ by many orders of magnitude: R is checked
after scaling row i by the square root of its total flexibility bᵢ G bᵢᵀ.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy import linalg, sparse

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.model import FEModel, LineStiffness
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.modes.normal import NormalModes

BLOCK = 96
"""Right-hand sides per call of the solver."""
RANK_TOLERANCE = 1e-10
"""Directions of normalised shapes below this share of the largest are dependent, and dropped."""
SYMMETRY_TOLERANCE = 1e-8
"""Of R after scaling: the difference between two solves by the same factor."""
CANCELLED = 1e4
"""Flexibility of a grounded row over its residual one from which elimination loses more than four of 16 digits."""


@dataclass(frozen=True)
class Residual:
    """Static displacement that kept modes do not contain. W itself, (dofs, c), takes gigabytes and is not formed."""

    flexibility: np.ndarray
    """R = B W [m/N and the like], (c, c), symmetric."""
    scale: np.ndarray
    """Square root of each row's total flexibility bᵢ G bᵢᵀ, (c,); 1 if the row cannot move."""
    fields: np.ndarray
    """W·pressures: residual displacement under each field, (dofs, k)."""


@dataclass(frozen=True)
class StaticShapes:
    """Static correction shapes that join the dynamic basis, and the residual flexibility beside them."""

    angular_frequencies: np.ndarray
    """Ritz frequencies of the shapes [rad/s], (k,), ascending."""
    Phi: np.ndarray
    """Mass-orthonormal, M-orthogonal to the normal modes, (dofs, k)."""
    residual_flexibility: np.ndarray
    """R without the contribution of these shapes, (c, c)."""


def residual_shapes(
    model: FEModel,
    B: sparse.csr_matrix,
    normal: NormalModes,
    pressures: np.ndarray,
    flexibility: Flexibility | None = None,
) -> Residual:
    """Return the static displacement under unit forces on the rows of B and under pressure fields, without kept modes.

    Args:
        B: Displacement conjugate to each force, (c, dofs).
        normal: Normal modes, or Ritz vectors: then W is K-orthogonal to them, but not M-orthogonal.
        pressures: Forces of each field, (c, k).
        flexibility: Of the model, if it is factorised already.

    Raises:
        StageError: a solution does not balance its load, or R is not symmetric.
    """
    factor = flexibility or Flexibility(model, B)
    at_modes, whole_modes = B @ normal.Phi, "ritz_dropped" not in normal.quality
    modal_rows = at_modes / normal.angular_frequencies
    R, fields = _by_elimination(model, B, normal, pressures, factor) or _by_rows(model, B, normal, pressures, factor)
    fields -= factor.rigid @ (factor.M_rigid.T @ fields)
    if whole_modes:
        fields -= normal.Phi @ (normal.Phi.T @ (model.M @ fields))
    else:
        fields -= (normal.Phi / normal.angular_frequencies) @ (modal_rows.T @ pressures)
    if flexibility is None:
        factor.free()
    scale = total_scale(R, modal_rows)
    asymmetry = np.abs((R - R.T) / np.outer(scale, scale)).max(initial=0.0)
    if asymmetry > SYMMETRY_TOLERANCE:
        raise StageError(
            f"modes: residual flexibility is asymmetric by {asymmetry:.2g}, allowed: {SYMMETRY_TOLERANCE:g}"
        )
    return Residual(0.5 * (R + R.T), scale, fields)


def total_scale(R: np.ndarray, modal_rows: np.ndarray) -> np.ndarray:
    """Return the square root of each row's total flexibility, that of the kept modes (c, m) included, (c,)."""
    total = R.diagonal() + (modal_rows**2).sum(axis=1)
    return np.sqrt(np.where(total > 0, total, 1.0))


def _by_elimination(
    model: FEModel, B: sparse.csr_matrix, normal: NormalModes, pressures: np.ndarray, flexibility: Flexibility
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return R (c, c) and the displacement under the pressures (dofs, k), rigid motions and modes not yet taken off.

    None if the backend does not eliminate rows, or if too much of their flexibility cancels.

    Raises:
        StageError: a static solution is not exact, or does not agree with R.
    """
    if flexibility.at_rows is None:
        return None
    whole_modes, free = "ritz_dropped" not in normal.quality, flexibility.dofs
    taken = [flexibility.rigid, normal.Phi] if whole_modes else [flexibility.rigid]
    E = np.hstack([model.M @ shapes for shapes in taken])[free]
    C = np.hstack([B @ shapes for shapes in taken])
    B_free, own_size = sparse.csr_matrix(B[:, free]), flexibility.at_rows.diagonal()
    X_E = flexibility.grounded(E) if E.shape[1] else E
    across = (B_free @ X_E) @ C.T
    R = flexibility.at_rows - across - across.T + C @ (E.T @ X_E) @ C.T
    modal_rows = (B @ normal.Phi) / normal.angular_frequencies
    # Besides the pressures one load is solved that contains every row, with a random sign and by its own flexibility:
    # that of the grounded body may be round-off, where the grounding holds the row.
    signs = np.random.default_rng(0).choice([-1.0, 1.0], len(own_size))
    mixture = signs / total_scale(R, modal_rows if whole_modes else modal_rows[:, :0])
    forces = np.column_stack([pressures, mixture])
    moved = flexibility.grounded(B_free.T @ forces - E @ (C.T @ forces))
    difference = B_free @ moved[:, -1] - C @ (E.T @ moved[:, -1]) - R @ mixture
    if not whole_modes:
        R -= modal_rows @ modal_rows.T
    scale = total_scale(R, modal_rows)
    remaining = R.diagonal() if whole_modes else scale**2
    if (own_size > CANCELLED * remaining).any():
        return None
    wrong = float(np.abs(difference / scale).max(initial=0.0))
    if not wrong < SYMMETRY_TOLERANCE:
        raise StageError(
            f"modes: residual flexibility differs from a static solution by {wrong:.2g}, allowed:"
            f" {SYMMETRY_TOLERANCE:g}"
        )
    fields = np.zeros((B.shape[1], pressures.shape[1]))
    fields[free] = moved[:, :-1]
    return R, fields


def _by_rows(
    model: FEModel, B: sparse.csr_matrix, normal: NormalModes, pressures: np.ndarray, flexibility: Flexibility
) -> tuple[np.ndarray, np.ndarray]:
    """Return the same as `_by_elimination`, by a solve for each row.

    The part of the normal modes is subtracted from the loads, and what round-off leaves of it from the solutions.
    """
    rigid, M_rigid, free = flexibility.rigid, flexibility.M_rigid, flexibility.dofs
    B_free, B_rigid, M_rigid_free = sparse.csr_matrix(B[:, free]), B @ rigid, M_rigid[free]
    touched = np.unique(B_free.indices)
    B_touched = sparse.csr_matrix(B_free[:, touched])
    at_modes, whole_modes = B @ normal.Phi, "ritz_dropped" not in normal.quality
    modal_rows = at_modes / normal.angular_frequencies
    M_modes = (model.M @ normal.Phi)[free] if whole_modes else np.empty((len(free), 0))
    R, fields = np.empty((B.shape[0], B.shape[0])), np.zeros((B.shape[1], pressures.shape[1]))
    for start in range(0, B.shape[0], BLOCK):
        rows = slice(start, start + BLOCK)
        loads = B_free[rows].toarray()
        loads -= B_rigid[rows] @ M_rigid_free.T
        if whole_modes:
            loads -= at_modes[rows] @ M_modes.T
        X = flexibility.grounded(loads.T)
        if whole_modes:
            taken = at_modes @ (M_modes.T @ X)
        elif model.parts is not None:
            taken = at_modes @ _carried(model.parts, normal.Phi, X, free)
        else:
            taken = modal_rows @ modal_rows[rows].T
        R[:, rows] = B_touched @ X[touched] - B_rigid @ (M_rigid_free.T @ X) - taken
        fields[free] += X @ pressures[rows]
    return R, fields


def _carried(elements: LineStiffness, Phi: np.ndarray, X: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Return the coordinates in the span of Φ (dofs, m), by strain energy, of X on the free dofs (free, k), (m, k)."""
    u = np.zeros((len(Phi), X.shape[1]))
    u[free] = X
    return linalg.solve(elements.product(Phi), elements.product(Phi, u), assume_a="pos")


def static_shapes(model: FEModel, B: sparse.csr_matrix, residual: Residual) -> StaticShapes:
    """Return M-orthonormal shapes, diagonal in M and K, of the residual displacement under pressure fields.

    Nearly dependent ones are dropped, see `ritz_pairs`.

    Args:
        B: Displacement conjugate to each force, (c, dofs).
        residual: Of the same rows.
    """
    values, Phi = ritz_pairs(model, residual.fields)
    at_points = B @ Phi
    R = residual.flexibility - (at_points / values) @ at_points.T
    return StaticShapes(np.sqrt(values), Phi, 0.5 * (R + R.T))


def ritz_pairs(model: FEModel, shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the Ritz values θ [rad²/s²] of shapes (dofs, k), ascending, and M-orthonormal Ritz vectors (dofs, m).

    The shapes are made K-orthonormal first and the mass is diagonalised, so that the lowest frequencies are the most
    exact. Directions of less than `RANK_TOLERANCE` of the largest are dropped.
    """
    stiffness = shapes.T @ (model.K @ shapes)
    scale = 1 / np.sqrt(np.maximum(stiffness.diagonal(), np.finfo(float).tiny))
    strength, directions = linalg.eigh(stiffness * scale * scale[:, None])
    independent = strength > RANK_TOLERANCE * strength.max(initial=0.0)
    shapes = shapes @ ((directions[:, independent] / np.sqrt(strength[independent])) * scale[:, None])
    inverse, Z = linalg.eigh(shapes.T @ (model.M @ shapes))
    values, Z = 1 / inverse[::-1], Z[:, ::-1]
    return values, shapes @ (Z * np.sqrt(values))


def pressure_fields(coordinates: np.ndarray, areas: np.ndarray, count: int) -> np.ndarray:
    """Return smooth pressure fields on an interface as contact forces [N per unit pressure], (c, count).

    Products of Legendre polynomials in the surface coordinates, lowest degree first, times the tributary areas; with
    as many fields as points each point has its own load instead. On the piston skirt 30 such fields give an impulse
    error of 0.1 %, 30 single-node loads one of 0.3 to 0.7 %.

    Args:
        coordinates: Surface coordinates scaled to [−1, 1], (c, 2) or (c, 1).
        areas: Tributary areas [m²], (c,).
    """
    if count == 0 or count >= len(areas):
        return np.eye(len(areas))[:, : count or 0]
    degrees = range(int(np.ceil(np.sqrt(count))) if coordinates.shape[1] == 2 else count)
    values = [[legendre.legval(x, np.eye(len(degrees))[i]) for i in degrees] for x in coordinates.T]
    if coordinates.shape[1] == 1:
        return np.column_stack([areas * values[0][i] for i in degrees])
    pairs = sorted((max(i, j), i + j, i, j) for i in degrees for j in degrees)[:count]
    return np.column_stack([areas * values[0][i] * values[1][j] for _, _, i, j in pairs])
