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
    samples = function(times)
    largest = max(float(np.abs(samples).max()), float(np.finfo(float).tiny))
    (k,) = np.nonzero(np.abs(np.diff(samples)) > JUMP * largest)
    if not len(k):
        return None
    start, end, low, high = times[k], times[k + 1], samples[k], samples[k + 1]
    for _ in range(HALVINGS):
        middle = 0.5 * (start + end)
        value = function(middle)
        largest = max(largest, float(np.abs(value).max()))  # All of a pulse may lie between two of the times.
        later = np.abs(high - value) > np.abs(value - low)
        start, low = np.where(later, middle, start), np.where(later, value, low)
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

    def height(t: np.ndarray) -> np.ndarray:
        return np.nan_to_num(np.abs(course(t.ravel())[:, -1]), posinf=np.inf).reshape(t.shape)

    values, gap = course(times), float(times[1] - times[0])
    if not np.isfinite(values).all():
        return None
    values = np.abs(values[:, -1])
    peaks = times[(values > np.append(0.0, values[:-1])) & (values >= np.append(values[1:], 0.0))]
    clear, before, height_now = np.full(len(peaks), True), np.zeros(len(peaks)), np.zeros(len(peaks))
    for halving in range(2 * CLOSER):
        gap *= 0.5
        candidates = np.clip(peaks + gap * np.array([[-1.0], [0.0], [1.0]]), times[0], times[-1])
        peaks = candidates[height(candidates).argmax(axis=0), np.arange(len(peaks))]
        sides = np.clip(peaks + gap * np.array([[-1.0], [1.0]]), times[0], times[-1])
        beside = height(sides).max(axis=0)
        clear &= (beside > _noise(course, sides, gap)) & (gap > 2 * np.spacing(np.abs(peaks)))
        if halving < CLOSER:
            before = height_now = beside
        height_now = np.where(clear, beside, height_now)
    grows = np.asarray(height_now >= GROWS * before)
    return float(peaks[grows][0]) if grows.any() else None


def _noise(course: Callable[[np.ndarray], np.ndarray], times: np.ndarray, gap: float) -> np.ndarray:
    """Return the round-off of the last rate at times a distance [s] from the zero of a quotient, (2, n) → (n,)."""
    values = course(times.ravel())
    size = np.nan_to_num(np.abs(values[:, 0]), posinf=0.0).reshape(times.shape).max(axis=0)
    return NOISE * size / gap ** (values.shape[1] - 1)
