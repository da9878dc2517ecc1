"""Impacts of one contact whose force is known as a function of time."""

from typing import NamedTuple

import numpy as np

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
    WINDOWED_TIME,
)
from gudgeon.solver.integrators.outcome import PLATEAU

BATCH = 8192
"""Points of the impulse's course from which the windowed force is evaluated, and points before the window dropped."""


class ContactImpacts:
    """Impacts of one contact of several rows; those separated by less than a time [s] are one."""

    def __init__(self, separation: float, window: float) -> None:
        self._separation, self._window = separation, window
        self._found: list[np.ndarray] = []
        self._entry: np.ndarray | None = None
        self._touching: set[int] = set()
        self._slack: set[int] = set()
        self._begin()

    def _begin(self) -> None:
        # J, the impulse since the start of the impact, and its rate at points of time.
        self._times, self._impulses, self._forces = np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3))
        self._blocks: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        self._total, self._waiting, self._evaluated = np.zeros(3), 0, -np.inf
        self._largest, self._since, self._until, self._now = 0.0, 0.0, 0.0, -np.inf

    @property
    def touching(self) -> set[int]:
        """Rows of the present impact that have not parted."""
        return self._touching

    @property
    def peak(self) -> float:
        """Largest force of the present impact [N]."""
        return 0.0 if self._entry is None else float(self._entry[PEAK])

    def touches(self, row: int, time: float, closing: float) -> None:
        """Let a row touch at a time [s] and a closing speed [m/s], unless it does already."""
        if row in self._touching:
            return
        if self._entry is not None and not self._touching and time - self._entry[ENDS] >= self._separation:
            self._finish()
        if self._entry is None:
            self._entry = np.zeros(IMPACT_COLUMNS)
            self._entry[[BEGINS, ENDS, PEAK_TIME]], self._entry[CLOSING] = time, closing
        self._touching.add(row)

    def leaves(self, row: int, time: float, opening: float) -> None:
        """Set the time [s] at which the force of a row became zero, and its opening speed [m/s] then."""
        if self._entry is not None and row in self._touching:
            self._entry[ENDS], self._entry[OPENING] = time, opening
            self._slack.add(row)

    def returns(self, row: int) -> None:
        """Let a row press again that has not recovered."""
        self._slack.discard(row)

    def parts(self, row: int) -> None:
        """Let a row part whose force is zero."""
        self._touching.discard(row)
        self._slack.discard(row)

    def jumps(self, time: float, impulse: np.ndarray) -> None:
        """Add an impulse without duration [N s], (3,); the first one begins a contact that touched without force."""
        if self._entry is not None and not self._total.any():
            self._entry[BEGINS] = time
        self.presses(np.full(2, time), np.array([np.zeros(3), impulse]), np.zeros((2, 3)))

    def presses(self, times: np.ndarray, impulses: np.ndarray, forces: np.ndarray) -> None:
        """Add the course of the force: impulses since the first of some times [N s] and forces [N], (t, 3) each."""
        if self._entry is None:
            return
        impulses = self._total + impulses
        if self._window > 0:
            if -np.inf < self._now < times[0]:
                self._blocks.append((np.array([self._now, times[0]]), impulses[[0, 0]], np.zeros((2, 3))))
            self._blocks.append((times, impulses, forces))
            self._waiting += len(times)
            self._now = float(times[-1])
        self._total = impulses[-1]
        if self._waiting > BATCH:
            self._evaluate(float(times[-1]) - self._window)

    def note_peak(self, force: float, time: float) -> None:
        """Update the largest force [N]."""
        if self._entry is not None and force > self._entry[PEAK]:
            self._entry[PEAK], self._entry[PEAK_TIME] = force, time

    def impacts(self, time: float) -> np.ndarray:
        """Return all impacts as in `Trajectory.impacts`, (b, 9), and end the present one at a time [s]."""
        if self._entry is not None:
            if self._touching - self._slack:
                self._entry[ENDS], self._entry[OPENING] = max(self._entry[ENDS], time), np.nan
            self._finish()
        return np.array(self._found).reshape(-1, IMPACT_COLUMNS)

    def _finish(self) -> None:
        entry = self._entry
        assert entry is not None
        entry[IMPULSE] = np.sqrt(self._total @ self._total)
        if self._window > 0:
            self._evaluate(float(entry[ENDS]))
            entry[WINDOWED] = self._largest
            entry[WINDOWED_TIME] = 0.5 * (self._since + self._until)
        else:
            entry[WINDOWED], entry[WINDOWED_TIME] = entry[PEAK], entry[PEAK_TIME]
        self._found.append(entry)
        self._entry = None
        self._begin()

    def _evaluate(self, until: float) -> None:
        """Evaluate the windowed force at the points of the course and between them, up to a time [s]."""
        blocks = [(self._times, self._impulses, self._forces), *self._blocks]
        self._times, self._impulses, self._forces = map(np.concatenate, zip(*blocks, strict=True))
        self._blocks, self._waiting = [], 0
        if not len(self._times):
            return
        times, J, F = self._times, self._impulses, self._forces
        # A linear function taken off I, and its slope off J, does not change the windowed force.
        J, h = J - J[0], np.diff(times)[:, None]
        I = np.zeros_like(J)
        np.cumsum(h * (0.5 * (J[1:] + J[:-1]) + h * (F[:-1] - F[1:]) / 12), axis=0, out=I[1:])
        middles = np.concatenate([times, 0.5 * (times[1:] + times[:-1])])
        middles = np.sort(middles[(middles > self._evaluated) & (middles <= until)])
        self._note(middles, Course(times, I, J, F))
        self._evaluated = max(self._evaluated, until)
        drop = max(int(np.searchsorted(times, until - self._window, side="right")) - 1, 0)
        self._times, self._impulses, self._forces = (a[drop:] for a in (self._times, self._impulses, self._forces))

    def _note(self, middles: np.ndarray, course: "Course") -> None:
        """Update the largest windowed force [N] and its time from some times in order [s]."""
        if not len(middles):
            return
        sizes = course.windowed(middles, self._window)
        peak = int(sizes.argmax())
        if 0 < peak < len(middles) - 1 and middles[peak - 1] < middles[peak] < middles[peak + 1]:
            between = _vertex(middles[peak - 1 : peak + 2], sizes[peak - 1 : peak + 2])
            if (size := float(course.windowed(np.array([between]), self._window)[0])) > sizes[peak]:
                middles[peak], sizes[peak] = between, size
        if sizes[peak] > self._largest * (1 + PLATEAU):
            self._largest = float(sizes[peak])
            self._since = self._until = float(middles[np.argmax(sizes >= self._largest * (1 - PLATEAU))])
        equal = middles[(sizes >= self._largest * (1 - PLATEAU)) & (middles <= self._since + self._window)]
        self._until = max(self._until, float(equal.max(initial=self._until)))


class Course(NamedTuple):
    """The integral I of the impulse J at points of time, J itself and its rate F [N s², N s, N], (t, 3) each."""

    times: np.ndarray
    I: np.ndarray
    J: np.ndarray
    F: np.ndarray

    def windowed(self, at: np.ndarray, window: float) -> np.ndarray:
        """Return the mean over W of the mean over W of the force at times [N], (t,)."""
        change = self.integral(at + window) - 2 * self.integral(at) + self.integral(at - window)
        return np.linalg.norm(change, axis=1) / window**2

    def integral(self, at: np.ndarray) -> np.ndarray:
        """Return I at times [s], (t, 3), by cubics of J through its values and rates; J is constant outside."""
        times, I, J, F = self
        beyond = np.maximum(at - times[-1], 0.0)[:, None] * J[-1]
        if len(times) == 1:
            return I[0] + beyond
        i = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
        h = times[i + 1] - times[i]
        with np.errstate(invalid="ignore", divide="ignore"):
            x = np.where(h > 0, (at - times[i]) / h, np.where(at < times[i], 0.0, 1.0))
        x, h = np.clip(x, 0.0, 1.0)[:, None], h[:, None]
        cube, fourth = x**3, x**4
        inside = J[i] * (x - cube + fourth / 2) + J[i + 1] * (cube - fourth / 2)
        rates = F[i] * (x**2 / 2 - 2 * cube / 3 + fourth / 4) + F[i + 1] * (fourth / 4 - cube / 3)
        return I[i] + h * (inside + h * rates) + beyond


def _vertex(x: np.ndarray, y: np.ndarray) -> float:
    """Return the place of the extremum of the parabola through three points."""
    low, high = (y[1] - y[0]) / (x[1] - x[0]), (y[2] - y[1]) / (x[2] - x[1])
    bend = (high - low) / (x[2] - x[0])
    return float(np.clip(0.5 * (x[0] + x[1]) - 0.5 * low / bend, x[0], x[2])) if bend < 0 else float(x[1])
