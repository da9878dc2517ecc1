"""Where a function of time jumps, and where it grows without bound."""

from collections.abc import Callable

import numpy as np

JUMP = 1e-6
"""Change of a motion in no time, relative to its largest, that is a jump."""
HALVINGS = 60
CLOSER = 20
"""Halvings towards a maximum, twice."""
GROWS = 10.0
"""Growth during the second of them, of one that is no maximum."""
NOISE = 1e3 * float(np.finfo(float).eps)
"""Round-off of a function over its value."""


def jump_of(function: Callable[[np.ndarray], np.ndarray], times: np.ndarray) -> float | None:
    """Return a time between given ones, (t,), at which a function of times jumps; None without one."""
    found = function(times)
    largest = max(float(np.abs(found).max()), float(np.finfo(float).tiny))
    (k,) = np.nonzero(np.abs(np.diff(found)) > JUMP * largest)
    if not len(k):
        return None
    begin, end, low, high = times[k], times[k + 1], found[k], found[k + 1]
    for _ in range(HALVINGS):
        middle = 0.5 * (begin + end)
        value = function(middle)
        largest = max(largest, float(np.abs(value).max()))  # All of a pulse may lie between two of the times.
        later = np.abs(high - value) > np.abs(value - low)
        begin, low = np.where(later, middle, begin), np.where(later, value, low)
        end, high = np.where(later, end, middle), np.where(later, high, value)
    jumps = np.abs(high - low) > JUMP * largest
    return float(end[jumps][0]) if jumps.any() else None


def pole_of(course: Callable[[np.ndarray], np.ndarray], times: np.ndarray) -> float | None:
    """Return a time between given ones near which the last rate of a function grows without bound; None without one,
    or where it is not finite at one of them.

    Each of its maxima is approached, and the function read on both sides of the place that was found, so that it does
    not matter how near to the pole this is. Maxima that are steep but finite end to grow before.

    Args:
        course: Values and rates at times, finite or not, (t,) → (t, k).
        times: At equal distances [s], (t,).
    """

    def height(at: np.ndarray) -> np.ndarray:
        return np.nan_to_num(np.abs(course(at.ravel())[:, -1]), posinf=np.inf).reshape(at.shape)

    found, gap = course(times), float(times[1] - times[0])
    if not np.isfinite(found).all():
        return None
    found = np.abs(found[:, -1])
    at = times[(found > np.append(0.0, found[:-1])) & (found >= np.append(found[1:], 0.0))]
    clear, before, last = np.full(len(at), True), np.zeros(len(at)), np.zeros(len(at))
    for number in range(2 * CLOSER):
        gap *= 0.5
        near = np.clip(at + gap * np.array([[-1.0], [0.0], [1.0]]), times[0], times[-1])
        at = near[height(near).argmax(axis=0), np.arange(len(at))]
        sides = np.clip(at + gap * np.array([[-1.0], [1.0]]), times[0], times[-1])
        beside = height(sides).max(axis=0)
        clear &= (beside > _noise(course, sides, gap)) & (gap > 2 * np.spacing(np.abs(at)))
        if number < CLOSER:
            before = last = beside
        last = np.where(clear, beside, last)
    grows = np.asarray(last >= GROWS * before)
    return float(at[grows][0]) if grows.any() else None


def _noise(course: Callable[[np.ndarray], np.ndarray], times: np.ndarray, gap: float) -> np.ndarray:
    """Return the round-off of the last rate at times a distance [s] from the zero of a quotient, (2, n) → (n,)."""
    values = course(times.ravel())
    size = np.nan_to_num(np.abs(values[:, 0]), posinf=0.0).reshape(times.shape).max(axis=0)
    return NOISE * size / gap ** (values.shape[1] - 1)
