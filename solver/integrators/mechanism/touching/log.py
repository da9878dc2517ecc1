"""When journals touch and part: contact begins and ends with steps, and its impacts are kept.

Steps are smooth because a section presses either throughout a step or not at all: a step within which one touches or
parts is taken again, to that time. It is located on the interpolation of the step.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from gudgeon.modaldb.records.trajectory import (
    BEGINS,
    CLOSING,
    ENDS,
    IMPACT_COLUMNS,
    IMPULSE,
    OPENING,
    PEAK,
    PEAK_TIME,
    WINDOWED,
)
from gudgeon.solver.integrators.mechanism.arrays import SUMS, Model, Work
from gudgeon.solver.integrators.mechanism.step import observe
from gudgeon.solver.integrators.mechanism.touching.kernel import DEPTH, FORCE, RATE

LOOKS = 8
"""Times of a step at which sections are looked at, evenly spaced: so many times less may a contact last unnoticed."""
SHIFT = 1e-14
"""Indentation at which a contact begins, over the clearance."""

At = Callable[[float], np.ndarray]
"""State at a time of the last step [s]."""


class Event(NamedTuple):
    """A section touches or parts."""

    time: float
    """[s]"""
    section: int


class Touching:
    """Which sections press, and their impacts so far."""

    def __init__(self, model: Model, work: Work) -> None:
        self._model, self._work, c = model, work, len(model.touch_pair)
        self.impacts: list[list[np.ndarray]] = [[] for _ in range(c)]
        self._impulse = np.zeros(c)

    def __bool__(self) -> bool:
        return len(self._work.touching) > 0

    def begin(self, state: np.ndarray) -> None:
        """Let press what is indented at the start; its contact began at rest, without the loss of an impact."""
        for i in np.flatnonzero(self._looked(state)[:, DEPTH] > 0):
            self._close(int(i), 0.0, state, 0.0)

    def _looked(self, state: np.ndarray) -> np.ndarray:
        """Return what all sections do in a state, (c, 16)."""
        observe(self._model, self._work, state)
        return self._work.touch.copy()

    def first(self, at: At, before: float, after: float) -> Event | None:
        """Return what happens first between the times before and after a step [s]; None if nothing does.

        Peaks of forces within the step, up to then, are kept.
        """
        times = np.linspace(before, after, LOOKS + 1)
        found = np.array([self._looked(at(time)) for time in times])
        depths, pressing = found[:, :, DEPTH], self._work.touching.astype(bool)
        # A section that presses began this step indented, and one that does not began it free, up to round-off.
        inside = depths > 0
        inside[0] = pressing
        events = [
            Event(self._located(at, i, times[k : k + 2]), i)
            for i in range(len(pressing))
            if len(changes := np.flatnonzero(inside[1:, i] != inside[:-1, i]))
            for k in changes[:1]
        ]
        first = min(events, default=None)
        self._note_peaks(times, found, after if first is None else first.time)
        return first

    def _located(self, at: At, section: int, span: np.ndarray) -> float:
        """Return the time between two looks at which a section touches or parts [s]."""

        def depth(time: float) -> float:
            return float(self._looked(at(time))[section, DEPTH])

        ends = [depth(float(time)) for time in span]
        if ends[0] * ends[1] >= 0:  # Within round-off of its touching at the beginning of the step.
            return float(span[0])
        return float(brentq(depth, *span, xtol=1e-15 * max(abs(float(span[1])), 1e-300), rtol=8.9e-16))

    def _note_peaks(self, times: np.ndarray, found: np.ndarray, until: float) -> None:
        """Keep the largest forces up to a time, by parabolas through the looks beside the largest."""
        here = times <= until * (1 + 1e-15)
        for i in np.flatnonzero(self._work.touching):
            forces = found[here, i, FORCE]
            most = int(forces.argmax())
            value, when = float(forces[most]), float(times[most])
            if 0 < most < len(forces) - 1:
                left, right = value - float(forces[most - 1]), value - float(forces[most + 1])
                if left + right > 0:
                    shift = 0.5 * (left - right) / (left + right)
                    when += shift * float(times[1] - times[0])
                    value += 0.25 * (left - right) * shift
            impact = self.impacts[i][-1]
            if value > impact[PEAK]:
                impact[PEAK], impact[PEAK_TIME] = value, when

    def switch(self, event: Event, state: np.ndarray) -> None:
        """Let a section press from an event on, or no longer."""
        i = event.section
        found = self._looked(state)[i]
        if not self._work.touching[i]:
            self._close(i, event.time, state, float(found[RATE]))
            self._work.shift[i] = max(0.0, -float(found[DEPTH])) + SHIFT * self._model.touch_size[i, 0]
            return
        impact = self.impacts[i][-1]
        impact[ENDS], impact[OPENING] = event.time, -found[RATE]
        impact[IMPULSE] = self._pushed(i, state) - self._impulse[i]
        self._work.touching[i] = False

    def _close(self, i: int, time: float, state: np.ndarray, rate: float) -> None:
        impact = np.full(IMPACT_COLUMNS, np.nan)
        impact[[BEGINS, CLOSING, PEAK, PEAK_TIME, WINDOWED]] = time, rate, 0.0, time, 0.0
        self.impacts[i].append(impact)
        self._impulse[i] = self._pushed(i, state)
        self._work.touching[i], self._work.approach[i] = True, max(rate, 0.0)

    def _pushed(self, i: int, state: np.ndarray) -> float:
        """Return the integral of a section's force since the start [N s]."""
        return float(state[len(state) - SUMS - 2 * len(self.impacts) + 2 * i])

    def of_pair(self, pair: int, state: np.ndarray, time: float) -> np.ndarray:
        """Return the impacts of a joint up to a time, as `Trajectory.impacts`, (b, 9), those of its sections sorted.

        Args:
            state: At this time.
        """
        every = []
        for i in np.flatnonzero(self._model.touch_pair == pair):
            for impact in self.impacts[int(i)]:
                whole = impact.copy()
                if np.isnan(whole[ENDS]):  # It still presses.
                    whole[ENDS], whole[IMPULSE] = time, self._pushed(int(i), state) - self._impulse[i]
                every.append(whole)
        return np.array(sorted(every, key=lambda one: float(one[BEGINS]))).reshape(-1, IMPACT_COLUMNS)
