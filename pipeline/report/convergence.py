"""Whether quantities converge along the axes of a sweep; an order is fitted only where they do."""

import math
from collections.abc import Sequence
from typing import NamedTuple

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
SATURATED = 0.5
"""Relative norm of a difference above which it no longer measures an error: two pulses that do not overlap have 1.4."""
LOWEST, HIGHEST, ASSUMED = 0.5, 8.0, 1.0
"""Orders of an extrapolation: the limits of the observed one, and the one assumed where none is observed."""


class Neighbour(NamedTuple):
    """A run that differs from another one in its size only."""

    size: float
    """Its size over that of the other."""
    difference: float
    """Its value over that of the other, less one; of histories the relative norm of the difference."""


class Estimate(NamedTuple):
    """The estimated error of a run."""

    error: float
    """Relative."""
    order: float | None
    """Observed order of convergence; None if it was not observed, the values are not monotone or it is too low."""


def converges(differences: Sequence[float]) -> bool | None:
    """Return whether runs from coarse to fine approach the finest one; None where there are too few.

    Args:
        differences: Relative difference of each run from the finest, which is the last.
    """
    distances = np.abs(np.asarray(differences[:-1], float))
    if len(differences) < LEAST:
        return None
    if not np.isfinite(distances).all():
        return False
    return bool(distances.max() <= SETTLED or distances[-1] <= SHRINKS * distances[:-1].max())


def order_of(sizes: Sequence[float], differences: Sequence[float]) -> float | None:
    """Return the order p of differences that shrink as hᵖ − h_finestᵖ; None if too few of them are above round-off.

    Args:
        sizes: h of each run, the finest last: its step, or one over its coordinates.
        differences: As in `converges`.
    """
    h, distances = np.asarray(sizes, float), np.abs(np.asarray(differences, float))
    above_round_off = (distances > ROUND_OFF) & (h > h[-1] * (1 + 1e-9))
    if above_round_off.sum() < LEAST - 1 or not np.isfinite(distances).all():
        return None
    spread = np.log(h[above_round_off][None] ** ORDERS[:, None] - h[-1] ** ORDERS[:, None])
    misfit = np.log(distances[above_round_off])[None] - spread
    best = int(np.argmin(misfit.var(axis=1)))
    interior = 0 < best < len(ORDERS) - 1
    return float(ORDERS[best]) if interior else None


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
    for c in chains:
        if c.converges is not None:
            axes[c.axis] = axes.get(c.axis, True) and c.converges
    if not axes:
        return None, TOO_FEW
    failing = [axis for axis, converging in axes.items() if not converging]
    if not failing:
        return True, f"converges with {' and '.join(axes)}"
    deviations = [(c.runs[-1], abs(c.differences[-2])) for c in chains if c.converges is False]
    run, size = max(deviations, key=lambda item: item[1])
    distance = f"; the run before '{run}' differs from it by {size:.1%}" if math.isfinite(size) else ""
    return False, f"{name} does not converge with {' and '.join(failing)} over this sweep{distance}: not fitted"


def extrapolated(finer: Neighbour | None, coarser: Neighbour | None, signed: bool = True) -> Estimate:
    """Return the error of a run from runs of a smaller and a larger size, by Richardson's extrapolation.

    With errors C hᵖ, the three values determine p and C; an order below `LOWEST` is taken as that. Values that are not
    monotone have no order; their error is estimated by the larger of the differences, and so is that of norms above
    `SATURATED`. With one neighbour alone an order of 1 is assumed.

    Args:
        signed: Whether differences have a sign; those of norms have none.

    Raises:
        ValueError: there is no neighbour.
    """
    if finer is None or coarser is None:
        neighbour = finer or coarser
        if neighbour is None:
            raise ValueError("no run of another size")
        size, difference = neighbour
        return Estimate(abs(difference) / abs(1 - size**ASSUMED), None)
    below, above = -finer.difference if signed else abs(finer.difference), coarser.difference
    if not (math.isfinite(below) and math.isfinite(above)):
        return Estimate(math.inf, None)
    saturated = not signed and max(below, above) > SATURATED
    if abs(below) <= ROUND_OFF or below * above <= 0 or saturated:
        return Estimate(max(abs(below), abs(above)), None)
    order = order_between((coarser.size, 1.0, finer.size), (abs(above), abs(below)), HIGHEST)
    return Estimate(abs(below) / (1 - finer.size**order), order if LOWEST < order < HIGHEST * (1 - 1e-9) else None)


def order_between(sizes: Sequence[float], distances: tuple[float, float], highest: float) -> float:
    """Return the order p of errors C hᵖ of three runs, by bisection; `LOWEST` at least.

    Args:
        sizes: h of each, coarse to fine.
        distances: Of the first run from the second, and of the second from the third.
        highest: Largest order.
    """
    (coarse, middle, fine), (above, below) = sizes, distances
    low, high = LOWEST, highest
    for _ in range(60):
        p = 0.5 * (low + high)
        rises = (coarse**p - middle**p) * below < above * (middle**p - fine**p)
        low, high = (p, high) if rises else (low, p)
    return low
