"""Which runs nothing beats in both error and run time."""

import math
from collections.abc import Sequence
from dataclasses import replace

from pipeline.study.document import Run


def pareto_front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Return the numbers of the points (seconds, error) that no other point beats in both, by seconds."""
    order = sorted(range(len(points)), key=lambda i: points[i])
    front, best = [], math.inf
    for i in order:
        if points[i][1] < best:
            front.append(i)
            best = points[i][1]
    return front


def with_front(runs: Sequence[Run]) -> list[Run]:
    """Return the runs, each knowing whether it is on the front of its largest error over its CPU seconds."""
    known = [(number, run.largest_error) for number, run in enumerate(runs) if run.largest_error is not None]
    best = {known[i][0] for i in pareto_front([(runs[number].cpu_seconds, error) for number, error in known])}
    return [replace(run, front=number in best) for number, run in enumerate(runs)]
