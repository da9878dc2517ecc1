"""How steps of a mechanism are computed: by an explicit method here, by collocation in `collocation`."""

from collections.abc import Callable
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np

from gudgeon.solver import core
from gudgeon.solver.integrators.mechanism.arrays import Model, Work
from gudgeon.solver.integrators.mechanism.step import MAIN, ORDER, Call, Course, tableau

LEFT = 1e-8
"""Last motion of Newton's method over the size of the scene; a step with more is repeated shorter."""
Given = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Drives (t, d, 3) and loads (t, l) at times [s], (t,)."""
Kind = Literal["explicit", "implicit", "exponential"]
Within = Callable[[float], np.ndarray]
"""State at a time within a step, over the step."""


class Tried(NamedTuple):
    """A step that was computed."""

    h: float
    """[s]"""
    course: Any
    state: np.ndarray
    slopes: Any
    """What its method goes on with."""
    error: float
    """Over what is asked for."""
    sound: bool
    """Whether Newton's method converged and all is finite."""
    least: float
    """Pivot."""

    @property
    def good(self) -> bool:
        return self.sound and self.error <= 1


class Steps(Protocol):
    """A method of steps."""

    power: int
    """Of the step in its estimated error."""
    kind: Kind
    cost: float
    """CPU time of a step over that of an explicit one."""
    bound: float
    """Size of explicit steps times the highest frequency of a body, from which on these are tried."""
    holds: float
    """Growth below which the next step keeps the size of the last one, where another size costs."""

    def computed(self, state: np.ndarray, time: float, h: float, *, project: bool = False) -> Tried:
        """Return a step from a state at a time [s], from which steps may begin.

        Args:
            project: Whether stages are projected on the joints.
        """
        ...

    def restart(self, state: np.ndarray, time: float) -> None:
        """Let steps begin from a state: the first one, or one that an event changed."""

    def accept(self, tried: Tried) -> None:
        """Let steps begin from the end of one."""

    def within(self, tried: Tried, state: np.ndarray) -> Within:
        """Return the interpolation of the step that was computed last, from a state; its end is that of the step."""
        ...


class ExplicitSteps:
    """Steps of Dormand and Prince's method of order 8."""

    kind: Kind = "explicit"
    power, cost, bound, holds = ORDER, 1.0, 0.0, 1.0

    def __init__(
        self, model: Model, work: Work, tolerance: float, drives: Given, weights: Callable[[], np.ndarray]
    ) -> None:
        """
        Args:
            tolerance: Error of a step.
            weights: What the error of each number is multiplied by, now, (13 n + SUMS,).
        """
        self._work, self._tolerance = work, tolerance
        self._given, self._weights = drives, weights
        self._table, self._times = tableau()
        self._course = Course(
            self._table, *drives(np.zeros_like(self._times)), np.empty(work.slopes.shape[1]), project=False
        )
        self._constant = not (self._course.given.size or self._course.amounts.size)
        self._turning = core.Turning(model, work)
        self._explicit = core.ExplicitTurning(model, work, self._course)

    def computed(self, state: np.ndarray, time: float, h: float, *, project: bool = False) -> Tried:
        self._set_given(time, h)
        self._course.weight[:] = self._weights()
        out = np.empty_like(state)
        error, residual, finite, pivot = self._explicit.step(state, h, out, project)
        call, slopes = Call(time, project), self._work.slopes.copy()
        return Tried(h, call, out, slopes, error / self._tolerance, sound=finite and residual <= LEFT, least=pivot)

    def _set_given(self, time: float, h: float) -> None:
        """Set drives and loads at the times of the stages of a step from a time on [s]."""
        if not self._constant:
            self._course.given[:], self._course.amounts[:] = self._given(time + h * self._times)

    def restart(self, state: np.ndarray, time: float) -> None:
        drives, amounts = self._given(np.array([time]))
        self._turning.begin(state, drives[0], amounts[0])

    def accept(self, tried: Tried) -> None:
        self._work.slopes[0] = tried.slopes[MAIN]

    def within(self, tried: Tried, state: np.ndarray) -> Within:
        h, K = tried.h, self._work.slopes
        K[:] = tried.slopes
        self._set_given(tried.course.time, h)
        self._explicit.interpolation(state, h, tried.course.project)
        change = tried.state - state
        dense = np.empty((7, len(state)))
        dense[0] = change
        dense[1] = h * K[0] - change
        dense[2] = 2 * change - h * (K[MAIN] + K[0])
        dense[3:] = h * (self._table.dense @ K)

        def at(x: float) -> np.ndarray:
            value = np.zeros_like(state)
            for k in range(7):
                value = (value + dense[6 - k]) * (x if k % 2 == 0 else 1 - x)
            return value + state

        return at
