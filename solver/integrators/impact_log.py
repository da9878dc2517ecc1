"""Impacts of contacts, located step by step in the compiled time loops, and the same from a history of forces.

A force is constant over a step, so the impulse J of a contact since the start of its impact is linear in it. The mean
force over a window W that ends at t is |J(t) − J(t − W)| / W, largest where t or t − W is the end of a step. An impact
ends when no force has acted for W: separations shorter than W are part of it.
"""

import math
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
from gudgeon.solver.compiled import entry, inner
from gudgeon.solver.errors import SolverError
from gudgeon.solver.integrators.outcome import PLATEAU

MOST_STEPS = 1_000_000
"""Largest number of steps in a window, which are kept at once."""
CAPACITY = 65_536
"""Impacts of all contacts that may end within a frame; more end the run."""
FIRST, LAST, TOUCHING, ROW = range(4)
"""Entries of `ImpactLog.steps`: number of the first step of the present impact, −1 where there is none; number of its
last step with a force; whether its force acts; contact row with the largest force when it did last."""
LARGEST, SINCE, UNTIL = range(3)
"""Entries of `ImpactLog.plateau`: largest |J(t) − J(t − W)| of the present impact [N s], and first and last such t."""
GOING, ENDED = range(2)
"""Entries of `ImpactLog.counts`: contacts with a present impact, impacts that ended since they were last taken."""


class ImpactLog(NamedTuple):
    """Shapes: k contacts, n steps of a window and three more."""

    dt: float
    window: float
    """W [s]."""
    force: np.ndarray
    """Resultant of each contact in the present step, set by the time loop before `log_step` [N], (k, 3)."""
    steps: np.ndarray
    """(k, 4)"""
    before: np.ndarray
    """J at the end of the last step [N s], (k, 3)."""
    ring: np.ndarray
    """J at the ends of the last n steps [N s], (k, n, 3)."""
    plateau: np.ndarray
    """(k, 3)"""
    running: np.ndarray
    """Present impact of each contact as in `Trajectory.impacts`, (k, 9)."""
    ended: np.ndarray
    """Impacts that ended, contact first, (CAPACITY, 10)."""
    counts: np.ndarray
    """(2,)"""


def impact_log(first_rows: list[int], dt: float, window: float) -> ImpactLog:
    """Return an empty log of contacts, given by the first row of each, for steps dt [s] and a window [s].

    Raises:
        SolverError: the steps are so short that the window has too many.
    """
    contacts = len(first_rows)
    if window > MOST_STEPS * dt:
        raise SolverError(
            f"steps of {dt:.3g} s: the window of peak forces, {window:.3g} s, has more than {MOST_STEPS:,} of them;"
            " increase run.duration or run.step, or set a smaller run.window"
        )
    steps = np.zeros((contacts, 4), np.int64)
    steps[:, FIRST], steps[:, ROW] = -1, first_rows
    return ImpactLog(
        dt=dt, window=window, force=np.zeros((contacts, 3)), steps=steps, before=np.zeros((contacts, 3)),
        ring=np.zeros((contacts, math.floor(window / dt) + 3, 3)), plateau=np.zeros((contacts, 3)),
        running=np.zeros((contacts, IMPACT_COLUMNS)), ended=np.empty((CAPACITY if contacts else 0, 1 + IMPACT_COLUMNS)),
        counts=np.zeros(2, np.int64),
    )  # fmt: skip


@inner
def pressed(log, k):  # type: ignore[no-untyped-def]
    """Whether a force of contact k acts in the present step."""
    return log.force[k, 0] != 0.0 or log.force[k, 1] != 0.0 or log.force[k, 2] != 0.0


@inner
def changes(log, k, acts):  # type: ignore[no-untyped-def]
    """Whether contact k, whose force acts now or not, begins to touch or parts."""
    return acts != (log.steps[k, TOUCHING] == 1)


@inner
def note_change(log, k, acts, time, gap, rate):  # type: ignore[no-untyped-def]
    """Begin an impact, or set its end, at the zero of a gap [m], where contact k begins to touch or parts.

    Args:
        acts: Whether its force acts now.
        time: Of the gap and its rate [m/s], those of the point with the largest force [s].
    """
    if not changes(log, k, acts):
        return
    steps, running = log.steps[k], log.running[k]
    if not acts:
        steps[TOUCHING] = 0
        running[ENDS] = max(_zero(time, gap, rate, log.dt), running[BEGINS])
        running[OPENING] = max(rate, 0.0)
        return
    steps[TOUCHING] = 1
    if steps[FIRST] < 0:
        running[BEGINS] = _zero(time, gap, rate, log.dt)
        running[CLOSING] = max(-rate, 0.0)


@inner
def _zero(time, gap, rate, dt):  # type: ignore[no-untyped-def]
    """Return the time of the zero of a linear gap, at most a step before a time [s]."""
    late = gap / rate if rate != 0.0 else 0.0
    return time - min(max(late, 0.0), dt)


@inner
def log_step(log, number):  # type: ignore[no-untyped-def]
    """Add the impulses of a step to the present impacts, end those whose force has been zero for a window.

    The resultants are zero afterwards.
    """
    for k in range(len(log.force)):
        acts = pressed(log, k)
        if log.steps[k, FIRST] < 0:
            if not acts:
                continue
            _begin(log, k, number)
        _add(log, k, number, acts)
        if not acts and (number - log.steps[k, LAST]) * log.dt >= log.window:
            _end(log, k)


@inner
def _begin(log, k, number):  # type: ignore[no-untyped-def]
    log.counts[GOING] += 1
    log.steps[k, FIRST] = number
    log.running[k, PEAK] = 0.0
    log.plateau[k, LARGEST] = 0.0
    for axis in range(3):
        log.before[k, axis] = 0.0
        log.ring[k, 0, axis] = 0.0


@inner
def _add(log, k, number, acts):  # type: ignore[no-untyped-def]
    """Add the impulse of a step, and look for the largest forces."""
    dt, force, before, ring, running = log.dt, log.force[k], log.before[k], log.ring[k], log.running[k]
    size, since = len(ring), number + 1 - log.steps[k, FIRST]
    if acts:
        log.steps[k, LAST] = number
        square = 0.0
        for axis in range(3):
            square += force[axis] * force[axis]
        if square > running[PEAK] * running[PEAK]:
            running[PEAK], running[PEAK_TIME] = np.sqrt(square), (number + 0.5) * dt
    lag = log.window / dt
    whole = int(lag)
    part = lag - whole
    low, high = max(since - whole - 1, 0), max(since - whole, 0)
    late, early = 0.0, 0.0
    for axis in range(3):
        step = dt * force[axis]
        last = before[axis]
        now = last + step
        before[axis] = now
        ring[since % size, axis] = now
        under, over = ring[low % size, axis], ring[high % size, axis]
        # Of a window that ends with the step, and of the one before it that begins with a step.
        late += (now - over + part * (over - under)) ** 2
        early += (last + part * step - under) ** 2
        force[axis] = 0.0
    if since > whole:
        _note(log.plateau[k], log.window, np.sqrt(early), (number + part) * dt)
    _note(log.plateau[k], log.window, np.sqrt(late), (number + 1) * dt)


@inner
def _note(plateau, window, change, time):  # type: ignore[no-untyped-def]
    """Update the largest change of J over a window [N s] that ends at a time [s]."""
    if change > plateau[LARGEST] * (1 + PLATEAU):
        plateau[LARGEST], plateau[SINCE], plateau[UNTIL] = change, time, time
    elif change >= plateau[LARGEST] * (1 - PLATEAU) and time - plateau[SINCE] <= window:
        plateau[UNTIL] = time


@inner
def _end(log, k):  # type: ignore[no-untyped-def]
    """Store the present impact of a contact."""
    log.counts[GOING] -= 1
    number = log.counts[ENDED]
    log.counts[ENDED] += 1
    log.steps[k, FIRST] = -1
    if number < len(log.ended):
        log.ended[number, 0] = k
        finish(log.running[k], log.before[k], log.plateau[k], log.window)
        for column in range(log.running.shape[1]):
            log.ended[number, 1 + column] = log.running[k, column]


@entry
def finish(running, total, plateau, window):  # type: ignore[no-untyped-def]
    """Set impulse and windowed force of an impact from its J and its plateau."""
    running[IMPULSE] = np.sqrt(total[0] ** 2 + total[1] ** 2 + total[2] ** 2)
    if window > 0.0:
        running[WINDOWED] = plateau[LARGEST] / window
        running[WINDOWED_TIME] = 0.5 * (plateau[SINCE] + plateau[UNTIL]) - 0.5 * window
    else:
        running[WINDOWED], running[WINDOWED_TIME] = running[PEAK], running[PEAK_TIME]


class Located:
    """Impacts of a run, taken from its log after every frame."""

    def __init__(self, log: ImpactLog) -> None:
        self._log = log
        self._taken: list[list[np.ndarray]] = [[] for _ in log.steps]

    def take(self) -> bool:
        """Take the impacts that ended; False where more have ended than the log holds."""
        log = self._log
        count = int(log.counts[ENDED])
        log.counts[ENDED] = 0
        for k, *impact in log.ended[:count]:
            self._taken[int(k)].append(np.array(impact))
        return count <= len(log.ended)

    def impacts(self) -> list[np.ndarray]:
        """Return the impacts of each contact, (b, 9) each; one whose force still acts has no opening speed (NaN)."""
        log, found = self._log, []
        for k, taken in enumerate(self._taken):
            present = []
            if log.steps[k, FIRST] >= 0:
                running = log.running[k].copy()
                finish(running, log.before[k], log.plateau[k], log.window)
                if log.steps[k, TOUCHING]:
                    running[ENDS], running[OPENING] = (log.steps[k, LAST] + 1) * log.dt, np.nan
                present = [running]
            found.append(np.array([*taken, *present]).reshape(-1, IMPACT_COLUMNS))
        return found
