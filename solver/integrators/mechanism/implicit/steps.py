"""Steps by collocation at the points of Lobatto, whose size the frequencies of bodies that deform do not bound."""

from typing import NamedTuple

import numpy as np

from gudgeon.solver import core
from gudgeon.solver.integrators.mechanism.collocation.steps import STAGES, CollocationSteps
from gudgeon.solver.integrators.mechanism.collocation.table import shares
from gudgeon.solver.integrators.mechanism.implicit.arrays import Course, newton_of
from gudgeon.solver.integrators.mechanism.steps import LEFT, Kind, Tried, Within

NEWTON = 0.03
"""Tolerance of Newton's method over that of a step."""
CONVERGED = 1e-13
"""Tolerance of Newton's method at most: what is left violates the balances of momentum between jointed bodies."""
RATIOS = 0.9, 1e-3
"""Ratio of changes beyond which it does not converge, and the least that is believed."""


class Stages(NamedTuple):
    """Of a step."""

    increments: np.ndarray
    """From its start, (s, N)."""
    multipliers: np.ndarray
    """(s, m)"""
    kinetic: float
    """Energy at its start [J]."""


class ImplicitSteps(CollocationSteps):
    """Steps whose stages obey the joints, by Newton's method."""

    kind: Kind = "implicit"
    cost, bound, holds = 1.5, 3.0, 1.0

    def _prepare(self, size: int) -> None:
        model = self._model
        self._newton = newton_of(model, size, STAGES)
        self._outer = np.linalg.inv(self._table.points[:, None] ** np.arange(STAGES)).T
        stiff = model._replace(modal_root=model.modal_root.copy())
        self._turning = core.ImplicitTurning(model, stiff, self._work, self._newton)
        self._newton.rate[0] = 0.5

    def computed(self, state: np.ndarray, time: float, h: float, *, project: bool = False) -> Tried:
        table, newton, out = self._table, self._newton, np.empty_like(state)
        drives, amounts = self._given_at(time, h)
        times = table.eigenvalues / h
        course = Course(
            times, first=h * table.points, start=table.start, there=table.there, back=table.back,
            error_start=table.error_start, error=table.error / h, given=drives, amounts=amounts, weight=self._weights(),
            energy=self._balance.weight, fresh=self._before is None, tolerance=min(NEWTON * self._tolerance, CONVERGED),
            asked=self._tolerance, limits=RATIOS,
        )  # fmt: skip
        self._guess(h)
        error, residual, converged = self._turning.step(course, state, out)
        sound = bool(converged and np.isfinite(out).all() and np.isfinite(error) and residual <= LEFT)
        pivot = float(self._work.least[0])
        stages = Stages(newton.stages.copy(), newton.multipliers.copy(), float(newton.energy[0]))
        stages.increments[-1] = out - state
        return Tried(h, course, out, stages, error=error / self._tolerance, sound=sound, least=pivot)

    def _guess(self, h: float) -> None:
        """Set increments and multipliers of stages by the polynomials of the last step, continued."""
        if self._before is None:
            return
        points, before = self._table.points, self._before
        positions = 1 + points * (h / before.h)
        values = shares(self._table.polynomials, positions)[:, 1:]
        values[:, -1] -= 1.0
        self._newton.stages[:] = values @ before.slopes.increments
        self._newton.multipliers[:] = shares(self._outer, positions) @ before.slopes.multipliers

    def accept(self, tried: Tried) -> None:
        self._before = tried
        self._balance.note(tried.slopes.kinetic)

    def within(self, tried: Tried, state: np.ndarray) -> Within:
        polynomials, increments = self._table.polynomials, tried.slopes.increments

        def at(x: float) -> np.ndarray:
            return state + shares(polynomials, np.array([x]))[0, 1:] @ increments

        return at
