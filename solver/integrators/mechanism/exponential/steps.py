"""Steps of bodies without joints in which the vibrations of modes are exact."""

from collections.abc import Callable

import numpy as np

from gudgeon.solver.forces.fields.co_energy import LEFT as LEFT_GRID
from gudgeon.solver.integrators.mechanism.arrays import CURL, Model, Work
from gudgeon.solver.integrators.mechanism.exponential.arrays import Course, Inside, nodes_of, roots_of, waves_of
from gudgeon.solver.integrators.mechanism.exponential.step import exponential_step, state_within
from gudgeon.solver.integrators.mechanism.implicit.steps import Balance
from gudgeon.solver.integrators.mechanism.implicit.table import shares, table_of
from gudgeon.solver.integrators.mechanism.steps import Given, Kind, Prepared, Tried, Within

STAGES = 5
"""Of a step, behind its start: order 10."""
SUBSTITUTION = 3e-3
"""Tolerance of the stages over that of a step."""
SWINGS = 0.3
"""Frequency of a mode over that without damping, from which on it counts as one that vibrates."""
COUPLED = 1e-9
"""Angular momentum of rates of modes over the root of the largest moment of mass, up to which it is none."""


def propagates(model: Model) -> bool:
    """Return whether steps may take the vibrations of a mechanism's modes as exact: without joints, of bodies that
    deform whose modes are coupled by rotation alone and are damped below their critical damping."""
    roots, count = roots_of(model), model.elastic[:, 0]
    if len(model.row_terms) or not count.any():
        return False
    own = np.arange(roots.shape[1]) < count[:, None]
    swing = np.imag(roots[own]) > SWINGS * np.abs(roots[own])
    apart = np.abs(model.lever[:, CURL:]).max() <= COUPLED * np.sqrt(model.second.max())
    return bool(apart and swing.all())


class ExponentialSteps:
    """Steps of five stages, order 10."""

    kind: Kind = "exponential"
    power, cost, bound, holds = STAGES + 1, 1.0, 0.5, 1.2

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
        self._model, self._work, self._tolerance = model, work, tolerance
        self._given, self._weights = given, weights
        self._table = table_of(STAGES)
        self._nodes = nodes_of(self._table)
        self._waves = waves_of(model, work.stage.shape[0], STAGES)
        self._waves.rate[0] = 0.1
        self._balance, self._h = Balance(least), 0.0
        self._before: Tried | None = None
        self._step, self._state_within = Prepared(exponential_step), Prepared(state_within)

    def computed(self, state: np.ndarray, time: float, h: float, *, project: bool = False) -> Tried:
        waves, out = self._waves, np.empty_like(state)
        given, amounts = self._given(time + h * np.append(0.0, self._nodes.points))
        course = Course(
            self._nodes, h, given, amounts, self._weights(), self._balance.weight, fresh=self._before is None,
            renew=h != self._h, tolerance=SUBSTITUTION * self._tolerance,
        )  # fmt: skip
        if self._before is not None:
            places = 1 + self._nodes.points * (h / self._before.h)
            waves.slopes[1:] = shares(self._table.polynomials, places) @ self._before.slopes
        self._work.least[0] = 1.0
        self._work.field[:, LEFT_GRID] = 0.0
        error, converged = self._step(self._model, self._work, waves, course, state, out)
        self._h = h
        sound = bool(converged and np.isfinite(out).all() and np.isfinite(error))
        return Tried(h, course, out, waves.slopes.copy(), error=error / self._tolerance, sound=sound, least=1.0)

    def restart(self, state: np.ndarray, time: float) -> None:
        self._before = None

    def accept(self, one: Tried) -> None:
        self._before = one
        self._balance.note(float(self._waves.energy[0]))

    def within(self, one: Tried, state: np.ndarray) -> Within:
        def at(x: float) -> np.ndarray:
            out = np.empty_like(state)
            self._state_within(self._model, self._waves, Inside(self._nodes, one.h, x), state, out)
            return out

        return at
