"""Candidates that are all unilateral over a symmetric compliance: their complementarity problem by its closed ports."""

import numpy as np

from gudgeon.solver.compiled import embedded, inner
from gudgeon.solver.contact.compliance import Compliance
from gudgeon.solver.contact.lcp import remove, solve_lcp

BETWEEN = 32
"""Ports between two candidates up to which the loops over a run cost less than two loops."""
GAP_TOLERANCE = 1e-12
"""Violation of a gap that is accepted, relative to the largest gap."""


@embedded
def close(problem, largest):  # type: ignore[no-untyped-def]
    """Set x and y of the candidates, by the numbers of their ports.

    The set of closed ports and its factor are kept from step to step.

    Args:
        largest: Gap of a candidate [m].

    Returns:
        Number of ports opened and closed; −1 where ports depend on each other.
    """
    if problem.size[1] != problem.size[0]:
        _list_runs(problem)
    active, whole = problem.active, problem.matrix
    matrix = Compliance(
        pattern=whole.pattern, values=whole.values, base=whole.base, stamp=whole.stamp, era=whole.era,
        master=whole.master, block=problem.runs[: problem.size[3]], candidate=whole.candidate[: problem.size[3]],
        space=whole.space,
        corner=whole.corner, across=whole.across, along=whole.along, known=whole.known,
        window=whole.window, scratch=whole.scratch, touched=whole.touched, weights=whole.weights,
    )  # fmt: skip
    pivots = solve_lcp(matrix, problem.free, active, problem.x, problem.y, GAP_TOLERANCE * largest)
    if pivots < 0:
        active.size[:2] = 0
        problem.size[1] = -1
    return pivots


@inner
def _list_runs(problem):  # type: ignore[no-untyped-def]
    """List the candidates by runs of ports that follow each other, and open closed ports that are no candidates.

    Runs with few others between them are one: the gaps of those are computed too, and are infinite.
    """
    count, last, active = 0, -2 - BETWEEN, problem.active
    for a in range(problem.size[0]):
        i = problem.ports[a]
        if i > last + 1 + BETWEEN:
            problem.runs[count, 0] = i
            count += 1
        else:
            for j in range(last + 1, i):
                problem.free[j] = np.inf
        problem.runs[count - 1, 1] = i + 1
        last = i
    problem.size[3], problem.size[1] = count, problem.size[0]
    for a in range(active.size[0] - 1, -1, -1):
        if not problem.awake[0, active.rows[a]]:
            remove(active, active.rows[a])
