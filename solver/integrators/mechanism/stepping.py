"""The steps of a mechanism: their size by the estimated error, and how they pass singular positions."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gudgeon.solver.compiled import machine_code
from gudgeon.solver.forces.fields.co_energy import LEFT as LEFT_GRID
from gudgeon.solver.integrators.mechanism.arrays import Model, Work
from gudgeon.solver.integrators.mechanism.step import ORDER, Course, step

LEFT = 1e-8
"""Last motion of Newton's method over the size of the scene; a step with more is repeated shorter."""
SHORTEST = 1e-9
"""Least step over the duration."""
PARTING = 1e-13
"""The same while a section presses: its force has a kink where it ends."""
FIRST = 1e-4
"""First step over the duration."""
SAFETY, LEAST, MOST = 0.9, 0.2, 5.0
"""Of the next step over what the error asks for; least and largest ratio of two steps."""
NEAR = 1e-2
"""Pivot, the square of the sine of an angle between rows, below which stages are projected, too."""
SMOOTH = 0.4 / ORDER
"""Power of the last step's error in the size of the next one (Hairer, Nørsett, Wanner, Solving ODE I, II.4): where
frequencies bound steps, errors grow fast beyond the bound, and without it every other step is refused."""
LEAST_ERROR = 1e-4
"""Of the last step, in that power."""
MARGIN = 0.1
"""Error of a step without projected stages up to which it is taken below this pivot, over what is asked for elsewhere:
the estimate may be too small by two orders."""
SINGULAR = 1e-3
"""Pivot at a stage, over the largest one of earlier steps, below which a step that is refused is first tried with other
sizes. A light body between heavy ones has small pivots everywhere, and no singular position."""
PATIENCE = 8
"""Refused steps before this while a section presses: a contact that begins is more often the reason."""
ROOM = 300.0
"""Error over what is asked for of a step that passes a singular position, where none is good: 0.3 of run.accuracy."""
LEAPS = (1.0, 0.8, 1.25, 0.63, 1.6, 0.5, 0.37, 2.0, 0.27)
"""These sizes, over that of the last step elsewhere: stages that are not so near to the singular position serve."""


class Tried(NamedTuple):
    """A step that was computed."""

    h: float
    """[s]"""
    course: Course
    state: np.ndarray
    slopes: np.ndarray
    error: float
    """Over what is asked for."""
    sound: bool
    """Whether Newton's method converged and all is finite."""
    least: float
    """Pivot."""

    @property
    def good(self) -> bool:
        return self.sound and self.error <= 1


class Stepping:
    """Chooses steps."""

    def __init__(
        self, model: Model, work: Work, tolerance: float, duration: float, *, fixed: float | None = None
    ) -> None:
        """Begin with a small step, or take steps of one size.

        Args:
            tolerance: Error of a step.
            duration: Of the run [s].
            fixed: Size of all steps [s].
        """
        self._model, self._work, self._tolerance = model, work, tolerance
        self._duration, self._fixed = duration, fixed
        self._next = FIRST * duration if fixed is None else fixed
        self._regular = self._next
        self._former, self._usual = LEAST_ERROR, 0.0
        self._step: Callable[..., tuple[float, float]] | None = None
        self.taken, self.rejected, self.singular = 0, 0, 0
        """Steps that were taken, refused, and of the former those near a singular position."""

    def take(self, state: np.ndarray, time: float, course: Callable[[float], Course]) -> Tried | None:
        """Return the next step from a state, whose slope is the first of `slopes`; None where none is short enough.

        Args:
            time: [s]
            course: Returns what a step of a size is taken with.
        """
        rest, leapt, tries = self._duration - time, False, 0
        while True:
            one = self._tried(state, self._fitted(self._next, rest), course)
            if self._fixed is not None:
                self._count(one)
                return one if one.sound else None
            stuck = tries >= (PATIENCE if self._work.touching.any() else 0)
            if not one.good and self._singular(one) and stuck and not leapt:
                leapt = True
                one = self._leapt(state, rest, course) or one
            if one.good or (leapt and one.sound and one.error <= ROOM):
                break
            self.rejected, tries = self.rejected + 1, tries + 1
            shrink = SAFETY * one.error ** (-1 / ORDER) if one.sound else LEAST
            self._next = one.h * max(LEAST, min(shrink, SAFETY))
            if self._next < self._shortest:
                return None
        self._next = one.h * min(1.0 if tries else MOST, self._growth(one.error))
        if self._singular(one) and self._next < self._shortest:
            return None  # Ever shorter steps towards a position that it cannot pass.
        if not self._singular(one):
            self._regular = one.h if not one.least < NEAR else max(self._regular, one.h)
        self._count(one)
        self._usual = max(self._usual, one.least)
        self._work.slopes[:] = one.slopes
        return one

    def _singular(self, one: Tried) -> bool:
        """Return whether a step is near a position in which joints depend on each other more than elsewhere."""
        return one.least < SINGULAR * self._usual

    def _growth(self, error: float) -> float:
        """Return the ratio of the next step to one that is taken, by its error and that of the last one before."""
        if error == 0:
            return MOST
        found = SAFETY * error ** (-(1 / ORDER - 0.2 * SMOOTH)) * self._former**SMOOTH
        self._former = max(error, LEAST_ERROR)
        return min(MOST, found)

    def _count(self, one: Tried) -> None:
        """Count a step that is taken."""
        self.taken += 1
        self.singular += self._singular(one)

    @property
    def _shortest(self) -> float:
        """Least step [s]."""
        return (PARTING if self._work.touching.any() else SHORTEST) * self._duration

    def again(self, state: np.ndarray, h: float, course: Course) -> Tried:
        """Return a step of a given size from a state, whose slope is the first of `slopes`: a part of the one taken,
        whose size stays that of the next one."""
        return self._computed(state, h, course)

    def _leapt(self, state: np.ndarray, rest: float, course: Callable[[float], Course]) -> Tried | None:
        """Return the first good step over a singular position, or else the one of least error; None without one."""
        best = None
        for ratio in LEAPS:
            one = self._tried(state, self._fitted(ratio * self._regular, rest), course)
            if one.sound and (best is None or one.error < best.error):
                best = one
            if one.good:
                return one
        return best if best is not None and best.error <= ROOM else None

    @staticmethod
    def _fitted(h: float, rest: float) -> float:
        """Return a step that ends with the run where it would end just before or beyond [s]."""
        return rest if rest < 1.001 * h else h

    def _tried(self, state: np.ndarray, h: float, course: Callable[[float], Course]) -> Tried:
        """Compute a step.

        Near a position in which joints depend on each other, errors of the stages across the constraints grow in the
        accelerations, which the estimated error need not show, so that they are projected; very near to it the
        round-off of their projection grows, too, and a step without it may be the better one.
        """
        plain = self._computed(state, h, course(h))
        if not plain.least < NEAR:
            return plain
        if not self._singular(plain):
            plain = plain._replace(error=plain.error / MARGIN)
        projecting = course(h)
        projecting.project[0] = True
        other = self._computed(state, h, projecting)
        if other.good or not plain.sound:
            return other
        return plain if plain.good or not other.sound or plain.error < other.error else other

    def _computed(self, state: np.ndarray, h: float, course: Course) -> Tried:
        out = np.empty_like(state)
        self._work.least[0] = 1.0
        self._work.field[:, LEFT_GRID] = 0.0
        given = self._model, self._work, course, state, h, out
        if self._step is None:
            self._step = machine_code(step, *given)
        error, left = self._step(*given)
        sound = bool(np.isfinite(out).all() and np.isfinite(error) and left <= LEFT)
        return Tried(
            h,
            course,
            out,
            self._work.slopes.copy(),
            error=error / self._tolerance,
            sound=sound,
            least=float(self._work.least[0]),
        )
