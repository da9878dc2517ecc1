"""Derivatives of a component's modal record with respect to a parameter, from matrices assembled beside its value.

With K' and M' by differences of fourth order of the assembled matrices, at their full quadrature, a mode of
K φ = λ M φ has

    λ' = φᵀ (K' − λ M') φ,   (K − λ M) φ' = −(K' − λ M' − λ' M) φ,   φᵀ M φ' = −½ φᵀ M' φ

(Fox & Kapoor 1968). φ' is a sum over the kept modes and the rigid motions, and the rest by conjugate gradients with the
static flexibility as preconditioner. Of modes with equal frequencies those combinations are taken that a change of the
parameter leaves apart. The compliance C = B G Bᵀ, stationary in Y = G F, with forces F = (1 − M Φ_r Φ_rᵀ) Bᵀ that
inertia balances, has

    C' = Yᵀ F' + F'ᵀ Y − Yᵀ K' Y,   R' = C' − (B Φ Λ⁻¹ Φᵀ Bᵀ)'.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.solver.sensitivity.adjoint import difference

CLOSE = 0.01
"""Relative distance of neighbouring frequencies below which modes are a group."""
EQUAL = 1e-9
"""Relative difference of eigenvalues that is round-off: modes with it turn into each other freely."""
SETTLED = 1e-11
"""Residual of φ' over that at the start at which conjugate gradients end."""
ROUND_OFF = 1e-13
"""The same over the terms whose difference it is."""
MOST = 200
"""Steps of conjugate gradients, at most."""


@dataclass(frozen=True)
class Assembled:
    """A component at one value of a parameter."""

    model: FEModel
    B: sparse.csr_matrix
    """Rows of all interfaces, (c, dofs)."""

    @property
    def forces(self) -> np.ndarray:
        """Forces of unit loads on the rows, balanced by inertia, (dofs, c)."""
        rigid, loads = self.model.rigid_modes, self.B.T.toarray()
        return loads - self.model.M @ (rigid @ (rigid.T @ loads))


@dataclass(frozen=True)
class ModalDerivative:
    """Derivatives of modes and of residual flexibility."""

    frequencies: np.ndarray
    """ω' [rad/s per unit], (m,)."""
    turn: np.ndarray
    """Combinations of the modes whose derivatives these are, orthogonal, (m, m)."""
    shapes: np.ndarray
    """φ' of these combinations, (dofs, m)."""
    residual: np.ndarray
    """R' [m/N per unit], (c, c)."""


def groups(omega: np.ndarray) -> list[np.ndarray]:
    """Return the numbers of the modes in each group of close frequencies."""
    begins = np.flatnonzero(omega[1:] / omega[:-1] - 1 >= CLOSE) + 1
    return np.split(np.arange(len(omega)), begins)


def frequency_derivatives(
    beside: Mapping[int, Assembled], step: float, omega: np.ndarray, Phi: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return λ' as the matrix Φᵀ(K' − ½ (λ_i + λ_j) M')Φ, K' Φ and M' Φ, of modes (dofs, m)."""
    values = omega**2
    K = difference({k: neighbour.model.K @ Phi for k, neighbour in beside.items()}, step)
    M = difference({k: neighbour.model.M @ Phi for k, neighbour in beside.items()}, step)
    inner = Phi.T @ K - 0.5 * (values[:, None] + values) * (Phi.T @ M)
    return inner, K, M


def modal_derivative(
    base: Assembled, beside: Mapping[int, Assembled], step: float, omega: np.ndarray, Phi: np.ndarray
) -> ModalDerivative:
    """Return the derivatives of normal modes and residual flexibility.

    Args:
        beside: The component with the parameter moved by multiples of a step, those of `WEIGHTS`.
        omega, Phi: Frequencies [rad/s], (m,), and normal modes (dofs, m) at its value.
    """
    inner, _, _ = frequency_derivatives(beside, step, omega, Phi)
    turn = _unmixed(omega, inner)
    Phi = Phi @ turn
    inner, K_Phi, M_Phi = frequency_derivatives(beside, step, omega, Phi)
    values, slopes = omega**2, inner.diagonal()
    flexibility = Flexibility(base.model, base.B)
    shapes = _shape_derivatives(base.model, flexibility, (omega, Phi), (K_Phi, M_Phi))
    Y = np.zeros((len(base.model.held), base.B.shape[0]))
    for start in range(0, Y.shape[1], 64):
        Y[:, start : start + 64] = flexibility.solve(base.B[start : start + 64].T.toarray())
    flexibility.free()
    change = difference({k: neighbour.forces for k, neighbour in beside.items()}, step)
    stiffness = difference({k: neighbour.model.K @ Y for k, neighbour in beside.items()}, step)
    worked = Y.T @ change
    compliance = worked + worked.T - Y.T @ stiffness
    rows = base.B @ Phi
    rows_change = difference({k: neighbour.B @ Phi for k, neighbour in beside.items()}, step) + base.B @ shapes
    mixed = (rows_change / values) @ rows.T
    carried = mixed + mixed.T - (rows * (slopes / values**2)) @ rows.T
    residual = compliance - carried
    return ModalDerivative(slopes / (2 * omega), turn, shapes, 0.5 * (residual + residual.T))


def _unmixed(omega: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Return the combinations of modes with equal frequencies that a change leaves apart, (m, m)."""
    turn, values = np.eye(len(omega)), omega**2
    begins = np.flatnonzero(values[1:] / values[:-1] - 1 >= EQUAL) + 1
    for group in np.split(np.arange(len(omega)), begins):
        if len(group) > 1:
            turn[np.ix_(group, group)] = np.linalg.eigh(inner[np.ix_(group, group)])[1]
    return turn


def _shape_derivatives(
    model: FEModel,
    flexibility: Flexibility,
    modes: tuple[np.ndarray, np.ndarray],
    changes: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """Return φ' of modes, (dofs, m).

    Args:
        modes: ω [rad/s], (m,), and Φ (dofs, m).
        changes: K' Φ and M' Φ, (dofs, m) each.
    """
    (omega, Phi), (K_Phi, M_Phi) = modes, changes
    values, rigid = omega**2, model.rigid_modes
    loads = K_Phi - M_Phi * values
    products = Phi.T @ loads
    value_differences = values[None, :] - values[:, None]
    equal = np.abs(value_differences) < EQUAL * values
    shares = np.where(equal, 0.0, products / np.where(equal, 1.0, value_differences))
    np.fill_diagonal(shares, -0.5 * np.einsum("dm,dm->m", Phi, M_Phi))
    combined = Phi @ shares + rigid @ ((rigid.T @ loads) / values)
    basis = np.column_stack([rigid, Phi])
    M_basis = model.M @ basis
    remainder = -(loads - M_basis @ (basis.T @ loads))
    remainder[model.held] = 0.0
    sizes = np.linalg.norm(K_Phi, axis=0) + np.linalg.norm(M_Phi * values, axis=0)
    return combined + _outside((model, flexibility), values, remainder, sizes, (basis, M_basis))


def _outside(
    factored: tuple[FEModel, Flexibility],
    values: np.ndarray,
    loads: np.ndarray,
    sizes: np.ndarray,
    bases: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """Return x with (K − λ M) x = loads, column by column, among displacements that are M-orthogonal to a basis.

    Args:
        sizes: Of the terms whose differences the loads are, (m,).
        bases: The basis and M times it, (dofs, b) each.
    """
    (model, flexibility), (basis, M_basis) = factored, bases

    def preconditioned(residual: np.ndarray) -> np.ndarray:
        answer = np.zeros_like(residual)
        answer[model.free] = flexibility.displaced(residual[model.free])
        return answer - basis @ (M_basis.T @ answer)

    def projected(forces: np.ndarray) -> np.ndarray:
        forces = forces - M_basis @ (basis.T @ forces)
        forces[model.held] = 0.0
        return forces

    x, residual = np.zeros_like(loads), loads.copy()
    allowed = np.maximum(SETTLED * np.linalg.norm(loads, axis=0), ROUND_OFF * sizes)
    Z = preconditioned(residual)
    direction, product = Z.copy(), np.einsum("dk,dk->k", residual, Z)
    for _ in range(MOST):
        goes_on = np.linalg.norm(residual, axis=0) > allowed  # Round-off grows in columns that have settled.
        if not goes_on.any():
            return x
        moved = projected(model.K @ direction - (model.M @ direction) * values)
        work = np.einsum("dk,dk->k", direction, moved)
        length = np.divide(product, work, out=np.zeros_like(work), where=goes_on & (work > 0))
        x, residual = x + direction * length, residual - moved * length
        Z = preconditioned(residual)
        previous, product = product, np.einsum("dk,dk->k", residual, Z)
        direction = Z + direction * np.divide(product, previous, out=np.zeros_like(product), where=previous > 0)
    raise StageError(f"sensitivity: derivatives of mode shapes do not settle in {MOST} steps")


def refuse_unlike(model: FEModel, spread: sparse.csr_matrix, key: str) -> None:
    """Raise an InputError where the shapes of a record do not say all dofs."""
    tied = spread.shape[1] != spread.shape[0] or (spread != sparse.eye_array(spread.shape[0])).nnz > 0
    if model.rotations.any() or tied or model.nodal_dofs != len(model.held):
        raise InputError(
            f"{key}: no derivative is found of beams, rigid ties and imported matrices; vary parts of solid elements or"
            " bars"
        )
