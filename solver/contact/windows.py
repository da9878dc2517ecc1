"""Forces within a window: the mean over it of the mean over it, whose weight rises and falls over twice its length."""

import numpy as np

from gudgeon.modaldb.records.trajectory import BEGINS, ENDS, IMPACT_COLUMNS, PEAK

SHARE = 0.1
"""Window over the duration of an impact by which the peak of a smooth one is averaged to 1 %."""


def mean_of_means(edges: np.ndarray, impulse: np.ndarray, window: float, times: np.ndarray) -> np.ndarray:
    """Return the mean over W around some times, (k,), of the mean force over W [N], (k, 3).

    It is (I(t + W) − 2 I(t) + I(t − W)) / W², with I the integral of the impulse.

    Args:
        edges: Times between which the impulse is linear, constant before and after [s], (n,).
        impulse: At these times, zero at the first [N s], (n, 3).
        window: W [s].
    """
    steps = np.diff(edges)
    integral = np.zeros_like(impulse)
    np.cumsum(0.5 * steps[:, None] * (impulse[1:] + impulse[:-1]), axis=0, out=integral[1:])

    slopes = np.diff(impulse, axis=0) / steps[:, None]

    def at(time: np.ndarray) -> np.ndarray:
        i = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, len(steps) - 1)
        since = (time - edges[i])[:, None]
        elapsed = np.clip(since, 0.0, steps[i, None])
        rising = elapsed * (impulse[i] + 0.5 * slopes[i] * elapsed)
        return integral[i] + rising + np.maximum(since - elapsed, 0) * impulse[-1]

    return (at(times + window) - 2 * at(times) + at(times - window)) / window**2


def impact_window(impacts: np.ndarray, separation: float) -> float:
    """Return the default window of a contact's forces [s]: a tenth of its hardest impact, at most the separation.

    Args:
        impacts: (b, 9) as `Trajectory.impacts`; those without a force are jumps of velocity, which have no duration.
        separation: Time below which impacts are one [s].
    """
    hardest = impacts[impacts[:, PEAK].argmax()] if len(impacts) else np.zeros(IMPACT_COLUMNS)
    lasts = float(hardest[ENDS] - hardest[BEGINS])
    return min(separation, SHARE * lasts) if hardest[PEAK] > 0 and lasts > 0 else separation
