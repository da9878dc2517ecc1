"""Comparable force histories: a zero-phase window, and means over other intervals. Both preserve the impulse.

Contact forces of modal and full-FE models oscillate at their own cut-off frequency; they are compared after the same
window.
"""

import numpy as np

from gudgeon.pipeline.errors import StageError
from gudgeon.solver.contact.windows import mean_of_means

UNIFORM_RTOL = 1e-6
"""Largest relative difference of sample intervals: round-off of their end times."""


def hann_filter(times: np.ndarray, force: np.ndarray, width: float) -> np.ndarray:
    """Return interval means filtered with a symmetric Hann window: f̄_i = Σ_k w_k f_{i+k}, Σ w_k = 1 [N], (s, ...).

    The history is mirrored at both ends, so that the sum over all samples, and with it the impulse, is preserved.

    Args:
        times: Ends of the sample intervals, equally spaced [s], (s,).
        force: Mean over each interval [N], (s, ...).
        width: Full width of the window [s]; below two intervals the force is unchanged.

    Raises:
        StageError: the intervals are not equal.
    """
    from scipy.ndimage import convolve1d

    if len(times) < 2:
        return np.array(force, float)
    intervals = np.diff(times)
    interval = intervals.mean()
    if np.ptp(intervals) > UNIFORM_RTOL * interval + 4 * np.spacing(abs(times).max()):
        raise StageError(
            f"force filter: sample intervals of {intervals.min()} to {intervals.max()} s given, they must be equal"
        )
    half = int(0.5 * width / interval * (1 - 1e-12))
    if half < 1:
        return np.array(force, float)
    weights = 1 + np.cos(2 * np.pi * interval / width * np.arange(-half, half + 1))
    return convolve1d(np.asarray(force, float), weights / weights.sum(), axis=0, mode="reflect")


def windowed_peak(edges: np.ndarray, impulse: np.ndarray, window: float) -> float:
    """Return the largest mean over a window of the mean force over it, as the quantity `force_peak` [N].

    Args:
        edges: Times between which the impulse is linear, constant before and after [s], (n,).
        impulse: At these times, zero at the first [N s], (n, 3).
        window: Width [s].
    """
    times = np.sort(np.concatenate([edges, 0.5 * (edges[1:] + edges[:-1])]))
    return float(np.linalg.norm(mean_of_means(edges, impulse, window, times), axis=1).max())


def resample_mean(edges_times: np.ndarray, mean_force: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Return the mean force over each interval of another grid, by differences of the impulse ∫ f dt [N], (g, ...).

    Args:
        edges_times: Edges of the given intervals, ascending [s], (s + 1,).
        mean_force: Mean over each of them [N], (s, ...); outside of them the force is zero.
        grid: Edges of the new intervals, ascending [s], (g + 1,).
    """
    flat = np.asarray(mean_force, float).reshape(len(edges_times) - 1, -1)
    impulse = np.zeros((len(edges_times), flat.shape[1]))
    np.cumsum(flat * np.diff(edges_times)[:, None], axis=0, out=impulse[1:])
    at_grid = np.column_stack([np.interp(grid, edges_times, column) for column in impulse.T])
    means = np.diff(at_grid, axis=0) / np.diff(grid)[:, None]
    return means.reshape(len(grid) - 1, *np.shape(mean_force)[1:])
