"""The coordinates in which motion between two events is exact.

Between events the equations are linear with constant coefficients,

    p̈ = f − K p − D ṗ + A_rᵀ λ_r,    A_r p = const,

with K and D holding modal stiffness, springs, and every closed contact that has a compliance, and A_r the rows of rigid
contacts that are closed. Three parts move by themselves: directions on which no stiffness acts (polynomials, found
exactly and not as eigenvalues near zero), what the rigid rows hold (at rest), and oscillators Re(e^{μτ}).
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

RANK = 1e-10
"""Singular value of unit rows below which a direction counts as untouched."""
DEFECTIVE = 1e6
"""Condition of the oscillators above which two of them count as one: at critical damping they have one shape."""
APART = 1e-11
"""Part of the damping added there: it moves the answer by as much, and leaves three digits more than the condition."""


@dataclass(frozen=True)
class Linear:
    """One linear regime. Shapes: n coordinates, c compliant rows, r rigid rows."""

    stiffness: np.ndarray
    """ω² of the coordinates [rad²/s²], (n,)."""
    force: np.ndarray
    """f at the state that displacements count from, (n,)."""
    rows: np.ndarray
    """Rows on which springs act, (c, n)."""
    offsets: np.ndarray
    """Elongation of the springs at that state [m], (c,)."""
    springs: np.ndarray
    """Inverse of their compliance [N/m], (c, c), symmetric positive definite."""
    dampers: np.ndarray
    """Dashpots beside them [N s/m], (c,)."""
    rigid: np.ndarray
    """Rows that hold, (r, n)."""
    pushed: np.ndarray
    """Direction in which each rigid row's force acts on the coordinates, (r, n): the rows, or with slip's share."""


@dataclass(frozen=True)
class Basis:
    """Solution of a regime. Shapes: n coordinates, k polynomial directions, K oscillators."""

    drift: np.ndarray
    """Polynomial directions, (n, k)."""
    to_drift: np.ndarray
    """Their coordinates of p, (k, n)."""
    shapes: np.ndarray
    """Oscillators, (n, K), complex where damped."""
    exponents: np.ndarray
    """μ [1/s], (K,), imaginary parts not negative."""
    to_amplitudes: np.ndarray
    """Amplitudes of the oscillators from (z, ż), (K, 2 nz)."""
    to_moving: np.ndarray
    """z of p, (nz, n)."""
    moving: np.ndarray
    """p of z, (n, nz)."""
    stiffness: np.ndarray
    """Of z, (nz, nz)."""
    held: np.ndarray
    """Projector on what the rigid rows hold, (n, n); empty where nothing is."""
    coupling: np.ndarray
    """Force on z per held p, (nz, n)."""
    drag: np.ndarray
    """Force on z per held velocity, (nz, n)."""
    damping: np.ndarray
    """Of z, (nz, nz)."""
    projector: np.ndarray
    """What is left of a force where rigid rows push aslant, (n, n); empty where they do not."""


def solve(regime: Linear) -> Basis:
    """Find the basis of a regime.

    Raises:
        LinAlgError: rigid rows are dependent, or the regime has no complete set of oscillators.
    """
    if len(regime.rigid) and not np.array_equal(regime.rigid, regime.pushed):
        return _sliding(regime)
    stack = np.vstack([regime.rows, regime.rigid])
    drift = _untouched(stack, regime.stiffness == 0)
    n = len(regime.stiffness)
    taken = np.column_stack([drift, regime.rigid.T])
    if taken.shape[1]:
        full, upper = linalg.qr(taken)
        diagonal = np.abs(np.diag(upper))
        if diagonal.min() < 1e-12 * diagonal.max():
            raise linalg.LinAlgError("rigid rows are dependent")
        moving = full[:, taken.shape[1] :]
    else:
        moving = np.eye(n)
    K = _quadratic(moving, regime.stiffness) + _through(regime.rows @ moving, regime.springs)
    D = _through(regime.rows @ moving, np.diag(regime.dampers))
    held, none = np.empty((0, n)), np.empty((0, n))
    coupling = drag = np.zeros((moving.shape[1], n))
    if len(regime.rigid):
        held = regime.rigid.T @ np.linalg.solve(regime.rigid @ regime.rigid.T, regime.rigid)
        spread = regime.rows @ held
        coupling = -moving.T @ (regime.stiffness[:, None] * held + regime.rows.T @ (regime.springs @ spread))
        drag = -moving.T @ (regime.rows.T @ (regime.dampers[:, None] * spread))
    shapes, exponents, amplitudes = _oscillators(K, D)
    return Basis(
        drift, drift.T, moving @ shapes, exponents, amplitudes, moving.T, moving, K, held, coupling, drag, D, none
    )


def _oscillators(K: np.ndarray, D: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return shapes in z, exponents, and amplitudes from (z, ż)."""
    m = len(K)
    if not m:
        return np.zeros((0, 0)), np.zeros(0, complex), np.zeros((0, 0))
    if not np.any(D):
        if np.array_equal(K, np.diag(np.diag(K))):
            values, vectors = np.diag(K), np.eye(m)
        else:
            values, vectors = linalg.eigh(K)
        omega = np.sqrt(np.maximum(values, 0.0))
        if omega.min() <= 0:
            raise linalg.LinAlgError("a direction with stiffness came out without")
        # y = A cos ωτ + B sin ωτ = Re((A − iB) e^{iωτ})
        return vectors, 1j * omega, np.hstack([vectors.T, -1j * (vectors / omega).T])
    scale = np.sqrt(np.linalg.norm(K, 2))
    for damping in (D, (1 + APART) * D):
        companion = np.block([[np.zeros((m, m)), scale * np.eye(m)], [-K / scale, -damping]])
        values, vectors = linalg.eig(companion)
        if np.linalg.cond(vectors) < DEFECTIVE:
            break
    else:
        raise linalg.LinAlgError("the regime has no complete set of oscillators")
    amplitudes = np.linalg.inv(vectors)
    amplitudes[:, m:] /= scale
    # Of each pair the second follows the first; both share round-off that would not cancel if one were doubled.
    first, keep = np.flatnonzero(values.imag > 0), values.imag >= 0
    amplitudes[first] += amplitudes[first + 1].conj()
    return vectors[:m, keep], values[keep], amplitudes[keep]


def _sliding(regime: Linear) -> Basis:
    """Return the basis where slip makes the equations unsymmetric: p̈ = P (f − K p), P along the forces."""
    n = len(regime.stiffness)
    P = np.eye(n) - regime.pushed.T @ np.linalg.solve(regime.rigid @ regime.pushed.T, regime.rigid)
    K = P @ (np.diag(regime.stiffness) + _through(regime.rows, regime.springs))
    if np.any(regime.dampers):
        raise linalg.LinAlgError("dashpots beside slip")
    values, vectors = linalg.eig(K)
    order = np.argsort(np.abs(values))
    values, vectors = values[order], np.real(vectors[:, order])
    still = np.abs(values) <= 1e-12 * np.abs(values).max()
    if np.abs(values.imag).max() > 1e-9 * np.abs(values).max() or (values[~still].real <= 0).any():
        raise linalg.LinAlgError("slip makes the motion unstable")
    if still.all():
        vectors = np.eye(n)
    back = np.linalg.inv(vectors)
    omega = np.sqrt(values[~still].real)
    count = int(still.sum())
    m = n - count
    moving, nothing = vectors[:, count:], np.zeros((m, n))
    return Basis(
        vectors[:, :count], back[:count], moving, 1j * omega, np.hstack([np.eye(m), -1j * np.diag(1 / omega)]),
        back[count:], moving, np.diag(omega**2), np.empty((0, n)), nothing, nothing, np.zeros((m, m)), P,
    )  # fmt: skip


def _untouched(rows: np.ndarray, loose: np.ndarray) -> np.ndarray:
    """Return an orthonormal basis of the directions without stiffness that no row touches, (n, k)."""
    place = np.flatnonzero(loose)
    found = np.zeros((len(loose), len(place)))
    if not len(place):
        return found
    part = rows[:, place]
    size = np.linalg.norm(part, axis=1)
    part = part[size > RANK * np.linalg.norm(rows, axis=1)] if len(part) else part
    if len(part):
        part = part / np.linalg.norm(part, axis=1)[:, None]
        _, values, right = np.linalg.svd(part)
        free = right[int((values > RANK).sum()) :].T
    else:
        free = np.eye(len(place))
    found = np.zeros((len(loose), free.shape[1]))
    found[place] = free
    return found


def _quadratic(moving: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    product = moving.T @ (stiffness[:, None] * moving)
    return 0.5 * (product + product.T)


def _through(rows: np.ndarray, middle: np.ndarray) -> np.ndarray:
    if not len(rows):
        return np.zeros((rows.shape[1], rows.shape[1]))
    product = rows.T @ (middle @ rows)
    return 0.5 * (product + product.T)
