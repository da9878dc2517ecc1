"""Runs of one axis of a sweep, coarse to fine, and what they say of a quantity."""

from collections.abc import Sequence

from gudgeon.pipeline.report.convergence import converges, order_of, said
from gudgeon.pipeline.report.document import Chain


def chain(
    axis: str, runs: Sequence[str], sizes: Sequence[float], values: Sequence[float], apart: Sequence[float]
) -> Chain:
    """Return a chain, its order fitted where it converges.

    Args:
        axis: `basis`, whose sizes are coordinates; `step` or `mesh`, whose sizes shrink.
        apart: Relative difference of each run from the finest, which is the last.
    """
    verdict = converges(apart)
    steps = [1.0 / size for size in sizes] if axis == "basis" else sizes
    order = order_of(steps, apart) if verdict else None
    return Chain(axis, list(runs), list(sizes), list(values), list(apart), converges=verdict, order=order)


def settling(name: str, chains: Sequence[Chain]) -> tuple[bool | None, str]:
    """Return whether a quantity settles along all of its chains, None where they are too short, and that in words."""
    axes: dict[str, bool | None] = {}
    for one in chains:
        if one.converges is not None:
            axes[one.axis] = bool(axes.get(one.axis, True)) and one.converges
    apart = [(one.runs[-1], abs(one.differences[-2])) for one in chains if one.converges is False]
    worst = max(apart, key=lambda item: item[1], default=("", 0.0))
    return (None if not axes else all(axes.values())), said(name, axes, worst)
