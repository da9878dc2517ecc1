"""Forces of springs on elastic bodies at the start, in equilibrium with loads, gravity and given contact forces.

With u the elongations without the springs' forces f = −F(u + A f), A = W Λ⁻¹ Wᵀ + R over the elastic coordinates, or R
alone where bodies start undeformed; Newton's method, since A is positive semidefinite and F does not decrease.
"""

import numpy as np

from gudgeon.solver.errors import SceneError
from gudgeon.solver.system.springs import Springs

CONVERGED = 1e-13
"""Change of the elongations, relative to the largest, at which Newton's method ends."""
MOST_STEPS = 200


def spring_forces(springs: Springs, free: np.ndarray, compliance: np.ndarray) -> np.ndarray:
    """Return the force of each row along its elongation [N], (b,).

    Args:
        free: Elongations without these forces [m], (b,).
        compliance: A [m/N], (b, b).

    Raises:
        SceneError: Newton's method does not converge.
    """
    elongation = free.copy()
    for _ in range(MOST_STEPS):
        tension, slope = springs.tension(elongation)
        wrong = elongation - free + compliance @ tension
        change = np.linalg.solve(np.eye(len(free)) + compliance * slope, wrong)
        elongation = elongation - change
        if np.abs(change).max(initial=0.0) <= CONVERGED * np.abs(elongation).max(initial=0.0):
            return -springs.tension(elongation)[0]
    raise SceneError(
        f"force.{springs.names[0]}: the equilibrium of the springs at the start was not found; change their tables, or"
        " set run.start to 'undeformed'"
    )


def stiffening(springs: Springs, forces: np.ndarray, free: np.ndarray, compliance: np.ndarray) -> np.ndarray:
    """Return the change of the forces per change of the elongation without them, negative, at given forces, (b, b)."""
    slope = springs.tension(free + compliance @ forces)[1]
    return -np.linalg.solve(np.eye(len(free)) + slope[:, None] * compliance, np.diag(slope))
