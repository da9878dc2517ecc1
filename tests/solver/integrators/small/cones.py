"""Contact problems with Coulomb cones: y = y₀ + M x, given to the loop over ports and judged outside of it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gudgeon.solver import core
from gudgeon.solver.integrators.small.arrays import Arrays
from gudgeon.solver.integrators.small.integrator import Small
from tests.solver.port_systems import pair


@dataclass(frozen=True)
class Problem:
    """c points with three ports each: along the normal, then along both tangents."""

    matrix: np.ndarray
    """M [m/N], (3c, 3c)."""
    free: np.ndarray
    """y₀ [m], (3c,)."""
    friction: np.ndarray
    """Coefficients, (c,)."""

    def residual(self, x: np.ndarray) -> float:
        """Return the natural residual of forces over the largest force."""
        y, worst = self.free + self.matrix @ x, 0.0
        for point, mu in enumerate(self.friction):
            a = 3 * point
            normal = max(0.0, x[a] - y[a] / self.matrix[a, a])
            trial = (
                x[a + 1 : a + 3] - y[a + 1 : a + 3] / np.linalg.eigvalsh(self.matrix[a + 1 : a + 3, a + 1 : a + 3])[1]
            )
            size = float(np.linalg.norm(trial))
            held = trial if size <= mu * x[a] else trial * (mu * x[a] / size)
            worst = max(worst, abs(x[a] - normal), float(np.abs(x[a + 1 : a + 3] - held).max()))
        return worst / float(np.abs(x).max())


@dataclass(frozen=True)
class Solved:
    """What the loop found."""

    sound: bool
    forces: np.ndarray
    """[N], (3c,)."""
    sweeps: int
    newton: int
    """Steps of Newton's method."""


def arrays(folder: Path, problem: Problem, start: np.ndarray | None = None) -> Arrays:
    """Return the arrays of a loop of two blocks that has a problem in place of its own."""
    count = len(problem.friction)
    made = Small(pair(folder, count, 5, friction=0.3), 1e-7).arrays
    constants = made.constants._replace(
        columns=problem.matrix.T.ravel(), inertia=np.zeros(problem.matrix.size), plain=False
    )
    constants.friction[::3] = problem.friction[:, None]
    made.problem.ports[:] = np.arange(3 * count)
    made.problem.size[:2] = 3 * count, -1
    made.state.gap[:] = problem.free
    if start is not None:
        made.state.unknown[:] = start
    return made._replace(constants=constants)


def solved(folder: Path, problem: Problem, start: np.ndarray | None = None) -> Solved:
    """Let the loop solve a problem from given forces, none by default."""
    made = arrays(folder, problem, start)
    sound = core.Small(made, made, made).solve()
    counts = made.state.counts
    return Solved(sound, made.state.unknown.copy(), int(counts[3]), int(counts[5]))
