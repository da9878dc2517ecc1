"""Steps by collocation at the points of Lobatto, whose size the frequencies of bodies that deform do not bound."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gudgeon.solver.forces.fields.co_energy import LEFT as LEFT_GRID
from gudgeon.solver.integrators.mechanism.arrays import Model, Work
from gudgeon.solver.integrators.mechanism.implicit.arrays import Course, newton_of
from gudgeon.solver.integrators.mechanism.implicit.step import implicit_step
from gudgeon.solver.integrators.mechanism.implicit.table import shares, table_of
from gudgeon.solver.integrators.mechanism.steps import LEFT, Given, Kind, Prepared, Tried, Within

STAGES = 5
"""Of a step, behind its start: order 10."""
NEWTON = 0.03
"""Tolerance of Newton's method over that of a step."""


class Balance:
    """By what the error of the energy balance is measured: the largest kinetic energy so far."""

    def __init__(self, least: float) -> None:
        """Begin with a kinetic energy [J]."""
        self._kinetic = least

    @property
    def weight(self) -> float:
        """What the error is multiplied by [1/J]."""
        return 1 / self._kinetic

    def note(self, kinetic: float) -> None:
        """Note the kinetic energy at the start of an accepted step [J]."""
        self._kinetic = max(self._kinetic, kinetic)


class Stages(NamedTuple):
    """Of a step."""

    increments: np.ndarray
    """From its start, (s, N)."""
    multipliers: np.ndarray
    """(s, m)"""
    kinetic: float
    """Energy at its start [J]."""


class ImplicitSteps:
    """Steps of five stages, order 10."""

    kind: Kind = "implicit"
    cost, bound, holds = 1.5, 3.0, 1.0

    def __init__(
        self,
        model: Model,
        work: Work,
        tolerance: float,
        given: Given,
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
        self._work, self._tolerance = work, tolerance
        self._given, self._weights = given, weights
        self._table, self.power = table_of(STAGES), STAGES + 1
        self._models = model, model._replace(modal_root=model.modal_root.copy())
        size = work.stage.shape[0]
        self._newton = newton_of(model, size, STAGES)
        self._outer = np.linalg.inv(self._table.points[:, None] ** np.arange(STAGES)).T
        self._balance = Balance(least)
        self._before: Tried | None = None
        self._step = Prepared(implicit_step)
        self._newton.rate[0] = 0.5

    def computed(self, state: np.ndarray, time: float, h: float, *, project: bool = False) -> Tried:
        table, newton, out = self._table, self._newton, np.empty_like(state)
        given, amounts = self._given(time + h * np.append(0.0, table.points))
        times = table.eigenvalues / h
        course = Course(
            times, first=h * table.points, start=table.start, there=table.there, back=table.back,
            error_start=table.error_start, error=table.error / h, given=given, amounts=amounts, weight=self._weights(),
            energy=self._balance.weight, fresh=self._before is None, tolerance=NEWTON * self._tolerance,
            asked=self._tolerance,
        )  # fmt: skip
        self._guess(h)
        self._work.least[0] = 1.0
        self._work.field[:, LEFT_GRID] = 0.0
        error, left, converged = self._step(self._models, self._work, newton, course, state, out)
        sound = bool(converged and np.isfinite(out).all() and np.isfinite(error) and left <= LEFT)
        least = float(self._work.least[0])
        stages = Stages(newton.stages.copy(), newton.multipliers.copy(), float(newton.energy[0]))
        stages.increments[-1] = out - state
        return Tried(h, course, out, stages, error=error / self._tolerance, sound=sound, least=least)

    def _guess(self, h: float) -> None:
        """Set increments and multipliers of stages by the polynomials of the last step, continued."""
        if self._before is None:
            return
        points, before = self._table.points, self._before
        places = 1 + points * (h / before.h)
        found = shares(self._table.polynomials, places)[:, 1:]
        found[:, -1] -= 1.0
        self._newton.stages[:] = found @ before.slopes.increments
        self._newton.multipliers[:] = shares(self._outer, places) @ before.slopes.multipliers

    def restart(self, state: np.ndarray, time: float) -> None:
        self._before = None

    def accept(self, one: Tried) -> None:
        self._before = one
        self._balance.note(one.slopes.kinetic)

    def within(self, one: Tried, state: np.ndarray) -> Within:
        polynomials, increments = self._table.polynomials, one.slopes.increments

        def at(x: float) -> np.ndarray:
            return state + shares(polynomials, np.array([x]))[0, 1:] @ increments

        return at
