"""Contact in one step: the discrete gradient of V(g) = ½ κ ⟨−g⟩² point by point, solved by Newton's method."""

from collections.abc import Callable

import numpy as np

from gudgeon.pipeline.errors import StageError

NEWTON_TOLERANCE = 1e-13
"""Change of a gap in the last iteration over the largest gap."""
NEWTON_LIMIT = 60
FLAT = 1e-6
"""Relative change of a gap below which the difference quotient is replaced by the derivative at its middle."""


def close_gaps(
    W: np.ndarray,
    stiffness: np.ndarray,
    gap: np.ndarray,
    free: np.ndarray,
    scale: float,
    follow: Callable[[np.ndarray], np.ndarray] | None = None,
) -> tuple[np.ndarray, np.ndarray, int]:
    """Solve g⁺ = free + W λ̄(g, g⁺) + follow(λ̄).

    Args:
        W: Response of the gaps to constant forces [m/N], (a, a).
        stiffness: κ [N/m], (a,).
        gap: At the start of the step [m], (a,).
        free: At its end without contact forces [m], (a,).
        scale: The largest gap [m], to which the tolerance refers.
        follow: Further change of the gaps with the forces [m], (a,), so small that its derivative is omitted.

    Returns:
        g⁺ (a,), λ̄ (a,) and the iterations used.

    Raises:
        StageError: no convergence.
    """
    new, change = free.copy(), np.zeros_like(free)
    for iteration in range(1, NEWTON_LIMIT):
        multipliers, slope = discrete_gradient(stiffness, gap, new)
        defect = new - free - W @ multipliers
        if follow is not None:
            defect -= follow(multipliers)
        moving = np.flatnonzero(slope)
        change = -defect
        if len(moving):
            columns = W[:, moving] * slope[moving]
            block = -columns[moving]
            block[np.diag_indices(len(moving))] += 1
            change += columns @ np.linalg.solve(block, change[moving])
        new = new + change
        if np.abs(change).max() <= NEWTON_TOLERANCE * scale:
            return new, discrete_gradient(stiffness, gap, new)[0], iteration
    raise StageError(
        f"full FE: contact did not converge in {NEWTON_LIMIT} iterations (change {np.abs(change).max():.2g} m)"
    )


def discrete_gradient(stiffness: np.ndarray, old: np.ndarray, new: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return λ̄ = −(V(g⁺) − V(g)) / (g⁺ − g) and ∂λ̄/∂g⁺ of each point."""
    depth_old, depth_new = np.maximum(-old, 0), np.maximum(-new, 0)
    difference = new - old
    flat = np.abs(difference) <= FLAT * np.maximum(np.abs(old), np.abs(new))
    safe = np.where(flat, 1.0, difference)
    energy_change = 0.5 * stiffness * (depth_new**2 - depth_old**2)
    multipliers = np.where(flat, 0.5 * stiffness * (depth_old + depth_new), -energy_change / safe)
    slope = np.where(flat, -0.5 * stiffness * (new < 0), (stiffness * depth_new * safe + energy_change) / safe**2)
    return multipliers, slope


def contact_energy(stiffness: np.ndarray, gap: np.ndarray) -> float:
    """Return Σ V(g) [J]."""
    return float(0.5 * stiffness @ np.minimum(gap, 0) ** 2)
