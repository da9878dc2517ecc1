"""Candidates that are all unilateral over a symmetric compliance: their complementarity problem by its closed ports."""

import numpy as np

from gudgeon.solver.compiled import copy, embedded, inner
from gudgeon.solver.contact.compliance import Compliance
from gudgeon.solver.contact.lcp import remove, solve_lcp
from gudgeon.solver.integrators.general.rows import add_row
from gudgeon.solver.integrators.outcome import PIVOTS

BETWEEN = 32
"""Ports between two candidates up to which the loops over a run cost less than two loops."""
GAP_TOLERANCE = 1e-12
"""Violation of a gap that is accepted, over the largest overlap without forces: gaps of open points may be wide."""


@embedded
def close(constants, state, problem):  # type: ignore[no-untyped-def]
    """Find the unknowns and measures of all candidates; False where ports depend on each other.

    The set of closed ports and its factor are kept from step to step.
    """
    active, free, ports = problem.active, problem.free, problem.ports[: problem.size[0]]
    if problem.size[1] != problem.size[0]:
        _list_runs(state.gap, problem)
    runs, averaged, deepest = problem.runs[: problem.size[3]], False, 0.0
    for i in ports:
        deepest, averaged = min(deepest, state.gap[i]), averaged | (state.extra[i] != 0.0)
    for k in range(len(runs)):
        copy(state.gap[runs[k, 0] : runs[k, 1]], free[runs[k, 0] : runs[k, 1]])
    if averaged:
        for i in ports:
            if state.extra[i] != 0.0:
                add_row(constants.pattern, constants.inertia, (i, state.extra[i]), ports, free)
    pivots = solve_lcp(_over(problem), free, active, problem.x, problem.y, -GAP_TOLERANCE * deepest)
    state.counts[PIVOTS] += max(0, pivots)
    if pivots < 0:
        active.size[:2] = 0
        problem.size[1] = -1
        return False
    for k in range(len(runs)):
        first, last = runs[k, 0], runs[k, 1]
        forces, gaps = problem.x[first:last], problem.y[first:last]
        copy(gaps, free[first:last])
        copy(gaps, state.measure[first:last])
        unknown = state.unknown[first:last]
        for n in range(len(unknown)):
            # A force within the tolerance below zero is none.
            unknown[n] = forces[n] if forces[n] > 0.0 else 0.0
    return True


@embedded
def _over(problem):  # type: ignore[no-untyped-def]
    """Return the compliance over the runs of candidates."""
    whole = problem.matrix
    return Compliance(
        pattern=whole.pattern, values=whole.values, base=whole.base, stamp=whole.stamp, era=whole.era,
        master=whole.master, block=problem.runs[: problem.size[3]], candidate=whole.candidate[: problem.size[3]],
        space=whole.space,
        corner=whole.corner, across=whole.across, along=whole.along, known=whole.known,
        window=whole.window, scratch=whole.scratch, touched=whole.touched, weights=whole.weights,
    )  # fmt: skip


@inner
def _list_runs(gap, problem):  # type: ignore[no-untyped-def]
    """List the candidates by runs of ports that follow each other, and open closed ports that are no candidates.

    Runs with few others between them are one: the gaps of those are computed too, and are infinite.
    They are of contacts, whose ports come first of all.
    """
    count, last, active = 0, -2 - BETWEEN, problem.active
    for a in range(problem.size[0]):
        i = problem.ports[a]
        if i > last + 1 + BETWEEN:
            problem.runs[count, 0] = i
            count += 1
        else:
            for j in range(last + 1, i):
                gap[j] = np.inf
        problem.runs[count - 1, 1] = i + 1
        last = i
    problem.size[3], problem.size[1] = count, problem.size[0]
    for a in range(active.size[0] - 1, -1, -1):
        if not problem.awake[0, active.rows[a]]:
            remove(active, active.rows[a])
