"""Steps of five stages at the points of Lobatto: what implicit and exponential ones begin with, and keep."""

from collections.abc import Callable

import numpy as np

from gudgeon.solver.forces.fields.co_energy import LEFT as LEFT_GRID
from gudgeon.solver.integrators.mechanism.arrays import Model, Work
from gudgeon.solver.integrators.mechanism.collocation.table import table_of
from gudgeon.solver.integrators.mechanism.steps import Given, Tried

STAGES = 5
"""Of a step, behind its start: order 10."""


class Balance:
    """By what the error of the energy balance is measured: the largest kinetic energy so far."""

    def __init__(self, kinetic_energy: float) -> None:
        """Begin with a kinetic energy [J]."""
        self._kinetic = kinetic_energy

    @property
    def weight(self) -> float:
        """What the error is multiplied by [1/J]."""
        return 1 / self._kinetic

    def note(self, kinetic: float) -> None:
        """Note the kinetic energy at the start of an accepted step [J]."""
        self._kinetic = max(self._kinetic, kinetic)


class CollocationSteps:
    """Steps of five stages, order 10, which go on with the polynomials of the last one."""

    power = STAGES + 1

    def __init__(
        self,
        model: Model,
        work: Work,
        tolerance: float,
        drives: Given,
        weights: Callable[[], np.ndarray],
        *,
        least: float,
    ) -> None:
        """
        Args:
            tolerance: Error of a step.
            least: Kinetic energy by which the error of the balance is measured at least [J].
            weights: What the error of each number is multiplied by, now, (13 n + SUMS,).
        """
        self._model, self._work, self._tolerance = model, work, tolerance
        self._given, self._weights = drives, weights
        self._table = table_of(STAGES)
        self._balance = Balance(least)
        self._before: Tried | None = None
        self._prepare(work.stage.shape[0])

    def _prepare(self, size: int) -> None:
        """Make the arrays of steps from states of a size."""
        raise NotImplementedError

    def restart(self, state: np.ndarray, time: float) -> None:
        self._before = None

    def _given_at(self, time: float, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Return drives and loads at the start of a step and at its stages, whose work arrays are made ready."""
        self._work.least[0] = 1.0
        self._work.field[:, LEFT_GRID] = 0.0
        return self._given(time + h * np.append(0.0, self._table.points))
