"""Where a function of time jumps."""

from collections.abc import Callable

import numpy as np

JUMP = 1e-6
"""Change of a motion in no time, relative to its largest, that is a jump."""
HALVINGS = 60


def jump_of(function: Callable[[np.ndarray], np.ndarray], times: np.ndarray) -> float | None:
    """Return a time between given ones, (t,), at which a function of times jumps; None without one."""
    found = function(times)
    least = JUMP * max(float(np.abs(found).max()), float(np.finfo(float).tiny))
    (k,) = np.nonzero(np.abs(np.diff(found)) > least)
    if not len(k):
        return None
    begin, end, low, high = times[k], times[k + 1], found[k], found[k + 1]
    for _ in range(HALVINGS):
        middle = 0.5 * (begin + end)
        value = function(middle)
        later = np.abs(high - value) > np.abs(value - low)
        begin, low = np.where(later, middle, begin), np.where(later, value, low)
        end, high = np.where(later, end, middle), np.where(later, high, value)
    jumps = np.abs(high - low) > least
    return float(end[jumps][0]) if jumps.any() else None
