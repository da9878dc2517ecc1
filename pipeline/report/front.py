"""How far each run may be trusted, and which runs nothing beats in both that and run time."""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

from gudgeon.pipeline.report.document import Errors, Run


def conservative_error(
    run: Run, runs: Sequence[Run], counting: Collection[str] | None = None, own: bool = False
) -> float | None:
    """Return the largest error of a run in the quantities that count, or what its basis or step adds if that is larger.

    Errors of basis and step that cancel make no good setting. A largest basis has no larger one to tell them apart.
    Where it is the reference, too, it is taken to lack as much as the next smaller one does, which is more than it does
    where they converge.

    Args:
        runs: All of its report.
        counting: All quantities where None.
        own: Whether the reference is one of these runs.
    """
    if run.largest_error is None:
        return None
    names = run.errors if counting is None else counting
    lacking = run.truncation or (_next_smaller(run, runs) if own else None)
    parts = [part for part in (lacking, run.time) if part is not None]
    sizes = [abs(part[name]) for part in parts for name in names if part.get(name) is not None]
    return max([run.largest_error, *sizes])


def pareto_front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Return the numbers of the points (seconds, error) that no other point beats in both, by seconds."""
    order = sorted(range(len(points)), key=lambda i: points[i])
    front, best = [], math.inf
    for i in order:
        if points[i][1] < best:
            front.append(i)
            best = points[i][1]
    return front


def with_front(runs: Sequence[Run], counting: Collection[str] | None = None, own: bool = False) -> list[Run]:
    """Return the runs, each with its conservative error and whether it is on the front of that over its CPU seconds."""
    sound = [conservative_error(run, runs, counting, own) for run in runs]
    known = [number for number, error in enumerate(sound) if error is not None]
    points = [(runs[number].cpu_seconds, error) for number, error in enumerate(sound) if error is not None]
    best = {known[i] for i in pareto_front(points)}
    return [replace(run, conservative_error=sound[number], front=number in best) for number, run in enumerate(runs)]


def _next_smaller(run: Run, runs: Sequence[Run]) -> Errors | None:
    """Return what the largest of the bases that were compared with a run's lacks; None where there is none."""
    smaller = [other for other in runs if other.truncation is not None and other.truncation_against == run.name]
    return max(smaller, key=lambda other: other.coordinates).truncation if smaller else None
