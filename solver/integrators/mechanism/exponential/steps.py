"""Steps of bodies without joints in which the vibrations of modes are exact."""

import numpy as np

from gudgeon.solver import core
from gudgeon.solver.integrators.mechanism.arrays import CURL, Model
from gudgeon.solver.integrators.mechanism.collocation.steps import STAGES, CollocationSteps
from gudgeon.solver.integrators.mechanism.collocation.table import shares
from gudgeon.solver.integrators.mechanism.exponential.arrays import Course, Inside, nodes_of, roots_of, waves_of
from gudgeon.solver.integrators.mechanism.steps import Kind, Tried, Within

SUBSTITUTION = 3e-3
"""Tolerance of the stages over that of a step."""
RATIOS = 0.5, 1e-4
"""Ratio of changes beyond which a shorter step is the better one, and the least that is believed."""
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
    used = np.arange(roots.shape[1]) < count[:, None]
    swing = np.imag(roots[used]) > SWINGS * np.abs(roots[used])
    uncoupled = np.abs(model.lever[:, CURL:]).max() <= COUPLED * np.sqrt(model.second.max())
    return bool(uncoupled and swing.all())


class ExponentialSteps(CollocationSteps):
    """Steps in which the slopes beside the vibrations are polynomials."""

    kind: Kind = "exponential"
    cost, bound, holds = 1.0, 0.5, 1.2

    def _prepare(self, size: int) -> None:
        self._nodes = nodes_of(self._table)
        self._waves = waves_of(self._model, size, STAGES)
        self._waves.rate[0] = 0.1
        self._h = 0.0
        self._turning = core.ExponentialTurning(self._model, self._work, self._waves)

    def computed(self, state: np.ndarray, time: float, h: float, *, project: bool = False) -> Tried:
        waves, out = self._waves, np.empty_like(state)
        drives, amounts = self._given_at(time, h)
        course = Course(
            self._nodes, h, drives, amounts, self._weights(), self._balance.weight, fresh=self._before is None,
            renew=h != self._h, tolerance=SUBSTITUTION * self._tolerance, limits=RATIOS,
        )  # fmt: skip
        if self._before is not None:
            positions = 1 + self._nodes.points * (h / self._before.h)
            waves.slopes[1:] = shares(self._table.polynomials, positions) @ self._before.slopes
        error, converged = self._turning.step(course, state, out)
        self._h = h
        sound = bool(converged and np.isfinite(out).all() and np.isfinite(error))
        return Tried(h, course, out, waves.slopes.copy(), error=error / self._tolerance, sound=sound, least=1.0)

    def accept(self, tried: Tried) -> None:
        self._before = tried
        self._balance.note(float(self._waves.energy[0]))

    def within(self, tried: Tried, state: np.ndarray) -> Within:
        def at(x: float) -> np.ndarray:
            out = np.empty_like(state)
            self._turning.state_within(Inside(self._nodes, tried.h, x), state, out)
            return out

        return at
