"""Static correction: what the kept modes lack under contact loads.

Attachment shapes with inertia relief, G Bᵀ with G = Pᵀ K_c⁻¹ P and P = I − M Φ_r Φ_rᵀ (K_c: enough dofs held to stop
rigid motion); the residual shapes are W = (G − Φ Λ⁻¹ Φᵀ) Bᵀ and the residual flexibility R = B W.
W is M-orthogonal to Φ, and its stiffness Wᵀ K W is R itself.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy import linalg, sparse

from pipeline.errors import StageError
from pipeline.linalg import Factor, factorise
from pipeline.model import FEModel
from pipeline.modes.normal import NormalModes

BLOCK = 96
"""Right-hand sides per call of the solver."""
RANK_TOLERANCE = 1e-10
"""Directions of the normalised static shapes below this share of the largest are dependent, and dropped."""
SYMMETRY_TOLERANCE = 1e-8


@dataclass(frozen=True)
class StaticShapes:
    """Static correction shapes that join the dynamic basis, and what is left for R."""

    angular_frequencies: np.ndarray
    """Their own Ritz frequencies [rad/s], (k,), ascending."""
    Phi: np.ndarray
    """Mass-orthonormal, M-orthogonal to the normal modes, (dofs, k)."""
    residual_flexibility: np.ndarray
    """Of what neither normal modes nor these shapes carry [m/N], (c, c)."""
    scale: float
    """Largest entry of R before these shapes took their share [m/N]."""
    dropped: int
    """Nearly dependent directions that the rank test dropped."""


def residual_shapes(model: FEModel, B: sparse.csr_matrix, normal: NormalModes) -> np.ndarray:
    """Return W = (G − Φ Λ⁻¹ Φᵀ) Bᵀ [m/N], (dofs, c)."""
    held = _statically_determinate(model)
    free = np.setdiff1d(np.arange(model.K.shape[0]), held)
    factor = factorise(model.K[free][:, free])
    W = _attachment(model, B, factor, free)
    factor.free()
    W -= normal.Phi @ ((normal.Phi.T @ B.T) / normal.angular_frequencies[:, None] ** 2)
    return W


def static_shapes(model: FEModel, B: sparse.csr_matrix, W: np.ndarray, pressures: np.ndarray) -> StaticShapes:
    """Turn the residual shapes under given pressure fields into M-orthonormal coordinates of their own.

    Within the span of W·pressures the Ritz problem (pᵀ R p) y = θ (pᵀ Wᵀ M W p) y makes them diagonal in M and K.

    Args:
        B: Displacement of the contact points along their normals, (c, dofs).
        W: Residual shapes, (dofs, c).
        pressures: Contact forces of each field [N], (c, k).

    Raises:
        StageError: R is not symmetric, or the fields are dependent beyond what the rank test can mend.
    """
    R = B @ W
    asymmetry = np.abs(R - R.T).max() / np.abs(R).max()
    if asymmetry > SYMMETRY_TOLERANCE:
        raise StageError(f"modes: residual flexibility is asymmetric by {asymmetry:.2g}")
    R = 0.5 * (R + R.T)
    if pressures.shape[1] == 0:
        return StaticShapes(np.empty(0), np.empty((len(W), 0)), R, float(np.abs(R).max(initial=0.0)), 0)
    flexibility = pressures.T @ R @ pressures
    scale = 1 / np.sqrt(flexibility.diagonal())
    strength, directions = linalg.eigh(flexibility * scale * scale[:, None])
    kept = strength > RANK_TOLERANCE * strength[-1]
    Y = pressures @ ((directions[:, kept] / np.sqrt(strength[kept])) * scale[:, None])
    WY = W @ Y
    inverse_theta, Z = linalg.eigh(WY.T @ (model.M @ WY))
    values, Z = 1 / inverse_theta[::-1], Z[:, ::-1]
    Phi = WY @ (Z * np.sqrt(values))
    at_points = B @ Phi
    rest = R - (at_points / values) @ at_points.T
    return StaticShapes(np.sqrt(values), Phi, 0.5 * (rest + rest.T), float(np.abs(R).max()), int((~kept).sum()))


def pressure_fields(coordinates: np.ndarray, areas: np.ndarray, count: int) -> np.ndarray:
    """Return smooth pressure fields on an interface as contact forces [N per unit pressure], (c, count).

    Products of Legendre polynomials in the surface coordinates, lowest degree first, times the tributary areas; as
    many fields as points give every point its own load instead. On the piston skirt 30 such fields leave 0.1 % of
    impulse error where 30 single-node loads leave 0.3 to 0.7 %.

    Args:
        coordinates: Surface coordinates scaled to [−1, 1], (c, 2) or (c, 1).
        areas: Tributary areas [m^2], (c,).
    """
    if count == 0 or count >= len(areas):
        return np.eye(len(areas))[:, : count or 0]
    degrees = range(int(np.ceil(np.sqrt(count))) if coordinates.shape[1] == 2 else count)
    values = [[legendre.legval(x, np.eye(len(degrees))[i]) for i in degrees] for x in coordinates.T]
    if coordinates.shape[1] == 1:
        return np.column_stack([areas * values[0][i] for i in degrees])
    pairs = sorted((max(i, j), i + j, i, j) for i in degrees for j in degrees)[:count]
    return np.column_stack([areas * values[0][i] * values[1][j] for _, _, i, j in pairs])


def _attachment(model: FEModel, B: sparse.csr_matrix, factor: Factor, free: np.ndarray) -> np.ndarray:
    """Return G Bᵀ with inertia relief [m/N], (dofs, c)."""
    rigid = model.rigid_modes
    M_rigid = model.M @ rigid
    W = np.zeros((model.K.shape[0], B.shape[0]))
    for start in range(0, B.shape[0], BLOCK):
        columns = slice(start, min(start + BLOCK, B.shape[0]))
        loads = B[columns].T.toarray()
        loads -= M_rigid @ (rigid.T @ loads)
        W[free, columns] = factor.solve(loads[free])
    W -= rigid @ (M_rigid.T @ W)
    return W


def _statically_determinate(model: FEModel) -> np.ndarray:
    """Return as many dofs as there are rigid motions, chosen to hold the body firmly (pivoted QR of Φ_r)."""
    _, _, pivots = linalg.qr(model.rigid_modes.T, mode="economic", pivoting=True)
    return np.sort(pivots[: len(model.rigid_twists)])
