"""The coordinates in which motion between two events is exact.

Between events the equations are linear with constant coefficients,

    p̈ = f − K p − D ṗ + A_rᵀ λ_r,    A_r p = const,

with K and D of the modes, springs and closed compliant contacts, and A_r the rows of closed rigid contacts. Three parts
are uncoupled: directions without stiffness (polynomials of time, exact and not from eigenvalues near zero), those that
rigid rows hold (at rest), and oscillators Re(e^{μτ}).
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

RANK = 1e-10
"""Singular value of unit rows below which a direction is free of them."""
DEPENDENT = 1e-13
"""Eigenvalue of the springs at unit diagonal below which they are dependent: the round-off of their inverse."""
DEFECTIVE = 1e6
"""Condition number above which two oscillators coincide, as at critical damping."""
APART = 1e-11
"""Relative change of the damping in that case; the result changes by as much, three digits above the condition."""


class IncompleteError(linalg.LinAlgError):
    """The motion of a regime is no sum of polynomials and oscillators; the message gives the cause."""


@dataclass(frozen=True)
class Linear:
    """One linear regime. Shapes: n coordinates, c compliant rows, r rigid rows."""

    stiffness: np.ndarray
    """ω² of the coordinates [rad²/s²], (n,)."""
    force: np.ndarray
    """f at the state from which displacements are measured, (n,)."""
    rows: np.ndarray
    """Rows on which springs act, (c, n)."""
    offsets: np.ndarray
    """Elongation of the springs at that state [m], (c,)."""
    springs: np.ndarray
    """Inverse of their compliance [N/m], (c, c), symmetric positive definite."""
    dampers: np.ndarray
    """Dashpots in parallel with them [N s/m], (c,)."""
    rigid: np.ndarray
    """Rows of constant value, A_r, (r, n)."""
    pushed: np.ndarray
    """Direction of each rigid row's force on the coordinates, (r, n): the row, with its friction where it slips."""


@dataclass(frozen=True)
class Basis:
    """Solution of a regime. Shapes: n coordinates, k polynomial directions, K oscillators, nz without dashpots."""

    drift: np.ndarray
    """Polynomial directions, (n, k)."""
    to_drift: np.ndarray
    """Their coordinates of p, (k, n)."""
    push: np.ndarray
    """Acceleration of these coordinates per force on p, (k, n)."""
    shapes: np.ndarray
    """Oscillators, (n, K), complex where damped."""
    exponents: np.ndarray
    """μ [1/s], (K,), imaginary parts not negative, real parts not positive."""
    to_amplitudes: np.ndarray
    """Amplitudes of the oscillators from (z, ż), (K, 2 nz)."""
    to_moving: np.ndarray
    """z of p, (nz, n): the modal coordinates of the regime without its dashpots."""
    moving: np.ndarray
    """p of z, (n, nz)."""
    yielding: np.ndarray
    """Static z per force on p, (nz, n)."""
    slack: np.ndarray
    """Static z per elongation of the springs, (nz, c)."""
    held: np.ndarray
    """Projector on the directions that rigid rows hold, (n, n); empty without rigid rows."""
    way: np.ndarray
    """Velocity of static z per velocity of p that is held, (nz, n)."""
    lag: np.ndarray
    """Static z per such velocity, by dashpots, (nz, n)."""


def solve(regime: Linear) -> Basis:
    """Return the basis of a regime.

    With K = LᵀL, L = [√Λ; Cᵀ A] and springs S = C Cᵀ, the singular values of L are the frequencies. Low ones are more
    accurate than from K, whose round-off is relative to the square of the highest one.

    Raises:
        LinAlgError: rigid rows or springs are dependent.
        IncompleteError: the regime has no complete set of oscillators.
    """
    if len(regime.rigid) and not np.array_equal(regime.rigid, regime.pushed):
        return _sliding(regime)
    drift, n = _untouched(np.vstack([regime.rows, regime.rigid]), regime.stiffness == 0), len(regime.stiffness)
    taken = np.column_stack([drift, regime.rigid.T])
    plain = np.eye(n)
    if taken.shape[1]:
        full, upper = linalg.qr(taken)
        diagonal = np.abs(np.diag(upper))
        if diagonal.min() < 1e-12 * diagonal.max():
            raise linalg.LinAlgError("rigid rows are dependent")
        plain = full[:, taken.shape[1] :]
    stiff = np.flatnonzero(regime.stiffness)
    root = np.sqrt(regime.stiffness[stiff])
    through = _root(regime.springs)
    bend = np.vstack([root[:, None] * np.eye(n)[stiff], through.T @ regime.rows])
    U, omega, V = _singular(bend @ plain)
    if len(omega) and omega.min() <= 0:
        raise linalg.LinAlgError("a direction with stiffness has frequency zero")
    moving = plain @ V
    static, U_scaled = (moving / omega**2).T, (U / omega).T
    yielding = static.copy("K")
    yielding[:, stiff] = U_scaled[:, : len(stiff)] / root
    slack = -U_scaled[:, len(stiff) :] @ through.T
    projector, driven, lag = np.empty((0, n)), np.zeros((len(omega), n)), np.zeros((len(omega), n))
    dashed = regime.dampers[:, None] * regime.rows
    if len(regime.rigid):
        projector = regime.rigid.T @ np.linalg.solve(regime.rigid @ regime.rigid.T, regime.rigid)
        driven = -U_scaled @ (bend @ projector)
        lag = -(static @ (regime.rows.T @ (dashed @ (projector + moving @ driven))))
    shapes, exponents, amplitudes = _oscillators(omega, regime.rows @ moving, regime.dampers)
    return Basis(
        drift=drift, to_drift=drift.T, push=drift.T, shapes=moving @ shapes, exponents=exponents,
        to_amplitudes=amplitudes, to_moving=moving.T, moving=moving, yielding=yielding, slack=slack, held=projector,
        way=driven, lag=lag,
    )  # fmt: skip


def _root(springs: np.ndarray) -> np.ndarray:
    """Return C with C Cᵀ = S, (c, c), for any scales of the diagonal of S.

    Raises:
        LinAlgError: S is singular to round-off.
    """
    if not (springs.diagonal() > 0).all():
        raise linalg.LinAlgError("springs are dependent")
    scale = np.sqrt(springs.diagonal())
    values, vectors = linalg.eigh(springs / np.outer(scale, scale)) if len(scale) else (scale, springs)
    if values.min(initial=1.0) <= DEPENDENT:
        raise linalg.LinAlgError("springs are dependent")
    return scale[:, None] * vectors * np.sqrt(values)


def _singular(L: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return U, σ and V of L = U σ Vᵀ.

    Rows and columns are sorted by size before, so that small σ of graded matrices are accurate, too (Cox & Higham,
    BIT 38, 1998; Drmač & Veselić, SIAM J. Matrix Anal. 29, 2008).
    """
    m = L.shape[1]
    if not m:
        return np.zeros((len(L), 0)), np.zeros(0), np.zeros((0, 0))
    filled = L != 0
    if len(L) == m and (filled.sum(axis=0) == 1).all() and (filled.sum(axis=1) == 1).all():
        return np.sign(L), np.abs(L).max(axis=0), np.eye(m)  # Uncoupled already.
    order = np.argsort(-np.abs(L).max(axis=1), kind="stable")
    Q, R, columns = linalg.qr(L[order], mode="economic", pivoting=True)
    inner, sigma, right = linalg.svd(R)
    U, V = np.empty((len(L), m)), np.empty((m, m))
    U[order], V[columns] = Q @ inner, right.T
    return U, sigma, V


def _oscillators(omega: np.ndarray, rows: np.ndarray, dampers: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return shapes in z, exponents [1/s], and the matrix from (z, ż) to amplitudes.

    Args:
        omega: Frequencies without dashpots [rad/s], (m,).
        rows: Elongations of the dashpots per z, (c, m).
        dampers: [N s/m], (c,).
    """
    m = len(omega)
    if not m or not (np.any(dampers) and np.any(rows)):
        # y = A cos ωτ + B sin ωτ = Re((A − iB) e^{iωτ})
        return np.eye(m), 1j * omega, np.hstack([np.eye(m), -1j * np.diag(1 / omega)])
    # In (Σ z, ż), whose square is the energy, the matrix is skew but for the dashpots, thus nearly normal.
    drag = rows.T @ (dampers[:, None] * rows)
    for damping in (drag, (1 + APART) * drag):
        energies = np.block([[np.zeros((m, m)), np.diag(omega)], [-np.diag(omega), -damping]])
        values, vectors = linalg.eig(energies)
        # One of each conjugate pair: Re((α − iβ) w) = α Re w + β Im w.
        turning = values.imag > 0
        keep = values.imag >= 0
        real_vectors = np.hstack([vectors[:, keep].real, vectors[:, turning].imag])
        try:
            back = np.linalg.inv(real_vectors)
        except np.linalg.LinAlgError:
            continue
        if np.linalg.norm(back, axis=1).max() < DEFECTIVE:
            break
    else:
        raise IncompleteError("no complete set of oscillators")
    values, vectors = values[keep], vectors[:, keep]
    count, amplitudes = len(values), back[: len(values)].astype(complex)
    amplitudes[values.imag > 0] -= 1j * back[count:]
    amplitudes[:, :m] *= omega
    # z from the larger of its two energies, which has more digits.
    fast = np.abs(values) > omega[:, None]
    shapes = np.where(fast, vectors[m:] / np.where(fast, values, 1.0), vectors[:m] / omega[:, None])
    return shapes, np.minimum(values.real, 0.0) + 1j * values.imag, amplitudes


def _sliding(regime: Linear) -> Basis:
    """Return the basis of a regime with slip, whose equations are unsymmetric: p̈ = P (f − K p), P along the forces."""
    n = len(regime.stiffness)
    P = np.eye(n) - regime.pushed.T @ np.linalg.solve(regime.rigid @ regime.pushed.T, regime.rigid)
    K = P @ (np.diag(regime.stiffness) + _through(regime.rows, regime.springs))
    if np.any(regime.dampers):
        raise IncompleteError("dashpots during slip")
    values, vectors = linalg.eig(K)
    order = np.argsort(np.abs(values))
    values, vectors = values[order], np.real(vectors[:, order])
    still = np.abs(values) <= 1e-12 * np.abs(values).max()
    if np.abs(values.imag).max() > 1e-9 * np.abs(values).max() or (values[~still].real <= 0).any():
        raise IncompleteError("slip makes the motion unstable")
    if still.all():
        vectors = np.eye(n)
    back = np.linalg.inv(vectors)
    squares, count = values[~still].real, int(still.sum())
    m, moving, nothing = n - count, vectors[:, count:], np.zeros((n - count, n))
    yielding = (back[count:] / squares[:, None]) @ P
    shapes, exponents, amplitudes = _oscillators(np.sqrt(squares), np.zeros((0, m)), np.zeros(0))
    return Basis(
        drift=vectors[:, :count], to_drift=back[:count], push=back[:count] @ P, shapes=moving @ shapes,
        exponents=exponents, to_amplitudes=amplitudes, to_moving=back[count:], moving=moving, yielding=yielding,
        slack=-yielding @ (regime.rows.T @ regime.springs), held=np.empty((0, n)), way=nothing, lag=nothing,
    )  # fmt: skip


def _untouched(rows: np.ndarray, loose: np.ndarray) -> np.ndarray:
    """Return an orthonormal basis of the directions without stiffness to which all rows are orthogonal, (n, k)."""
    loose_columns = np.flatnonzero(loose)
    loose_rows, free = rows[:, loose_columns], np.eye(len(loose_columns))
    loose_rows = loose_rows[np.linalg.norm(loose_rows, axis=1) > RANK * np.linalg.norm(rows, axis=1)]
    if loose_rows.size:
        _, values, right = np.linalg.svd(loose_rows / np.linalg.norm(loose_rows, axis=1)[:, None])
        free = right[int((values > RANK).sum()) :].T
    basis = np.zeros((len(loose), free.shape[1]))
    basis[loose_columns] = free
    return basis


def _through(rows: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Return rowsᵀ middle rows, symmetric, (n, n)."""
    product = rows.T @ (middle @ rows)
    return 0.5 * (product + product.T)
