"""The first time at which one of several functions of time falls below zero.

Functions are sampled four times per radian of the fastest oscillator; between samples a cubic through values and
slopes shows whether a function has a minimum below zero. Where only polynomials move, one interval is exact.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from gudgeon.solver.integrators.event.motion import Course

PER_RADIAN = 4.0
BLOCK = 64
"""Samples evaluated at once."""
NOISE = 1e-14
"""Round-off of a function, relative to the sum of its absolute terms."""


@dataclass(frozen=True)
class _Block:
    """Samples of all functions. Shapes: t samples, k functions."""

    time: np.ndarray
    values: np.ndarray
    slopes: np.ndarray
    noise: np.ndarray
    floor: np.ndarray
    """(k,)"""
    bend: np.ndarray
    """Bound of the fourth derivative, (k,)."""


def first_crossing(course: Course, end: float, floor: np.ndarray | None = None) -> tuple[float, int] | None:
    """Find the time in [0, end] at which a function first falls below zero.

    Args:
        course: k functions, none below zero at 0 by more than round-off. One that is zero there and falls crosses at 0.
        end: [s]
        floor: Depth below zero that is accepted, beside round-off of what moves, (k,).

    Returns:
        Time [s] and number of the function, or None.
    """
    if not len(course.a) or end <= 0:
        return None
    fastest = float(np.abs(course.exponents).max()) if len(course.exponents) else 0.0
    step = min(1.0 / (PER_RADIAN * fastest), end) if fastest > 0 else end
    start, floor = 0.0, np.zeros(len(course.a)) if floor is None else floor
    while start < end:
        start = _safe(course, start, end)
        if start >= end:
            return None
        count = min(BLOCK, int(np.ceil((end - start) / step)))
        block = _sample(course, np.minimum(start + step * np.arange(count + 1), end), floor)
        crossing = _in_block(course, block)
        if crossing is not None:
            return crossing
        start = float(block.time[-1])
    return None


def _sample(course: Course, time: np.ndarray, floor: np.ndarray) -> _Block:
    late = time[:, None]
    moved = np.minimum(late * course.speed, late * np.abs(course.b) + 2 * course.swing) + late**2 * np.abs(course.c)
    noise, bend = NOISE * (np.abs(course.a) + moved) + floor, np.abs(course.A) @ np.abs(course.exponents) ** 4
    return _Block(time, course.values(time), course.rate.values(time), noise, floor, bend)


def _safe(course: Course, start: float, end: float) -> float:
    """Return a time before which no function can reach zero, by its polynomial less the swing of its oscillators."""
    safe = end
    for a, b, c in zip(course.middle - course.swing, course.b, course.c, strict=True):
        if a + start * (b + start * c) <= 0:
            return start
        roots = np.roots([c, b, a]) if c else (np.array([-a / b]) if b else np.empty(0))
        later = [root.real for root in roots if root.imag == 0 and root.real > start]
        safe = min([safe, *later])
    return safe


def _in_block(course: Course, block: _Block) -> tuple[float, int] | None:
    values, width = block.values, np.diff(block.time)[:, None]
    below = values[1:] < -block.noise[1:]
    slope_start, slope_end = block.slopes[:-1] * width, block.slopes[1:] * width
    dips = ~below & (slope_start < 0) & (slope_end > 0)
    if dips.any():
        # The error of the cubic is at most h⁴/384 times the fourth derivative; a dip has its minimum below zero.
        missed = width**4 / 384 * block.bend
        dips &= _lowest(values[:-1], values[1:], slope_start, slope_end) - missed < -block.noise[1:]
    suspects = below | dips
    for row in map(int, np.flatnonzero(suspects.any(axis=1))):
        roots = [(_root(course[k : k + 1], block, row, k), k) for k in map(int, np.flatnonzero(suspects[row]))]
        real = [(time, k) for time, k in roots if time is not None]
        if real:
            return min(real)
    return None


def _lowest(y0: np.ndarray, y1: np.ndarray, m0: np.ndarray, m1: np.ndarray) -> np.ndarray:
    """Return the minimum between two points of the cubics through values y and slopes m per interval."""
    a, b, c = 2 * (y0 - y1) + m0 + m1, 3 * (y1 - y0) - 2 * m0 - m1, m0
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt(np.maximum(b * b - 3 * a * c, 0.0))
        x = np.where(b >= 0, -c / (b + root), (root - b) / (3 * a))
    x = np.clip(np.nan_to_num(x), 0.0, 1.0)
    return np.minimum(np.minimum(y0, y1), y0 + x * (c + x * (b + x * a)))


def _root(function: Course, block: _Block, row: int, k: int) -> float | None:
    """Return the first zero after sample `row` of a function that falls below zero, None where by round-off only."""
    low, high = float(block.time[row]), float(block.time[row + 1])
    noise = float(block.noise[row + 1, k])

    def height(time: float) -> float:
        return float(function.values(np.array([time]))[0, 0])

    if block.values[row, k] <= block.noise[row, k]:
        # It is zero at the sample: it falls at once, or rises first.
        early = low + (high - low) * 0.5 ** np.arange(48.0, -1.0, -1.0)
        sample = _sample(function, early, block.floor[k : k + 1])
        rising = np.flatnonzero(sample.values[:, 0] > sample.noise[:, 0])
        falling = np.flatnonzero(sample.values[:, 0] < -sample.noise[:, 0])
        if not len(falling):
            return None
        if not len(rising) or falling[0] < rising[0]:
            return low
        low, high = float(early[falling[0] - 1]), float(early[falling[0]])
        if height(low) <= 0:
            return low
    elif block.values[row + 1, k] >= 0:
        high = brentq(
            lambda time: float(function.rate.values(np.array([time]))[0, 0]), low, high, xtol=1e-300, rtol=1e-14
        )
        if height(high) >= -noise:
            return None
    return float(brentq(height, low, high, xtol=1e-300, rtol=8.9e-16, maxiter=200))
