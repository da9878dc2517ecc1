"""Static correction: what the kept modes lack under contact forces and loads.

Attachment shapes with inertia relief, G Bᵀ with G = Pᵀ K_c⁻¹ P and P = I − M Φ_r Φ_rᵀ (K_c: enough dofs held to stop
rigid motion); the residual shapes are W = (G − Φ Λ⁻¹ Φᵀ) Bᵀ and the residual flexibility R = B W.
W is M-orthogonal to Φ, and its stiffness Wᵀ K W is R itself. A body that supports hold has no rigid modes: there
P = I, and K_c is the stiffness of its free dofs.

The rows of B have units of their own (N, Pa), so that entries of R may differ by many orders of magnitude: what is
checked of R is checked after scaling row i by the square root of its whole flexibility bᵢ G bᵢᵀ.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy import linalg, sparse

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.model import FEModel, LineStiffness
from gudgeon.pipeline.linalg import factorise
from gudgeon.pipeline.modes.normal import NormalModes

BLOCK = 96
"""Right-hand sides per call of the solver."""
RANK_TOLERANCE = 1e-10
"""Directions of the normalised static shapes below this share of the largest are dependent, and dropped."""
SOLVED = 1e-5
"""Share of its load that an answer may leave unbalanced: solids leave 1e-9, beams of 400 elements 1e-6 by round-off."""
SYMMETRY_TOLERANCE = 1e-8
"""Of R after scaling: what two solves of the same factor differ by."""


@dataclass(frozen=True)
class Residual:
    """What the normal modes lack. W itself, (dofs, c), would be gigabytes and is never formed in full."""

    flexibility: np.ndarray
    """R = B W [m/N and the like], (c, c), symmetric."""
    scale: np.ndarray
    """Square root of each row's whole flexibility bᵢ G bᵢᵀ, (c,); 1 where the row cannot move."""
    fields: np.ndarray
    """W·pressures: residual displacement under each field, (dofs, k)."""


@dataclass(frozen=True)
class StaticShapes:
    """Static correction shapes that join the dynamic basis, and what is left for R."""

    angular_frequencies: np.ndarray
    """Their own Ritz frequencies [rad/s], (k,), ascending."""
    Phi: np.ndarray
    """Mass-orthonormal, M-orthogonal to the normal modes, (dofs, k)."""
    residual_flexibility: np.ndarray
    """Of what neither normal modes nor these shapes carry, (c, c)."""
    dropped: int
    """Nearly dependent directions that the rank test dropped."""


class Flexibility:
    """G of a model: its elastic displacement under forces, with inertia relief where rigid motions are left."""

    def __init__(self, model: FEModel) -> None:
        self.rigid = model.rigid_modes
        self.M_rigid = model.M @ self.rigid
        self.dofs = np.setdiff1d(model.free, _statically_determinate(self.rigid))
        """Those that neither a support nor the grounding of the rigid motions holds."""
        self._K = model.K
        # Forces and moments of beams have units of their own: each is measured by the mass that it moves.
        mass = model.M.diagonal()[self.dofs] if model.parts is not None else np.ones(len(self.dofs))
        self._weight = 1 / np.sqrt(mass)[:, None]
        free = model.free
        self._places, self._size = np.searchsorted(free, self.dofs), len(free)
        pinned = _pinned(model.free_matrices()[0], np.setdiff1d(free, self.dofs, True), free)
        self.factor = factorise(pinned, definite=model.parts is not None)

    def grounded(self, loads: np.ndarray) -> np.ndarray:
        """Return K_c⁻¹ loads over `dofs`, (c, k).

        One mixture of the answers with random signs is put into K again: it shows any that is wrong, for one product.

        Raises:
            StageError: the answers do not balance their loads.
        """
        whole = np.zeros((self._size, loads.shape[1]), order="F")
        whole[self._places] = loads
        answer = self.factor.solve(whole)[self._places]
        sizes = np.linalg.norm(self._weight * loads, axis=0)
        signs = np.random.default_rng(0).choice([-1.0, 1.0], len(sizes)) / np.where(sizes > 0, sizes, np.inf)
        mixture = np.zeros(self._K.shape[0])
        mixture[self.dofs] = answer @ signs
        left = self._weight[:, 0] * ((self._K @ mixture)[self.dofs] - loads @ signs)
        rest = float(np.linalg.norm(left)) if len(sizes) else 0.0
        if not rest < SOLVED:
            raise StageError(
                f"modes: static answers leave {rest:.2g} of their load unbalanced, allowed: {SOLVED:g}; something hangs"
                " on next to nothing, or the mesh has slivers or far more elements than its shapes need"
            )
        return answer

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """Return G·forces, (dofs, k).

        Raises:
            StageError: see `grounded`.
        """
        balanced = forces - self.M_rigid @ (self.rigid.T @ forces)
        answer = np.zeros(forces.shape)
        answer[self.dofs] = self.grounded(balanced[self.dofs])
        return answer - self.rigid @ (self.M_rigid.T @ answer)

    def free(self) -> None:
        """Give the factor's memory back."""
        self.factor.free()


def residual_shapes(
    model: FEModel,
    B: sparse.csr_matrix,
    normal: NormalModes,
    pressures: np.ndarray,
    flexibility: Flexibility | None = None,
) -> Residual:
    """Return what the normal modes lack under unit forces on the rows of B and under pressure fields.

    Args:
        B: Displacement conjugate to each force, (c, dofs).
        normal: Normal modes, or Ritz vectors: then W is K-orthogonal to them, but not M-orthogonal.
        pressures: Forces of each field, (c, k).
        flexibility: Of the model, where it is factorised already.

    Raises:
        StageError: an answer does not balance its load, or R is not symmetric.
    """
    own = flexibility or Flexibility(model)
    rigid, M_rigid, free = own.rigid, own.M_rigid, own.dofs
    B_free, B_rigid, M_rigid_free = sparse.csr_matrix(B[:, free]), B @ rigid, M_rigid[free]
    touched = np.unique(B_free.indices)
    B_touched = sparse.csr_matrix(B_free[:, touched])
    at_rows, whole_modes = B @ normal.Phi, "ritz_dropped" not in normal.quality
    kept = at_rows / normal.angular_frequencies
    # Of a slender body nearly all of G Bᵀ cancels: what normal modes carry is taken off the loads, not off the answers,
    # and what round-off leaves of it is taken off again.
    M_modes = (model.M @ normal.Phi)[free] if whole_modes else np.empty((len(free), 0))
    R, fields = np.empty((B.shape[0], B.shape[0])), np.zeros((B.shape[1], pressures.shape[1]))
    for start in range(0, B.shape[0], BLOCK):
        rows = slice(start, start + BLOCK)
        loads = B_free[rows].toarray()
        loads -= B_rigid[rows] @ M_rigid_free.T
        if whole_modes:
            loads -= at_rows[rows] @ M_modes.T
        X = own.grounded(loads.T)
        if whole_modes:
            taken = at_rows @ (M_modes.T @ X)
        elif model.parts is not None:
            taken = at_rows @ _carried(model.parts, normal.Phi, _spread(X, free, B.shape[1]))
        else:
            taken = kept @ kept[rows].T
        R[:, rows] = B_touched @ X[touched] - B_rigid @ (M_rigid_free.T @ X) - taken
        fields[free] += X @ pressures[rows]
    fields -= rigid @ (M_rigid.T @ fields)
    if whole_modes:
        fields -= normal.Phi @ (normal.Phi.T @ (model.M @ fields))
    else:
        fields -= (normal.Phi / normal.angular_frequencies) @ (kept.T @ pressures)
    if flexibility is None:
        own.free()
    whole = R.diagonal() + (kept**2).sum(axis=1)
    scale = np.sqrt(np.where(whole > 0, whole, 1.0))
    asymmetry = np.abs((R - R.T) / np.outer(scale, scale)).max(initial=0.0)
    if asymmetry > SYMMETRY_TOLERANCE:
        raise StageError(f"modes: residual flexibility is asymmetric by {asymmetry:.2g}")
    return Residual(0.5 * (R + R.T), scale, fields)


def _spread(X: np.ndarray, free: np.ndarray, size: int) -> np.ndarray:
    """Return columns over some dofs as columns over all."""
    whole = np.zeros((size, X.shape[1]))
    whole[free] = X
    return whole


def _carried(parts: LineStiffness, Phi: np.ndarray, X: np.ndarray) -> np.ndarray:
    """Return the coordinates of X (dofs, k) in the span of Φ (dofs, m) by strain energy, (m, k)."""
    return linalg.solve(parts.product(Phi), parts.product(Phi, X), assume_a="pos")


def static_shapes(model: FEModel, B: sparse.csr_matrix, residual: Residual, pressures: np.ndarray) -> StaticShapes:
    """Turn the residual shapes under given pressure fields into M-orthonormal coordinates of their own.

    Within the span of W·pressures the Ritz problem (pᵀ R p) y = θ (pᵀ Wᵀ M W p) y makes them diagonal in M and K.

    Args:
        B: Displacement conjugate to each force, (c, dofs).
        residual: Of the same rows and fields.
        pressures: Forces of each field, (c, k).
    """
    R = residual.flexibility
    if pressures.shape[1] == 0:
        return StaticShapes(np.empty(0), np.empty((B.shape[1], 0)), R, 0)
    flexibility = residual.fields.T @ (model.K @ residual.fields)
    scale = 1 / np.sqrt(flexibility.diagonal())
    strength, directions = linalg.eigh(flexibility * scale * scale[:, None])
    kept = strength > RANK_TOLERANCE * strength[-1]
    WY = residual.fields @ ((directions[:, kept] / np.sqrt(strength[kept])) * scale[:, None])
    inverse_theta, Z = linalg.eigh(WY.T @ (model.M @ WY))
    values, Z = 1 / inverse_theta[::-1], Z[:, ::-1]
    Phi = WY @ (Z * np.sqrt(values))
    at_points = B @ Phi
    rest = R - (at_points / values) @ at_points.T
    return StaticShapes(np.sqrt(values), Phi, 0.5 * (rest + rest.T), int((~kept).sum()))


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


def _pinned(K: sparse.csr_matrix, pinned: np.ndarray, free: np.ndarray) -> sparse.csr_matrix:
    """Return K over the free dofs with some of them uncoupled from all others: its blocks of dofs stay whole.

    Args:
        pinned: Numbers of those in the model, (p,).
        free: Numbers of the free dofs, ascending, (free,).
    """
    if not len(pinned):
        return K
    kept = np.ones(K.shape[0])
    kept[np.searchsorted(free, pinned)] = 0.0
    keep = sparse.diags_array(kept)
    return sparse.csr_matrix(keep @ K @ keep + sparse.diags_array((1 - kept) * K.diagonal()))


def _statically_determinate(rigid: np.ndarray) -> np.ndarray:
    """Return as many dofs as there are rigid motions, chosen to hold the body firmly (pivoted QR of Φ_r)."""
    _, _, pivots = linalg.qr(rigid.T, mode="economic", pivoting=True)
    return np.sort(pivots[: rigid.shape[1]])
