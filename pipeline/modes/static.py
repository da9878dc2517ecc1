"""Static correction: the displacement under contact forces and loads that the kept modes do not contain.

Attachment shapes with inertia relief are G Bᵀ with G = Pᵀ K_c⁻¹ P and P = I − M Φ_r Φ_rᵀ (K_c: enough dofs held to
prevent rigid motion); the residual shapes are W = (G − Φ Λ⁻¹ Φᵀ) Bᵀ and the residual flexibility is R = B W.
W is M-orthogonal to Φ, and its stiffness Wᵀ K W is R itself. A body held by supports has no rigid modes: there
P = I, and K_c is the stiffness of its free dofs.

The rows of B have different units (N, Pa), so that entries of R may differ by many orders of magnitude: R is checked
after scaling row i by the square root of its total flexibility bᵢ G bᵢᵀ.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy import linalg, sparse

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.model import FEModel, LineStiffness
from gudgeon.pipeline.linalg import factorise
from gudgeon.pipeline.modes.normal import NormalModes
from gudgeon.pipeline.modes.problem import grounding

BLOCK = 96
"""Right-hand sides per call of the solver."""
RANK_TOLERANCE = 1e-10
"""Directions of normalised shapes below this share of the largest are dependent, and dropped."""
SOLVED = 1e-5
"""Unbalanced share of the load of a static solution: solids leave 1e-9, beams of 400 elements 1e-6 by round-off."""
SYMMETRY_TOLERANCE = 1e-8
"""Of R after scaling: the difference between two solves by the same factor."""


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


class Flexibility:
    """G of a model: its elastic displacement under forces, with inertia relief if it has rigid motions."""

    def __init__(self, model: FEModel) -> None:
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
        pinned = _pinned(model.free_matrices()[0], np.setdiff1d(free, self.dofs, True), free)
        self.factor = factorise(pinned, definite=model.parts is not None)

    def grounded(self, loads: np.ndarray) -> np.ndarray:
        """Return K_c⁻¹ loads over `dofs`, (c, k).

        All solutions are checked by one product with K: that of their sum with random signs.

        Raises:
            StageError: the solutions do not balance their loads.
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
                f"modes: static solutions leave {rest:.2g} of their load unbalanced, allowed: {SOLVED:g}. A part is"
                " connected by too few nodes, the mesh has slivers, or the mesh is much finer than its shape needs"
            )
        return answer

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """Return G·forces [m], (dofs, k), for forces [N], (dofs, k); errors as of `grounded`."""
        balanced = forces - self.M_rigid @ (self.rigid.T @ forces)
        answer = np.zeros(forces.shape)
        answer[self.dofs] = self.grounded(balanced[self.dofs])
        return answer - self.rigid @ (self.M_rigid.T @ answer)

    def free(self) -> None:
        """Release the memory of the factor."""
        self.factor.free()


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
    own = flexibility or Flexibility(model)
    rigid, M_rigid, free = own.rigid, own.M_rigid, own.dofs
    B_free, B_rigid, M_rigid_free = sparse.csr_matrix(B[:, free]), B @ rigid, M_rigid[free]
    touched = np.unique(B_free.indices)
    B_touched = sparse.csr_matrix(B_free[:, touched])
    at_rows, whole_modes = B @ normal.Phi, "ritz_dropped" not in normal.quality
    kept = at_rows / normal.angular_frequencies
    # In a slender body nearly all of G Bᵀ cancels: the part of the normal modes is subtracted from the loads, and what
    # round-off leaves of it from the solutions.
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
            taken = at_rows @ _carried(model.parts, normal.Phi, X, free)
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
        raise StageError(
            f"modes: residual flexibility is asymmetric by {asymmetry:.2g}, allowed: {SYMMETRY_TOLERANCE:g}"
        )
    return Residual(0.5 * (R + R.T), scale, fields)


def _carried(parts: LineStiffness, Phi: np.ndarray, X: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Return the coordinates in the span of Φ (dofs, m), by strain energy, of X on the free dofs (free, k), (m, k)."""
    whole = np.zeros((len(Phi), X.shape[1]))
    whole[free] = X
    return linalg.solve(parts.product(Phi), parts.product(Phi, whole), assume_a="pos")


def static_shapes(model: FEModel, B: sparse.csr_matrix, residual: Residual) -> StaticShapes:
    """Return M-orthonormal shapes, diagonal in M and K, of the residual displacement under pressure fields.

    Nearly dependent ones are dropped, see `ritz_pairs`.

    Args:
        B: Displacement conjugate to each force, (c, dofs).
        residual: Of the same rows.
    """
    values, Phi = ritz_pairs(model, residual.fields)
    at_points = B @ Phi
    rest = residual.flexibility - (at_points / values) @ at_points.T
    return StaticShapes(np.sqrt(values), Phi, 0.5 * (rest + rest.T))


def ritz_pairs(model: FEModel, shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the Ritz values θ [rad²/s²] of shapes (dofs, k), ascending, and M-orthonormal Ritz vectors (dofs, m).

    The shapes are made K-orthonormal first and the mass is diagonalised, so that the lowest frequencies are the most
    exact. Directions of less than `RANK_TOLERANCE` of the largest are dropped.
    """
    stiffness = shapes.T @ (model.K @ shapes)
    scale = 1 / np.sqrt(np.maximum(stiffness.diagonal(), np.finfo(float).tiny))
    strength, directions = linalg.eigh(stiffness * scale * scale[:, None])
    kept = strength > RANK_TOLERANCE * strength.max(initial=0.0)
    shapes = shapes @ ((directions[:, kept] / np.sqrt(strength[kept])) * scale[:, None])
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


def _pinned(K: sparse.csr_matrix, pinned: np.ndarray, free: np.ndarray) -> sparse.csr_matrix:
    """Return K over free dofs (free,), ascending, with pinned ones (p,) uncoupled; its blocks of dofs stay full."""
    if not len(pinned):
        return K
    kept = np.ones(K.shape[0])
    kept[np.searchsorted(free, pinned)] = 0.0
    keep = sparse.diags_array(kept)
    return sparse.csr_matrix(keep @ K @ keep + sparse.diags_array((1 - kept) * K.diagonal()))
