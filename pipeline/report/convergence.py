"""Whether quantities converge along the axes of a sweep; an order is fitted only where they do."""

import math
from collections.abc import Sequence

import numpy as np

from gudgeon.pipeline.report.document import Chain

LEAST = 3
"""Smallest number of runs whose convergence is tested."""
TOO_FEW = "not tested: fewer than three runs"
SHRINKS = 0.7
"""Largest ratio of the last difference from the finest run to the largest one of a chain that converges."""
SETTLED = 1e-3
"""Differences from the finest run below which a quantity has converged, whatever their trend."""
ROUND_OFF = 1e-11
ORDERS = np.arange(0.1, 8.05, 0.05)


def converges(differences: Sequence[float]) -> bool | None:
    """Return whether runs from coarse to fine approach the finest one; None where there are too few.

    Args:
        differences: Relative difference of each run from the finest, which is the last.
    """
    apart = np.abs(np.asarray(differences[:-1], float))
    if len(differences) < LEAST:
        return None
    if not np.isfinite(apart).all():
        return False
    return bool(apart.max() <= SETTLED or apart[-1] <= SHRINKS * apart[:-1].max())


def order_of(sizes: Sequence[float], differences: Sequence[float]) -> float | None:
    """Return the order p of differences that shrink as hᵖ − h_finestᵖ; None if too few of them are above round-off.

    Args:
        sizes: h of each run, the finest last: its step, or one over its coordinates.
        differences: As in `converges`.
    """
    h, apart = np.asarray(sizes, float), np.abs(np.asarray(differences, float))
    kept = (apart > ROUND_OFF) & (h > h[-1] * (1 + 1e-9))
    if kept.sum() < LEAST - 1 or not np.isfinite(apart).all():
        return None
    spread = np.log(h[kept][None] ** ORDERS[:, None] - h[-1] ** ORDERS[:, None])
    misfit = np.log(apart[kept])[None] - spread
    best = int(np.argmin(misfit.var(axis=1)))
    inside = 0 < best < len(ORDERS) - 1
    return float(ORDERS[best]) if inside else None


def chain(
    axis: str, runs: Sequence[str], sizes: Sequence[float], values: Sequence[float], apart: Sequence[float]
) -> Chain:
    """Return the runs of one axis of a sweep as a chain, with its order where it converges.

    Args:
        axis: `basis`, whose sizes are coordinates; `step` or `mesh`, whose sizes shrink.
        apart: Relative difference of each run from the finest, which is the last.
    """
    verdict = converges(apart)
    steps = [1.0 / size for size in sizes] if axis == "basis" else sizes
    order = order_of(steps, apart) if verdict else None
    return Chain(axis, list(runs), list(sizes), list(values), list(apart), converges=verdict, order=order)


def settling(name: str, chains: Sequence[Chain]) -> tuple[bool | None, str]:
    """Return whether a quantity converges along all of its chains, None where they are too short, and that in words."""
    axes: dict[str, bool] = {}
    for one in chains:
        if one.converges is not None:
            axes[one.axis] = axes.get(one.axis, True) and one.converges
    if not axes:
        return None, TOO_FEW
    failing = [axis for axis, found in axes.items() if not found]
    if not failing:
        return True, f"converges with {' and '.join(axes)}"
    apart = [(one.runs[-1], abs(one.differences[-2])) for one in chains if one.converges is False]
    run, size = max(apart, key=lambda item: item[1])
    distance = f"; the run before '{run}' differs from it by {size:.1%}" if math.isfinite(size) else ""
    return False, f"{name} does not converge with {' and '.join(failing)} over this sweep{distance}: not fitted"
