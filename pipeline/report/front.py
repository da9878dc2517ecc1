"""The conservative error of each run, and the Pareto front of error and CPU time."""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

from gudgeon.pipeline.report.document import Errors, Run


def conservative_error(
    run: Run, runs: Sequence[Run], counting: Collection[str] | None = None, internal: bool = False
) -> float | None:
    """Return the largest of total, truncation and time error of a run over the quantities that count.

    Errors of opposite sign therefore cannot cancel. A largest basis has no truncation error of its own; if it is the
    reference, that of the next smaller basis is its estimate, an upper bound where the bases converge.

    Args:
        runs: All runs of the report.
        counting: Quantities that count; None for all.
        internal: Whether the reference is one of these runs.
    """
    if run.largest_error is None:
        return None
    names = run.errors if counting is None else counting
    truncation = run.truncation or (_next_smaller(run, runs) if internal else None)
    components = [errors for errors in (truncation, run.time) if errors is not None]
    sizes = [abs(errors[name]) for errors in components for name in names if errors.get(name) is not None]
    return max([run.largest_error, *sizes])


def pareto_front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Return the numbers of the points (seconds, error) that no other point beats in both, in the order of seconds."""
    order = sorted(range(len(points)), key=lambda i: points[i])
    front, best = [], math.inf
    for i in order:
        if points[i][1] < best:
            front.append(i)
            best = points[i][1]
    return front


def with_front(runs: Sequence[Run], counting: Collection[str] | None = None, internal: bool = False) -> list[Run]:
    """Return the runs with their conservative error, and with `front` set on the front of that error and CPU time."""
    conservative = [conservative_error(run, runs, counting, internal) for run in runs]
    compared = [row for row, error in enumerate(conservative) if error is not None]
    points = [(runs[row].cpu_seconds, error) for row, error in enumerate(conservative) if error is not None]
    best = {compared[i] for i in pareto_front(points)}
    return [replace(run, conservative_error=conservative[row], front=row in best) for row, run in enumerate(runs)]


def _next_smaller(run: Run, runs: Sequence[Run]) -> Errors | None:
    """Return the truncation error of the largest basis that was compared with a run; None where there is none."""
    smaller = [r for r in runs if r.truncation is not None and r.truncation_against == run.name]
    return max(smaller, key=lambda r: r.coordinates).truncation if smaller else None
