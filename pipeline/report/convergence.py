"""Whether quantities settle over a sweep. What does not is flagged; an order is fitted only to what does."""

import math
from collections.abc import Sequence

import numpy as np

LEAST = 3
"""Runs from which a chain tells anything."""
SHRINKS = 0.7
"""The last difference from the finest, over the largest, below which a chain converges."""
SETTLED = 1e-3
"""Differences from the finest below which a quantity has settled, whatever their trend."""
ROUND_OFF = 1e-11
ORDERS = np.arange(0.1, 8.05, 0.05)


def converges(differences: Sequence[float]) -> bool | None:
    """Return whether runs from coarse to fine approach the finest; None where too few tell.

    Args:
        differences: Of each from the finest, relative; the last is the finest's own, 0.
    """
    apart = np.abs(np.asarray(differences[:-1], float))
    if len(differences) < LEAST:
        return None
    if not np.isfinite(apart).all():
        return False
    return bool(apart.max() <= SETTLED or apart[-1] <= SHRINKS * apart[:-1].max())


def order_of(sizes: Sequence[float], differences: Sequence[float]) -> float | None:
    """Return the order p of differences that shrink as hᵖ − h_finestᵖ, or None where round-off or too few hide it.

    Args:
        sizes: h of each run, the finest last: its step, or one over its coordinates.
        differences: As above.
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


def said(name: str, axes: dict[str, bool | None], worst: tuple[str, float]) -> str:
    """Return in words what the chains of a quantity told.

    Args:
        axes: Axis → whether all its chains converge.
        worst: Of the chains that do not, the one whose last but one run is farthest from its finest: the finest run's
            name, and how far.
    """
    failing = [axis for axis, found in axes.items() if found is False]
    if failing:
        run, apart = worst
        size = f"; the run before '{run}' is {apart:.1%} from it" if math.isfinite(apart) else ""
        return f"{name} does not converge with {' and '.join(failing)} over this sweep{size}: not fitted"
    told = [axis for axis, found in axes.items() if found]
    return f"settles with {' and '.join(told)}" if told else "too few runs to tell"
