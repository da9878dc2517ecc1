"""Undamped bodies on contact laws by the method of Runge and Kutta in numpy, which shares no loop with the core.

q'' = −ω² q + g − springs + Wᵀ F, F = max(0, K dⁿ (1 + χ ḋ/v⁻) + c ḋ) at the depth d = −(gap + W q) − R F of each point.
"""

from dataclasses import dataclass

import numpy as np

from gudgeon.solver.capabilities import Feature
from gudgeon.solver.scene.scene import Scene
from gudgeon.solver.scene.scene import _demands as demands
from gudgeon.solver.system.system import System

CARRIED = {
    Feature.LINEAR_LAW, Feature.SMOOTH_LAW, Feature.TWO_BODIES, Feature.GAUGES, Feature.PROBES, Feature.SPRING,
    Feature.GRAVITY,
}  # fmt: skip
"""Features of the scenes that it integrates."""
STEPS = 2000
HALVINGS = 32
"""Of the interval of a force in series with R: to 1e-9 of it."""


def carries(scene: Scene) -> bool:
    """Return whether all contacts of a scene have laws, and nothing else acts than is integrated here."""
    return all(c.law is not None for c in scene.contact.values()) and {d.feature for d in demands(scene)} <= CARRIED


@dataclass
class Laws:
    """The forces of a system's contact points."""

    system: System
    approach: np.ndarray
    """v⁻ of each point [m/s], 0 where it is open, (c,)."""

    def forces(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the forces of all points [N], (c,)."""
        (K, n, chi, c), R = self.system.law.T, self.system.residual.diagonal()
        depth, rate = -(self.system.gap + self.system.rows @ q), -(self.system.rows @ v)
        per_rate = np.divide(chi, self.approach, out=np.zeros_like(chi), where=self.approach > 0)

        def law(force: np.ndarray) -> np.ndarray:
            indentation = np.maximum(depth - R * force, 0.0)
            return np.where(
                indentation > 0, np.maximum(K * indentation**n * (1 + per_rate * rate) + c * rate, 0.0), 0.0
            )

        low, high = np.zeros_like(depth), law(np.zeros_like(depth))
        if not (R.any() and high.any()):
            return high
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            above = middle > law(middle)
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        return 0.5 * (low + high)

    def follow(self, q: np.ndarray, v: np.ndarray) -> None:
        """Set the approach of points that have closed, and none of open ones."""
        open_points = self.system.gap + self.system.rows @ q >= 0
        closed_now = ~open_points & (self.approach == 0)
        self.approach = np.where(closed_now, np.maximum(-(self.system.rows @ v), 0.0), self.approach)
        self.approach[open_points] = 0.0


def impulses(system: System, steps: int = STEPS) -> dict[str, float]:
    """Return the impulse of each contact over the run [N s]."""
    springs, dt = system.springs, system.scene.run.duration / steps
    laws, q, v = Laws(system, np.zeros(len(system.gap))), system.position.copy(), system.velocity.copy()
    total = np.zeros(len(system.gap))

    def rates(q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        force = laws.forces(q, v)
        pull = springs.rows.T @ (springs.stiffness * (springs.stretch + springs.rows @ q))
        return v, system.driving.gravity - system.stiffness * q - pull + system.rows.T @ force, force

    for _ in range(steps):
        one = rates(q, v)
        two = rates(q + 0.5 * dt * one[0], v + 0.5 * dt * one[1])
        three = rates(q + 0.5 * dt * two[0], v + 0.5 * dt * two[1])
        four = rates(q + dt * three[0], v + dt * three[1])
        moved, pushed, force = ((a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(one, two, three, four, strict=True))
        q, v, total = q + dt * moved, v + dt * pushed, total + dt * force
        laws.follow(q, v)
    return {
        f"{contact.name}.impulse": float(np.linalg.norm(total[contact.rows] @ system.directions[contact.rows]))
        for contact in system.contacts
    }
