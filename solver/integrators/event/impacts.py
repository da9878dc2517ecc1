"""Impacts of one contact whose force is known as a function of time."""

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
    """Impacts of one contact of several rows; separations shorter than the window [s] do not end one."""

    def __init__(self, window: float) -> None:
        self._window = window
        self._found: list[np.ndarray] = []
        self._entry: np.ndarray | None = None
        self._touching: set[int] = set()
        self._slack: set[int] = set()
        self._begin()

    def _begin(self) -> None:
        # J, the impulse since the start of the impact, and its rate at points of time.
        self._times, self._impulses, self._forces = np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3))
        self._blocks: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        self._total, self._waiting, self._entered, self._left = np.zeros(3), 0, 0, 0
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
        if self._entry is not None and not self._touching and time - self._entry[ENDS] >= self._window:
            self._finish(time)
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
            self._evaluate(float(times[-1]))

    def note_peak(self, force: float, time: float) -> None:
        """Update the largest force [N]."""
        if self._entry is not None and force > self._entry[PEAK]:
            self._entry[PEAK], self._entry[PEAK_TIME] = force, time

    def impacts(self, now: float) -> np.ndarray:
        """Return all impacts as in `Trajectory.impacts`, (b, 9), and end the present one at a time [s]."""
        if self._entry is not None:
            if self._touching - self._slack:
                self._entry[ENDS], self._entry[OPENING] = max(self._entry[ENDS], now), np.nan
            self._finish(now)
        return np.array(self._found).reshape(-1, IMPACT_COLUMNS)

    def _finish(self, now: float) -> None:
        entry = self._entry
        assert entry is not None
        entry[IMPULSE] = np.sqrt(self._total @ self._total)
        if self._window > 0:
            last = min(now, float(entry[ENDS]) + self._window)
            self.presses(np.full(1, max(last, self._now)), np.zeros((1, 3)), np.zeros((1, 3)))
            self._evaluate(self._now)
            entry[WINDOWED] = self._largest / self._window
            entry[WINDOWED_TIME] = 0.5 * (self._since + self._until - self._window)
        else:
            entry[WINDOWED], entry[WINDOWED_TIME] = entry[PEAK], entry[PEAK_TIME]
        self._found.append(entry)
        self._entry = None
        self._begin()

    def _evaluate(self, now: float) -> None:
        """Evaluate |J(t) − J(t − W)| where t or t − W is a point of the course, up to a time [s]."""
        blocks = [(self._times, self._impulses, self._forces), *self._blocks]
        self._times, self._impulses, self._forces = map(np.concatenate, zip(*blocks, strict=True))
        self._blocks, self._waiting = [], 0
        times, window = self._times, self._window
        if not len(times):
            return
        out = int(np.searchsorted(times, now - window, side="right"))
        entering, leaving = slice(self._entered, None), slice(self._left, max(self._left, out))
        ends = np.concatenate([times[entering], times[leaving] + window])
        changes = np.concatenate(
            [
                self._impulses[entering] - self._impulse(times[entering] - window),
                self._impulse(times[leaving] + window) - self._impulses[leaving],
            ]
        )
        self._note(ends, np.linalg.norm(changes, axis=1))
        drop = max(leaving.stop - 1, 0)
        self._times, self._impulses, self._forces = times[drop:], self._impulses[drop:], self._forces[drop:]
        self._entered, self._left = len(times) - drop, leaving.stop - drop

    def _note(self, ends: np.ndarray, sizes: np.ndarray) -> None:
        """Update the largest change of J over a window [N s] and its time, from changes over windows with ends [s]."""
        order = np.argsort(ends, kind="stable")
        ends, sizes = ends[order], sizes[order]
        if not len(ends):
            return
        at = int(sizes.argmax())
        if 0 < at < len(ends) - 1 and ends[at - 1] < ends[at] < ends[at + 1]:
            between = _vertex(ends[at - 1 : at + 2], sizes[at - 1 : at + 2])
            change = self._impulse(np.array([between])) - self._impulse(np.array([between - self._window]))
            if (size := float(np.linalg.norm(change))) > sizes[at]:
                ends[at], sizes[at] = between, size
        if sizes[at] > self._largest * (1 + PLATEAU):
            self._largest = float(sizes[at])
            self._since = self._until = float(ends[np.argmax(sizes >= self._largest * (1 - PLATEAU))])
        equal = ends[(sizes >= self._largest * (1 - PLATEAU)) & (ends <= self._since + self._window)]
        self._until = max(self._until, float(equal.max(initial=self._until)))

    def _impulse(self, at: np.ndarray) -> np.ndarray:
        """Return J at times [s], (t, 3), by cubics through its values and rates."""
        times, J, F = self._times, self._impulses, self._forces
        if len(times) == 1:
            return np.repeat(J, len(at), axis=0)
        i = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
        h = times[i + 1] - times[i]
        with np.errstate(invalid="ignore", divide="ignore"):
            x = np.where(h > 0, (at - times[i]) / h, np.where(at < times[i], 0.0, 1.0))
        x, h = np.clip(x, 0.0, 1.0)[:, None], h[:, None]
        rest = 1 - x
        values = rest**2 * ((1 + 2 * x) * J[i] + x * h * F[i])
        return values + x**2 * ((3 - 2 * x) * J[i + 1] - rest * h * F[i + 1])


def _vertex(x: np.ndarray, y: np.ndarray) -> float:
    """Return the place of the extremum of the parabola through three points."""
    low, high = (y[1] - y[0]) / (x[1] - x[0]), (y[2] - y[1]) / (x[2] - x[1])
    bend = (high - low) / (x[2] - x[0])
    return float(np.clip(0.5 * (x[0] + x[1]) - 0.5 * low / bend, x[0], x[2])) if bend < 0 else float(x[1])
