"""Impacts of contacts, located step by step in the time loops, and the same from a history of forces.

A force is constant over a step, so the impulse J of a contact since the start of its impact is linear in it, and its
integral I quadratic. The windowed force at t, the mean over W of the mean over W, is

  |I(t + W) − 2 I(t) + I(t − W)| / W²,

with no force before and after the impact. It is evaluated at the ends and the middles of steps, from the beginning of
the impact to its end. An impact ends when no force has acted for a time, W at least: shorter separations
are part of it.
"""

import math
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.trajectory import (
    ENDS,
    IMPACT_COLUMNS,
    OPENING,
)
from gudgeon.solver import core
from gudgeon.solver.errors import SolverError

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
    separation: float
    """Time without a force that ends an impact [s]."""
    window: np.ndarray
    """W of each contact, at most the separation [s], (k,)."""
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


def impact_log(first_rows: list[int], dt: float, separation: float, windows: np.ndarray) -> ImpactLog:
    """Return an empty log of contacts, given by the first row of each, for steps dt [s] and windows [s], (k,).

    Raises:
        SolverError: the steps are so short that the window has too many.
    """
    contacts = len(first_rows)
    if separation > MOST_STEPS * dt:
        raise SolverError(
            f"steps of {dt:.3g} s: the window of peak forces, {separation:.3g} s, has more than {MOST_STEPS:,} of them;"
            " increase run.duration or run.step, or set a smaller run.window"
        )
    steps = np.zeros((contacts, 5), np.int64)
    steps[:, FIRST], steps[:, ROW] = -1, first_rows
    return ImpactLog(
        dt=dt, separation=separation, window=windows, force=np.zeros((contacts, 3)), steps=steps,
        before=np.zeros((contacts, 3)), sudden=np.zeros((contacts, 3)), jump=np.zeros((contacts, 3)),
        ring=np.zeros((contacts, math.floor(2 * separation / dt) + 3, 6)), plateau=np.zeros((contacts, 3)),
        running=np.zeros((contacts, IMPACT_COLUMNS)), ended=np.empty((CAPACITY if contacts else 0, 1 + IMPACT_COLUMNS)),
        counts=np.zeros(2, np.int64),
    )  # fmt: skip


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

    def state(self) -> np.ndarray:
        """Return the impacts that were taken, contact first, (b, 10)."""
        rows = [[k, *impact] for k, taken in enumerate(self._taken) for impact in taken]
        return np.array(rows).reshape(-1, 1 + IMPACT_COLUMNS)

    def resume(self, taken: np.ndarray) -> None:
        """Go on from impacts that were taken, see `state`."""
        for k, *impact in taken:
            self._taken[int(k)].append(np.array(impact))

    def impacts(self) -> list[np.ndarray]:
        """Return the impacts of each contact, (b, 9) each; one whose force still acts has no opening speed (NaN)."""
        log, records = self._log, []
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
            records.append(np.array([*taken, *present]).reshape(-1, IMPACT_COLUMNS))
        return records
