"""The nodal synthesis: all nodal dofs, implicit, contact at the same points. The reference where no exact answer is.

Midpoint rule for the elastic body and the discrete gradient of the contact potential V(g) = ½ κ ⟨−g⟩², point by point:

    S v̄ = M v − ½ dt K u + ½ dt Gᵀ λ̄,   S = M + ¼ dt² K,   λ̄ = −(V(g⁺) − V(g)) / (g⁺ − g)
    u⁺ = u + dt v̄,   v⁺ = 2 v̄ − v

so that ½vᵀMv + ½uᵀKu + ΣV keeps its value to Newton's tolerance at any step: contact can gain no energy. S is
factorised once; contact enters through the low-rank W = G S⁻¹ Gᵀ, Newton runs on the touching points only.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from modaldb.schema import NodalRecord
from pipeline.errors import StageError
from pipeline.linalg import factorise
from pipeline.model import FEModel

NEWTON_TOLERANCE = 1e-13
"""Change of a gap in the last iteration over the largest gap."""
NEWTON_LIMIT = 60
FLAT = 1e-6
"""Below this relative change of a gap the difference quotient is replaced by the derivative at its middle."""


@dataclass(frozen=True)
class NodalProblem:
    """A free body thrown at a rigid obstacle, c candidate points."""

    model: FEModel
    G: sparse.csr_matrix
    """∂g/∂u, (c, dofs)."""
    gap: np.ndarray
    """Gaps at rest [m], (c,)."""
    stiffness: np.ndarray
    """κ of each point's surface layer [N/m], (c,)."""
    directions: np.ndarray
    """Direction of each point's force on the body, (c, 3)."""
    velocity: np.ndarray
    """Initial nodal velocities [m/s], (dofs,)."""
    duration: float


def simulate_nodal(problem: NodalProblem, step: float, progress: Callable[[float], None] | None = None) -> NodalRecord:
    """Integrate the problem with a fixed step [s].

    Args:
        progress: Told the share done from time to time.

    Raises:
        StageError: Newton's method did not converge in a step.
    """
    wall, cpu = time.perf_counter(), time.process_time()
    K, M, G = problem.model.K, problem.model.M, problem.G
    factor = factorise(M + (step**2 / 4) * K)
    Z = np.ascontiguousarray(factor.solve(G.T.toarray()).T)
    W = (step**2 / 2) * (G @ Z.T)
    count = max(1, round(problem.duration / step))
    u, v, gap = np.zeros(K.shape[0]), problem.velocity.copy(), problem.gap.copy()
    Ku, Mv = K @ u, M @ v
    start = 0.5 * float(v @ Mv)
    force, energies = np.zeros((count, 3)), np.zeros((count, 3))
    exchanged, worst, iterations = 0.0, 0.0, 0
    for n in range(count):
        mean = factor.solve(Mv - (step / 2) * Ku)
        free = gap + step * (G @ mean)
        new_gap, multipliers, used = _close(W, problem.stiffness, gap, free)
        iterations += used
        for i in np.flatnonzero(multipliers):
            mean += (step / 2 * multipliers[i]) * Z[i]
        u, v, gap = u + step * mean, 2 * mean - v, new_gap
        Ku, Mv = K @ u, M @ v
        force[n] = multipliers @ problem.directions
        energies[n] = 0.5 * (v @ Mv), 0.5 * (u @ Ku), 0.5 * problem.stiffness @ np.minimum(gap, 0) ** 2
        worst = max(worst, abs(energies[n].sum() - start))
        exchanged = max(exchanged, energies[n, 1] + energies[n, 2])
        if progress is not None and n % 64 == 0:
            progress(n / count)
    factor.free()
    return NodalRecord(
        step,
        step * np.arange(1, count + 1),
        force,
        energies,
        worst / exchanged if exchanged else 0.0,
        K.shape[0],
        iterations,
        time.perf_counter() - wall,
        time.process_time() - cpu,
    )


def _close(
    W: np.ndarray, stiffness: np.ndarray, gap: np.ndarray, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray, int]:
    """Solve g⁺ = free + W λ̄(g, g⁺); returns g⁺ (c,), λ̄ (c,) and the iterations used."""
    if gap.min() >= 0 and free.min() >= 0:
        return free, np.zeros(len(gap)), 0
    new, scale, change = free.copy(), np.abs(free).max(), np.zeros_like(free)
    for iteration in range(1, NEWTON_LIMIT):
        multipliers, slope = _discrete_gradient(stiffness, gap, new)
        defect = new - free - W @ multipliers
        moving = np.flatnonzero(slope)
        change = -defect
        if len(moving):
            block = np.eye(len(moving)) - W[np.ix_(moving, moving)] * slope[moving]
            inner = np.linalg.solve(block, -defect[moving])
            change += W[:, moving] @ (slope[moving] * inner)
        new = new + change
        if np.abs(change).max() <= NEWTON_TOLERANCE * scale:
            return new, _discrete_gradient(stiffness, gap, new)[0], iteration
    raise StageError(
        f"nodal: contact did not converge in {NEWTON_LIMIT} iterations (change {np.abs(change).max():.2g} m)"
    )


def _discrete_gradient(stiffness: np.ndarray, old: np.ndarray, new: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return λ̄ and ∂λ̄/∂g⁺ of each point."""
    depth_old, depth_new = np.maximum(-old, 0), np.maximum(-new, 0)
    difference = new - old
    flat = np.abs(difference) <= FLAT * np.maximum(np.abs(old), np.abs(new))
    safe = np.where(flat, 1.0, difference)
    energy_change = 0.5 * stiffness * (depth_new**2 - depth_old**2)
    multipliers = np.where(flat, 0.5 * stiffness * (depth_old + depth_new), -energy_change / safe)
    slope = np.where(flat, -0.5 * stiffness * (new < 0), (stiffness * depth_new * safe + energy_change) / safe**2)
    return multipliers, slope
