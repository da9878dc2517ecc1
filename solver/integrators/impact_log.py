"""Impacts of contacts, located step by step in the time loops, and the same from a history of forces.

A force is constant over a step, so the impulse J of a contact since the start of its impact is linear in it, and its
integral I quadratic. The windowed force at t, the mean over W of the mean over W, is

  |I(t + W) − 2 I(t) + I(t − W)| / W²,

with no force before and after the impact. It is evaluated at the ends and the middles of steps, from the beginning of
the impact to its end. An impact ends when no force has acted for W: separations shorter than W are part of it.
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
from gudgeon.solver import core
from gudgeon.solver.compiled import inner
from gudgeon.solver.errors import SolverError
from gudgeon.solver.integrators.outcome import PLATEAU

MOST_STEPS = 1_000_000
"""Largest number of steps in a window, which are kept at once."""
CAPACITY = 65_536
"""Impacts of all contacts that may end within a frame; more end the run."""
FIRST, LAST, TOUCHING, ROW, PRESENT = range(5)
"""Entries of `ImpactLog.steps`: number of the first step of the present impact, −1 where there is none; number of its
last step with a force; whether its force acts; contact row with the largest force when it did last; present step."""
LARGEST, SINCE, UNTIL = range(3)
"""Entries of `ImpactLog.plateau`: largest windowed force of the present impact [N], and first and last time of it."""
GOING, ENDED = range(2)
"""Entries of `ImpactLog.counts`: contacts with a present impact, impacts that ended since they were last taken."""


class ImpactLog(NamedTuple):
    """Shapes: k contacts, n steps of two windows and three more."""

    dt: float
    window: float
    """W [s]."""
    force: np.ndarray
    """Resultant of each contact in the present step, set by the time loop before `log_step` [N], (k, 3)."""
    steps: np.ndarray
    """(k, 5)"""
    before: np.ndarray
    """J at the end of the last step [N s], (k, 3)."""
    sudden: np.ndarray
    """Impulse without duration in the present impact [N s], (k, 3)."""
    jump: np.ndarray
    """Of it what the windowed force has not had yet [N s], (k, 3)."""
    ring: np.ndarray
    """J and I at the ends of the last n steps but for a linear function of time [N s, N s²], (k, n, 6)."""
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
    steps = np.zeros((contacts, 5), np.int64)
    steps[:, FIRST], steps[:, ROW] = -1, first_rows
    return ImpactLog(
        dt=dt, window=window, force=np.zeros((contacts, 3)), steps=steps, before=np.zeros((contacts, 3)),
        sudden=np.zeros((contacts, 3)), jump=np.zeros((contacts, 3)),
        ring=np.zeros((contacts, math.floor(2 * window / dt) + 3, 6)), plateau=np.zeros((contacts, 3)),
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
        if log.steps[k, PRESENT] < number:
            _add(log, k, number, acts)
        parted = not acts and log.steps[k, TOUCHING] == 0
        if parted and (number - log.steps[k, LAST]) * log.dt >= log.window:
            _end(log, k)


@inner
def note_impact(log, k, number, time, rate):  # type: ignore[no-untyped-def]
    """Begin an impact with an impulse without duration, which the caller adds by `add_jump`, unless one goes on.

    Args:
        time: [s]
        rate: Of the gap before it [m/s].
    """
    steps, running = log.steps[k], log.running[k]
    if steps[FIRST] >= 0 and steps[TOUCHING] == 0 and time - running[ENDS] >= log.window:
        if steps[PRESENT] < number:
            _add(log, k, number, pressed(log, k))
        complete(log, k)
        _end(log, k)
    note_change(log, k, True, time, 0.0, rate)
    if steps[FIRST] < 0:
        _begin(log, k, number)
    steps[LAST] = number


@inner
def add_jump(log, k, axis, impulse):  # type: ignore[no-untyped-def]
    """Add an impulse without duration along an axis to the present impact [N s]: it is in no force but the windowed."""
    log.sudden[k, axis] += impulse
    log.jump[k, axis] += impulse


@inner
def _begin(log, k, number):  # type: ignore[no-untyped-def]
    log.counts[GOING] += 1
    log.steps[k, FIRST], log.steps[k, PRESENT] = number, number - 1
    log.running[k, PEAK] = 0.0
    log.plateau[k, LARGEST] = 0.0
    for axis in range(3):
        log.before[k, axis] = 0.0
        log.sudden[k, axis] = log.jump[k, axis] = 0.0
        log.ring[k, 0, axis] = 0.0
        log.ring[k, 0, 3 + axis] = 0.0


@inner
def _add(log, k, number, acts):  # type: ignore[no-untyped-def]
    """Add the impulse of a step, and look for the largest forces."""
    dt, force, before, ring, running = log.dt, log.force[k], log.before[k], log.ring[k], log.running[k]
    size, since = len(ring), number + 1 - log.steps[k, FIRST]
    log.steps[k, PRESENT] = number
    if acts:
        log.steps[k, LAST] = number
        square = 0.0
        for axis in range(3):
            square += force[axis] * force[axis]
        if square > running[PEAK] * running[PEAK]:
            running[PEAK], running[PEAK_TIME] = np.sqrt(square), (number + 0.5) * dt
    last, now = ring[(since - 1) % size], ring[since % size]
    for axis in range(3):
        before[axis] += dt * force[axis]
        step = dt * force[axis] + log.jump[k, axis]
        log.jump[k, axis] = 0.0
        now[axis] = last[axis] + step
        now[3 + axis] = last[3 + axis] + dt * (last[axis] + 0.5 * step)
        force[axis] = 0.0
    if log.window <= 0.0:
        return
    lag = log.window / dt
    first = max(int(np.floor(2.0 * (since - 1 - lag))) + 1, 0)
    end = min(int(np.floor(2.0 * (since - lag))), 2 * (log.steps[k, LAST] + 1 - log.steps[k, FIRST]))
    for half in range(first, end + 1):
        middle = 0.5 * half
        square = 0.0
        for axis in range(3):
            change = _doubly(ring, middle + lag, since, axis, dt) + _doubly(ring, middle - lag, since, axis, dt)
            square += (change - 2.0 * _doubly(ring, middle, since, axis, dt)) ** 2
        _note(log.plateau[k], log.window, np.sqrt(square) / log.window**2, (log.steps[k, FIRST] + middle) * dt)
    if since % size == 0:
        _shift(ring, dt)


@inner
def _doubly(ring, at, since, axis, dt):  # type: ignore[no-untyped-def]
    """Return I along an axis at a number of steps since the start of the impact, `since` at most [N s²]."""
    if at <= 0.0:
        return 0.0
    low = min(int(at), since - 1)
    part, size = at - low, len(ring)
    under, over = ring[low % size], ring[(low + 1) % size]
    return under[3 + axis] + part * dt * (under[axis] + 0.5 * part * (over[axis] - under[axis]))


@inner
def _shift(ring, dt):  # type: ignore[no-untyped-def]
    """Take a linear function of time off I, that of the present step, and its slope off J, so that both stay small."""
    size = len(ring)
    for axis in range(3):
        J, I = ring[0, axis], ring[0, 3 + axis]
        for place in range(size):
            steps = 0 if place == 0 else place - size
            ring[place, 3 + axis] -= I + J * steps * dt
            ring[place, axis] -= J


@inner
def _note(plateau, window, force, time):  # type: ignore[no-untyped-def]
    """Update the largest windowed force [N]."""
    if force > plateau[LARGEST] * (1 + PLATEAU):
        plateau[LARGEST], plateau[SINCE], plateau[UNTIL] = force, time, time
    elif force >= plateau[LARGEST] * (1 - PLATEAU) and time - plateau[SINCE] <= window:
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
        finish(log.running[k], (log.before[k], log.sudden[k]), log.plateau[k], log.window)
        for column in range(log.running.shape[1]):
            log.ended[number, 1 + column] = log.running[k, column]


@inner
def finish(running, impulses, plateau, window):  # type: ignore[no-untyped-def]
    """Set impulse and windowed force of an impact from its J, its impulse without duration, and its plateau."""
    square = 0.0
    for axis in range(3):
        square += (impulses[0][axis] + impulses[1][axis]) ** 2
    running[IMPULSE] = np.sqrt(square)
    if window > 0.0:
        running[WINDOWED] = plateau[LARGEST]
        running[WINDOWED_TIME] = 0.5 * (plateau[SINCE] + plateau[UNTIL])
    else:
        running[WINDOWED], running[WINDOWED_TIME] = running[PEAK], running[PEAK_TIME]


@inner
def complete(log, k):  # type: ignore[no-untyped-def]
    """Evaluate the windowed force of the present impact of contact k up to its end, with no force after it."""
    number = log.steps[k, PRESENT]
    while (number - log.steps[k, LAST]) * log.dt < log.window:
        number += 1
        _add(log, k, number, False)


class Located:
    """Impacts of a run, taken from its log after every frame."""

    def __init__(self, log: ImpactLog) -> None:
        self._log = log
        self._taken: list[list[np.ndarray]] = [[] for _ in log.steps]

    def take(self) -> bool:
        """Take the impacts that ended; False where more have ended than the log holds."""
        log = self._log
        count = int(log.counts[ENDED])
        if not count:
            return True
        log.counts[ENDED] = 0
        for k, *impact in log.ended[:count]:
            self._taken[int(k)].append(np.array(impact))
        return count <= len(log.ended)

    def impacts(self) -> list[np.ndarray]:
        """Return the impacts of each contact, (b, 9) each; one whose force still acts has no opening speed (NaN)."""
        log, found = self._log, []
        log = log._replace(
            steps=log.steps.copy(), before=log.before.copy(), sudden=log.sudden.copy(), jump=log.jump.copy(),
            ring=log.ring.copy(), plateau=log.plateau.copy(), running=log.running.copy(),
        )  # fmt: skip
        for k, taken in enumerate(self._taken):
            present = []
            if log.steps[k, FIRST] >= 0:
                running = log.running[k]
                core.finish_impact(log, k)
                if log.steps[k, TOUCHING]:
                    running[ENDS], running[OPENING] = (log.steps[k, LAST] + 1) * log.dt, np.nan
                present = [running]
            found.append(np.array([*taken, *present]).reshape(-1, IMPACT_COLUMNS))
        return found
