"""Where steps should end, so that none passes over a part of a function of time without reading it.

An error estimate knows what a method's stages have read. A pulse between them changes nothing, and steps over what is
constant on both sides grow without bound. A function is read on grids of several spacings before the run: where its
second difference is a noticeable part of its range, something happens on the scale of that grid. Steps end before and
after such a span of time, so that the stages of a step lie within it.
"""

from collections.abc import Callable, Iterable

import numpy as np

FINEST = 2**17
"""Intervals of the finest grid: shorter pulses that no table has as rows may be passed over."""
COARSER, GRIDS = 8, 5
"""Ratio of the spacings of two grids, and how many there are."""
NOTICED = 1e-2
"""Second difference of a function over its range."""
APART = 4
"""Intervals between two points of one span at most."""
MOST_ROWS = 5000
"""Rows of a table at whose kinks steps end at most."""
KINK = 1e-6
"""Deviation of a row from the line through its neighbours, over the range of the table, that is a kink."""


def breaks_of(read: Callable[[np.ndarray], np.ndarray], duration: float) -> np.ndarray:
    """Return the times at which steps should end, ascending (b,) [s].

    Args:
        read: Values of functions at times, (t,) → (t, k).
        duration: Of the run [s].
    """
    values = read(np.linspace(0.0, duration, FINEST + 1)).reshape(FINEST + 1, -1)
    found = [np.empty(0)]
    for grid in range(GRIDS):
        every = COARSER**grid
        here, spacing = values[::every], duration * every / FINEST
        size = np.ptp(values, axis=0)
        bent = np.abs(np.diff(here, 2, axis=0)) > NOTICED * np.where(size > 0, size, np.inf)
        at = 1 + np.flatnonzero(bent.any(axis=1))
        if len(at):
            gaps = np.diff(at) > APART
            first, last = at[np.append(True, gaps)], at[np.append(gaps, True)]
            found.append(spacing * np.concatenate([first - 1, last + 1]))
    return _within(found, duration)


def kinks_of(values: Iterable[tuple[float, float]], duration: float) -> np.ndarray:
    """Return the times of the rows of a table that is linear between them at which it has a kink, (b,) [s]."""
    times, amounts = np.array(list(values), float).T
    size = float(np.ptp(amounts))
    if len(times) < 3 or len(times) > MOST_ROWS or size == 0:
        return np.empty(0)
    share = (times[1:-1] - times[:-2]) / (times[2:] - times[:-2])
    line = amounts[:-2] + share * (amounts[2:] - amounts[:-2])
    return _within([times[1:-1][np.abs(amounts[1:-1] - line) > KINK * size]], duration)


def _within(times: list[np.ndarray], duration: float) -> np.ndarray:
    """Return times inside of a run, ascending, each once."""
    found = np.unique(np.concatenate(times))
    return found[(found > 0) & (found < duration)]
