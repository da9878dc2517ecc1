"""Assembled modes of a linearised system: frequencies, damping ratios and what takes part.

With T = R + S over the ports that hold, these are stiffnesses Wᵀ T⁻¹ W where T has a compliance and constraints
Zᵀ W q = 0 where it has none, T Z = 0. A port's dashpot and the delay of R damp by T⁻¹ (−T′) T⁻¹, exact for a spring
with a dashpot, and of first order where the residual flexibility is damped; dampers alone act on W_d q − R_d T⁻¹ W q.
"""

from dataclasses import dataclass

import numpy as np

from gudgeon.solver.linear.state import Linearised
from gudgeon.solver.system.held_damping import left_free, yielding_and_firm

STILL = 1e-9
"""Part of what turns or moves, over its whole, that is round-off."""


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
    """Return the modes of a linearised system.

    Frequencies are singular values of a factor F of the stiffness, FᵀF = K: those of soft mounts keep their digits
    beside stiff parts, where eigenvalues of K would lose them below some 1e-8 of the highest.
    """
    system = linearised.system
    F, C, N, loads = matrices(linearised)
    omega, Phi = undamped(F, free_motions(linearised))
    if loads.any():
        elastic = slice(free_motions(linearised), None)
        values, turned = np.linalg.eigh(
            np.diag(omega[elastic] ** 2) + Phi[:, elastic].T @ (N.T @ loads @ N) @ Phi[:, elastic]
        )
        omega[elastic], Phi[:, elastic] = np.sqrt(np.maximum(values, 0.0)), Phi[:, elastic] @ turned
    top = float(omega.max(initial=0.0))
    quiet = (omega == 0) & (np.abs(C @ Phi).max(axis=0, initial=0.0) <= STILL * top)
    if not np.any(C):
        s, shapes, real = 1j * omega, Phi.T, 0
    else:
        # With Ω q and q̇ as its state, whose scale is that of the frequencies, not of their squares.
        P, Omega = Phi[:, ~quiet], np.diag(omega[~quiet])
        count = P.shape[1]
        values, vectors = np.linalg.eig(np.block([[np.zeros((count, count)), Omega], [-Omega, -P.T @ C @ P]]))
        oscillates = np.imag(values) > STILL * np.abs(values)
        real = int(np.count_nonzero(np.abs(np.imag(values)) <= STILL * np.abs(values)))
        s = np.concatenate([np.zeros(int(quiet.sum()), complex), values[oscillates]])
        shapes = np.vstack([Phi[:, quiet].T.astype(complex), (P @ vectors[count:, oscillates]).T])
    order = np.argsort(np.abs(s), kind="stable")
    s, shapes = s[order], shapes[order] @ N.T
    shapes = shapes / np.linalg.norm(shapes, axis=1)[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        ratios = np.where(np.real(s) != 0, -np.real(s) / np.abs(s), 0.0)
    shares = {name: (np.abs(shapes[:, body.coordinates]) ** 2).sum(axis=1) for name, body in system.bodies.items()}
    return AssembledModes(np.abs(s) / (2 * np.pi), ratios, shapes, shares, _effective(linearised, shapes), real)


def undamped(F: np.ndarray, free: int) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies [rad/s], ascending, of which `free` are zero, (n,), and modes as columns, (n, n)."""
    _, sizes, right = np.linalg.svd(F, full_matrices=True)
    omega = np.zeros(F.shape[1])
    omega[len(omega) - len(sizes) :] = sizes[::-1]
    omega[:free] = 0.0
    return omega, right[::-1].T


def free_motions(linearised: Linearised) -> int:
    """Return the number of rigid motions that no stiffness and no constraint holds."""
    rigid, holds = linearised.system.rigid, linearised.holding[linearised.stiffness > 0]
    W = linearised.rows[holds]
    W = W[np.any(W, axis=1)]
    sizes = np.linalg.svd(W[:, rigid] / np.linalg.norm(W, axis=1)[:, None], compute_uv=False)
    return len(rigid) - int((sizes > STILL).sum())


def matrices(linearised: Linearised) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return factor F of the stiffness and damping over the motions that constraints leave, (k, n), (n, n), these,
    (m, n), and the stiffness by loads that soften, which has no such factor, (m, m)."""
    system, a = linearised.system, linearised.holding
    Lambda, C = np.diag(np.sqrt(system.stiffness)), np.diag(system.damping)
    W = linearised.rows[a]
    bare = linearised.stiffness == 0  # Dampers alone.
    dampers, D, c = a[bare], W[bare], linearised.damping[bare]
    softens = linearised.stiffness < 0  # By loads, along coordinates alone.
    loads = (W[softens].T * linearised.stiffness[softens]) @ W[softens]
    moves = ~bare & ~softens & (np.any(W, axis=1) | np.any(linearised.residual[:, a, a], axis=0))
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
        return Lambda, C + (D.T * c) @ D, np.eye(len(Lambda)), loads
    L, firm = yielding_and_firm(W, T, system.stiffness)
    F, inverse, N = np.vstack([Lambda, L.T @ W]), L @ L.T, left_free(firm, W)
    pulls = inverse @ W
    D = D - linearised.residual.sum(axis=0)[np.ix_(dampers, a)] @ pulls
    C = C + pulls.T @ (0.5 * (slower + slower.T)) @ pulls + (D.T * c) @ D
    return F @ N, N.T @ C @ N, N, loads


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
