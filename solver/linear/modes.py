"""Assembled modes of a linearised system: frequencies, damping ratios and what takes part.

With T = R + S over the ports that hold, these are stiffnesses Wᵀ T⁻¹ W where T has a compliance and constraints
Zᵀ W q = 0 where it has none, T Z = 0. A port's dashpot and the delay of R damp by T⁻¹ (−T′) T⁻¹, exact for a spring
with a dashpot, and of first order where the residual flexibility is damped.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from gudgeon.solver.linear.state import Linearised

RIGID = 1e-12
"""Compliance of a combination of ports, relative to what it or its coordinates yield, that is none."""
STILL = 1e-9
"""Squared frequency over the largest of the assembled system below which a mode is a free rigid motion."""


@dataclass(frozen=True)
class AssembledModes:
    """n modes by frequency, rigid motions first."""

    frequencies: np.ndarray
    """|s| / 2π, undamped where nothing damps [Hz], (n,)."""
    damping: np.ndarray
    """−Re s / |s|, (n,)."""
    shapes: np.ndarray
    """Over the coordinates, of unit norm, (n, m); complex where the system is damped."""
    shares: dict[str, np.ndarray]
    """Share of each body in the kinetic energy, (n,)."""
    masses: np.ndarray | None
    """Effective mass along x, y and z [kg], (n, 3); None where a supported body's record was not read for it."""
    overdamped: int
    """Number of real eigenvalues, which are no oscillations and are left out."""


def assembled_modes(linearised: Linearised) -> AssembledModes:
    """Return the modes of a linearised system."""
    system = linearised.system
    K, C, N = _matrices(linearised)
    squared, Phi = linalg.eigh(0.5 * (K + K.T))
    top = float(np.abs(squared).max(initial=0.0))
    still = squared <= STILL * top
    quiet = still & (np.abs(C @ Phi).max(axis=0, initial=0.0) <= STILL * np.sqrt(top))
    if not np.any(C):
        s, shapes, real = 1j * np.sqrt(np.where(still, 0.0, squared)), Phi.T, 0
    else:
        P = Phi[:, ~quiet]
        count = P.shape[1]
        state = np.block([[np.zeros((count, count)), np.eye(count)], [-P.T @ K @ P, -P.T @ C @ P]])
        values, vectors = np.linalg.eig(state)
        oscillates = np.imag(values) > STILL * np.abs(values)
        real = int(np.count_nonzero(np.abs(np.imag(values)) <= STILL * np.abs(values)))
        s = np.concatenate([np.zeros(int(quiet.sum()), complex), values[oscillates]])
        shapes = np.vstack([Phi[:, quiet].T.astype(complex), (P @ vectors[:count, oscillates]).T])
    order = np.argsort(np.abs(s), kind="stable")
    s, shapes = s[order], shapes[order] @ N.T
    shapes = shapes / np.linalg.norm(shapes, axis=1)[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        ratios = np.where(np.real(s) != 0, -np.real(s) / np.abs(s), 0.0)
    shares = {name: (np.abs(shapes[:, body.coordinates]) ** 2).sum(axis=1) for name, body in system.bodies.items()}
    return AssembledModes(np.abs(s) / (2 * np.pi), ratios, shapes, shares, _effective(linearised, shapes), real)


def _matrices(linearised: Linearised) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return stiffness and damping over the motions that constraints leave, (n, n), and these, (m, n)."""
    system, a = linearised.system, linearised.holding
    K, C = np.diag(system.stiffness), np.diag(system.damping)
    W = linearised.rows[a]
    bare = linearised.stiffness == 0  # Dampers alone.
    C = C + (W[bare].T * linearised.damping[bare]) @ W[bare]
    moves = ~bare & (np.any(W, axis=1) | np.any(linearised.residual[:, a, a], axis=0))
    W, a, stiffness, damping = W[moves], a[moves], linearised.stiffness[moves], linearised.damping[moves]
    R = linearised.residual[:, a][:, :, a]
    T = R.sum(axis=0) + np.diag(1 / stiffness)
    bodies = list(system.bodies.values())
    beta = np.array(
        [[bodies[b].stiffness_factor if b >= 0 else 0.0 for b in pair] for pair in linearised.ports.sides[a]]
    )
    slower = np.einsum("sij,js->ij", R, beta.reshape(-1, 2))
    with np.errstate(invalid="ignore"):
        slower = slower + np.diag(np.where(np.isfinite(stiffness), damping / stiffness**2, 0.0))
    if not len(a):
        return K, C, np.eye(len(K))
    highest = float(system.stiffness.max(initial=0.0)) or 1.0
    size = 1 / np.sqrt(np.maximum(((W / (system.stiffness + highest)) * W).sum(axis=1), T.diagonal()))
    values, Z = linalg.eigh(0.5 * (T + T.T) * np.outer(size, size))
    yields = values > RIGID
    soft, firm = size[:, None] * Z[:, yields], size[:, None] * Z[:, ~yields]
    inverse = (soft / values[yields]) @ soft.T
    K = K + W.T @ inverse @ W
    C = C + W.T @ inverse @ (0.5 * (slower + slower.T)) @ inverse @ W
    constraints = firm.T @ W
    N = (
        linalg.null_space(constraints / np.linalg.norm(constraints, axis=1)[:, None])
        if len(constraints)
        else np.eye(len(K))
    )
    return N.T @ K @ N, N.T @ C @ N, N


def _effective(linearised: Linearised, shapes: np.ndarray) -> np.ndarray | None:
    """Return the effective masses of modes of unit norm [kg], (n, 3)."""
    moved = np.zeros((3, shapes.shape[1]))
    for body in linearised.system.bodies.values():
        for axis in range(3):
            moved[axis, body.rigid] = body.rigid_velocity(np.eye(3)[axis], np.zeros(3))
        if len(body.modal.angular_frequencies) and body.modal.participation is not None:
            moved[:, body.elastic] = body.modal.participation
        elif len(body.modal.angular_frequencies) and len(body.morph.rigid_twists) < 6:
            return None
    return np.abs(shapes @ moved.T) ** 2
