"""The steps of a mechanism: their size by the estimated error, and how they pass singular positions."""

import math
from bisect import bisect_left
from collections.abc import Callable, Iterable

import numpy as np

from gudgeon.solver.forces.breaks import breaks_of, kinks_of, within
from gudgeon.solver.integrators.mechanism.arrays import Work
from gudgeon.solver.integrators.mechanism.steps import Steps, Tried

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
SMOOTH = 0.4
"""Power of the last step's error in the size of the next one, times that of the step in the error (Hairer, Nørsett,
Wanner, Solving ODE I, II.4): where frequencies bound steps, errors grow fast beyond the bound, and without it every
other step is refused."""
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


Given = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Drives (t, d, 3) and loads (t, l) at times [s], (t,)."""


def breaks_in(drives: Given, tables: Iterable[tuple[tuple[float, float], ...]], duration: float) -> np.ndarray:
    """Return the times of a run at which steps end and the next begin, (b, 2) [s]: for its drives and loads, and at the
    kinks of the tables of loads."""

    def read(times: np.ndarray) -> np.ndarray:
        return np.hstack([a.reshape(len(times), -1) for a in drives(times)])

    if not read(np.zeros(1)).size:
        return np.empty((0, 2))
    return within([breaks_of(read, duration, trains=False), *(kinks_of(t, duration) for t in tables)], duration)


class Stepping:
    """Chooses steps."""

    def __init__(
        self, steps: Steps, work: Work, duration: float, breaks: np.ndarray, *, fixed: float | None = None
    ) -> None:
        """Begin with a small step, or take steps of one size.

        Args:
            duration: Of the run [s].
            breaks: Times within it at which steps end, and where the next ones begin, ascending [s], (b, 2).
            fixed: Size of all other steps [s].
        """
        self.steps, self._work = steps, work
        self._duration, self._fixed = duration, fixed
        ends, begins = np.vstack([breaks, [duration, duration]]).T
        self._ends, self._begins = ends.tolist(), begins.tolist()
        self._next = FIRST * duration if fixed is None else fixed
        self._regular = self._next
        self._former, self._usual = LEAST_ERROR, 0.0
        self.longest = np.inf
        """Longest step that rotations can be continued over [s]; fixed ones may be longer."""
        self.taken, self.rejected = 0, 0
        """Steps that were taken, and refused."""

    def take(self, state: np.ndarray, time: float) -> Tried | None:
        """Return the next step from a state at a time [s]; None where none is short enough."""
        remaining = self._rest(time)
        if self._fixed is not None:
            step = self._tried(state, time, self._fitted(self._next, remaining))
            self.taken += 1
            return step if step.sound else None
        if self.longest < self._shortest:
            return None
        target = self._next = min(self._next, self.longest)
        step, tries = self._accepted(state, time, remaining)
        if step is None:
            return None
        self._next = step.h * min(1.0 if tries else MOST, self._growth(step.error))
        if not tries and step.h < target:  # It was cut short, and says little about a longer one.
            self._next = max(self._next, target)
        if self.near_singular(step) and self._next < self._shortest:
            return None  # Ever shorter steps towards a position that it cannot pass.
        if not self.near_singular(step):
            self._regular = step.h if not step.least < NEAR else max(self._regular, step.h)
        self.taken += 1
        self._usual = max(self._usual, step.least)
        return step

    def _accepted(self, state: np.ndarray, time: float, remaining: float) -> tuple[Tried | None, int]:
        """Return the first step whose error is small enough, None where it would be too short, and how many failed."""
        leapt, tries = False, 0
        while True:
            step = self._tried(state, time, self._fitted(self._next, remaining))
            stuck = tries >= (PATIENCE if self._presses() else 0)
            if not step.good and self.near_singular(step) and stuck and not leapt:
                leapt = True
                step = self._leapt(state, time, remaining) or step
            if step.good or (leapt and step.sound and step.error <= ROOM):
                return step, tries
            self.rejected, tries = self.rejected + 1, tries + 1
            shrink = SAFETY * step.error ** (-1 / self.steps.power) if step.sound else LEAST
            self._next = step.h * max(LEAST, min(shrink, SAFETY))
            if self._next < self._shortest:
                return None, tries

    def reason(self, time: float) -> str:
        """Return why no step could be taken at a time [s], where there is more to say than that none is short
        enough."""
        if self._fixed is not None:
            return f"at {time:.6g} s no step of {self._fixed:g} s can be taken; reduce run.step, or leave it out"
        if self.longest < self._shortest:
            return (
                f"at {time:.6g} s a body turns so fast that it is followed only by steps of {self.longest:.2g} s;"
                " check drives and loads, or shorten run.duration"
            )
        return ""

    def near_singular(self, tried: Tried) -> bool:
        """Return whether a step is near a position in which joints depend on each other more than elsewhere, in the
        metric of the inertia, in which they are solved."""
        return tried.least < SINGULAR * self._usual

    def _growth(self, error: float) -> float:
        """Return the ratio of the next step to one that is taken, by its error and that of the last one before."""
        if error == 0:
            return MOST
        smooth = SMOOTH / self.steps.power
        ratio = SAFETY * error ** (-(1 / self.steps.power - 0.2 * smooth)) * self._former**smooth
        self._former = max(error, LEAST_ERROR)
        return 1.0 if 1.0 <= ratio < self.steps.holds else min(MOST, ratio)

    def _rest(self, time: float) -> float:
        """Return how long a step may be at most from a time on [s]: to the next break, or the end of the run."""
        i = bisect_left(self._ends, time + SHORTEST * self._duration)
        return float(self._ends[min(i, len(self._ends) - 1)]) - time

    def end(self, time: float) -> tuple[float, bool]:
        """Return when the next step begins after one that ends at a time [s], and whether something jumps between."""
        tolerance = SHORTEST * SHORTEST * self._duration + 4 * math.ulp(time)
        i = bisect_left(self._ends, time - tolerance)
        if i == len(self._ends) or self._ends[i] > time + tolerance:
            return time, False
        return self._begins[i], self._begins[i] > self._ends[i]

    @property
    def _shortest(self) -> float:
        """Least step [s]."""
        return (PARTING if self._presses() else SHORTEST) * self._duration

    def _presses(self) -> bool:
        """Return whether any section presses."""
        return len(self._work.touching) > 0 and bool(self._work.touching.any())

    def _leapt(self, state: np.ndarray, time: float, remaining: float) -> Tried | None:
        """Return the first good step over a singular position, or else the one of least error; None without one."""
        best = None
        for ratio in LEAPS:
            tried = self._tried(state, time, self._fitted(ratio * self._regular, remaining))
            if tried.sound and (best is None or tried.error < best.error):
                best = tried
            if tried.good:
                return tried
        return best if best is not None and best.error <= ROOM else None

    @staticmethod
    def _fitted(h: float, remaining: float) -> float:
        """Return a step that ends where steps have to, where it would end just before or beyond [s]."""
        return remaining if remaining < 1.001 * h else h

    def _tried(self, state: np.ndarray, time: float, h: float) -> Tried:
        """Compute a step.

        Near a position in which joints depend on each other, errors of the stages across the constraints grow in the
        accelerations, which the estimated error need not show, so that they are projected; very near to it the
        round-off of their projection grows, too, and a step without it may be the better one.
        """
        plain = self.steps.computed(state, time, h)
        if self.steps.kind != "explicit" or not plain.least < NEAR:  # Implicit stages obey the joints as they are.
            return plain
        if not self.near_singular(plain):
            plain = plain._replace(error=plain.error / MARGIN)
        projected = self.steps.computed(state, time, h, project=True)
        if projected.good or not plain.sound:
            return projected
        return plain if plain.good or not projected.sound or plain.error < projected.error else projected
