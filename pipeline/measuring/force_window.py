"""Force histories on common ground: a zero-phase window, and means over other intervals. Both keep the impulse.

Raw contact forces of modal and nodal models ring at their own cut-off; what can be compared is the force within a
stated window.
"""

import numpy as np

from gudgeon.pipeline.errors import StageError

UNIFORM_RTOL = 1e-6
"""Sample intervals may differ by rounding of their end times, not more."""


def hann_filter(times: np.ndarray, force: np.ndarray, width: float) -> np.ndarray:
    """Smooth interval means with a symmetric Hann window: f̄_i = Σ_k w_k f_{i+k}, Σ w_k = 1.

    The record is mirrored at both ends, so that the sum over all samples, and with it the impulse, stays the same.

    Args:
        times: Ends of the sample intervals, equally spaced [s], (s,).
        force: Mean over each interval [N], (s, ...).
        width: Full width of the window [s]; where it spans less than two intervals nothing changes.

    Returns:
        Filtered force [N], (s, ...).

    Raises:
        StageError: the intervals differ.
    """
    from scipy.ndimage import convolve1d

    if len(times) < 2:
        return np.array(force, float)
    intervals = np.diff(times)
    interval = intervals.mean()
    if np.ptp(intervals) > UNIFORM_RTOL * interval + 4 * np.spacing(abs(times).max()):
        raise StageError(
            f"force filter: sample intervals run from {intervals.min()} to {intervals.max()} s, need equal ones"
        )
    reach = int(0.5 * width / interval * (1 - 1e-12))
    if reach < 1:
        return np.array(force, float)
    weights = 1 + np.cos(2 * np.pi * interval / width * np.arange(-reach, reach + 1))
    return convolve1d(np.asarray(force, float), weights / weights.sum(), axis=0, mode="reflect")


def resample_mean(edges_times: np.ndarray, mean_force: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Return the mean force over each interval of another grid, by differences of the impulse ∫ f dt.

    Args:
        edges_times: Edges of the given intervals, ascending [s], (s + 1,).
        mean_force: Mean over each of them [N], (s, ...); outside of them the force is zero.
        grid: Edges of the wanted intervals, ascending [s], (g + 1,).

    Returns:
        Mean force [N], (g, ...).
    """
    flat = np.asarray(mean_force, float).reshape(len(edges_times) - 1, -1)
    impulse = np.zeros((len(edges_times), flat.shape[1]))
    np.cumsum(flat * np.diff(edges_times)[:, None], axis=0, out=impulse[1:])
    at_grid = np.column_stack([np.interp(grid, edges_times, column) for column in impulse.T])
    means = np.diff(at_grid, axis=0) / np.diff(grid)[:, None]
    return means.reshape(len(grid) - 1, *np.shape(mean_force)[1:])
