"""What histories reach between their points: windowed forces, and least gaps."""

import numpy as np

from gudgeon.solver.integrators.outcome import PLATEAU


def windowed(edges: np.ndarray, impulse: np.ndarray, window: float) -> tuple[float, float]:
    """Return the largest mean over W of the mean force over W [N], and its time [s].

    It is |I(t + W) − 2 I(t) + I(t − W)| / W², with I the integral of the impulse, and t an edge or between two.

    Args:
        edges: Times between which the impulse is linear, constant before and after [s], (n,).
        impulse: At these times, zero at the first [N s], (n, 3).
        window: W [s].
    """
    steps = np.diff(edges)
    integral = np.zeros_like(impulse)
    np.cumsum(0.5 * steps[:, None] * (impulse[1:] + impulse[:-1]), axis=0, out=integral[1:])

    def at(time: np.ndarray) -> np.ndarray:
        i = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, len(steps) - 1)
        since = (time - edges[i])[:, None]
        inside = np.clip(since, 0.0, steps[i, None])
        slope = (impulse[i + 1] - impulse[i]) / steps[i, None]
        return integral[i] + inside * (impulse[i] + 0.5 * slope * inside) + np.maximum(since - inside, 0) * impulse[-1]

    middles = np.sort(np.concatenate([edges, 0.5 * (edges[1:] + edges[:-1])]))
    sizes = np.linalg.norm(at(middles + window) - 2 * at(middles) + at(middles - window), axis=1) / window**2
    equal = middles[sizes >= sizes.max() * (1 - PLATEAU)]
    equal = equal[equal <= equal[0] + window]
    return float(sizes.max()), 0.5 * float(equal[0] + equal[-1])


def least_of_cubics(times: np.ndarray, gaps: np.ndarray, rates: np.ndarray) -> tuple[float, float]:
    """Return the least value of cubics by values [m] and rates [m/s] at some times, (f, c), and its time [s]."""
    frame, point = np.unravel_index(int(gaps.argmin()), gaps.shape)
    best = (float(gaps[frame, point]), float(times[frame]))
    spans = np.diff(times)[:, None]
    first, last, begin, end = gaps[:-1], gaps[1:], rates[:-1] * spans, rates[1:] * spans
    # g(x) = first + begin x + square x² + cube x³ with x from 0 to 1; its minimum is where g' = 0 and g'' > 0.
    with np.errstate(invalid="ignore", divide="ignore"):  # A point beside its surface has no gap: infinite.
        square, cube = 3 * (last - first) - 2 * begin - end, 2 * (first - last) + begin + end
        under = np.sqrt(square**2 - 3 * cube * begin)
        x = -begin / (square + under)
        lowest = np.where((x > 0) & (x < 1), first + x * (begin + x * (square + x * cube)), np.inf)
    lowest = np.where(np.isfinite(lowest), lowest, np.inf)
    if lowest.size and lowest.min() < best[0]:
        frame, point = np.unravel_index(int(lowest.argmin()), lowest.shape)
        best = (float(lowest[frame, point]), float(times[frame] + x[frame, point] * spans[frame, 0]))
    return best
