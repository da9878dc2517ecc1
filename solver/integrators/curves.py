"""What histories reach between their points: windowed forces, and least gaps."""

import numpy as np

from gudgeon.solver.contact.windows import mean_of_means
from gudgeon.solver.integrators.outcome import PLATEAU


def windowed(edges: np.ndarray, impulse: np.ndarray, window: float) -> tuple[float, float]:
    """Return the largest mean over W of the mean force over W [N], and its time [s].

    Times are edges, and those between two. Arguments as of `mean_of_means`.
    """
    middles = np.sort(np.concatenate([edges, 0.5 * (edges[1:] + edges[:-1])]))
    sizes = np.linalg.norm(mean_of_means(edges, impulse, window, middles), axis=1)
    equal = middles[sizes >= sizes.max() * (1 - PLATEAU)]
    equal = equal[equal <= equal[0] + window]
    return float(sizes.max()), 0.5 * float(equal[0] + equal[-1])


def least_of_cubics(
    times: np.ndarray, gaps: np.ndarray, rates: np.ndarray, struck: np.ndarray | None = None
) -> tuple[float, float]:
    """Return the least value of cubics by values [m] and rates [m/s] at some times, (f, c), and its time [s].

    Args:
        struck: In which spans between the times a force acts that may change the rates at once, (f − 1,): there the
            gap is that of the two tangents up to where they meet, no cubic; default: in none.
    """
    frame, point = np.unravel_index(int(gaps.argmin()), gaps.shape)
    best = (float(gaps[frame, point]), float(times[frame]))
    spans = np.diff(times)[:, None]
    g0, g1, m0, m1 = gaps[:-1], gaps[1:], rates[:-1] * spans, rates[1:] * spans
    # g(x) = first + begin x + square x² + cube x³ with x from 0 to 1; its minimum is where g' = 0 and g'' > 0.
    with np.errstate(invalid="ignore", divide="ignore"):  # A point beside its surface has no gap: infinite.
        square, cube = 3 * (g1 - g0) - 2 * m0 - m1, 2 * (g0 - g1) + m0 + m1
        under = np.sqrt(square**2 - 3 * cube * m0)
        x = -m0 / (square + under)
        lowest = np.where((x > 0) & (x < 1), g0 + x * (m0 + x * (square + x * cube)), np.inf)
        meet = (g1 - g0 - m1) / (m0 - m1)
        tangents = np.where((m0 < 0) & (m1 > 0) & (meet > 0) & (meet < 1), g0 + meet * m0, np.inf)
    if struck is not None:
        x, lowest = (np.where(struck[:, None], a, b) for a, b in ((meet, x), (tangents, lowest)))
    lowest = np.where(np.isfinite(lowest), lowest, np.inf)
    if lowest.size and lowest.min() < best[0]:
        frame, point = np.unravel_index(int(lowest.argmin()), lowest.shape)
        best = (float(lowest[frame, point]), float(times[frame] + x[frame, point] * spans[frame, 0]))
    return best
