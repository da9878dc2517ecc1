"""Which candidates a contact solution is about: those that have a force or would overlap without one.

The others are open. Their measures are found after the forces, not in every sweep; those that overlap then act, too.
"""

from gudgeon.solver.compiled import copy, inner
from gudgeon.solver.contact.pattern import combine_rows
from gudgeon.solver.integrators.general.arrays import CONE, UNILATERAL


@inner
def measure(constants, state, problem, count):  # type: ignore[no-untyped-def]
    """Set the measures of all candidates by the unknowns of those that are listed; others between them are not read.

    Args:
        count: Of the candidates.
    """
    if count == 0:
        return
    first, last = problem.candidates[0], problem.candidates[count - 1] + 1
    if not _pushes_alike(problem, first, last):
        problem.pushed[first:last] = 0.0
        listed = (problem.ports, problem.x, problem.size[0])
        combine_rows(constants.pattern, constants.columns, listed, first, last, problem.pushed)
        problem.pushing[:] = 0.0
        for a in range(problem.size[0]):
            problem.pushing[problem.ports[a]] = problem.x[a]
        problem.span[0], problem.span[1] = first, last
    measures, free, pushed = state.measure[first:last], problem.free[first:last], problem.pushed[first:last]
    for i in range(len(measures)):
        measures[i] = free[i] + pushed[i]


@inner
def _pushes_alike(problem, first, last):  # type: ignore[no-untyped-def]
    """Whether `pushed` holds for the listed unknowns and a range of ports, such as those of the step before."""
    if problem.size[1] < 0 or problem.span[0] > first or problem.span[1] < last:
        return False
    others = 0
    for i in range(len(problem.pushing)):
        others += problem.pushing[i] != 0.0
    for a in range(problem.size[0]):
        if problem.x[a] != problem.pushing[problem.ports[a]]:
            return False
        others -= problem.x[a] != 0.0
    return others == 0


@inner
def choose(constants, state, problem, count):  # type: ignore[no-untyped-def]
    """Let candidates act which their measures or forces ask for, all where points slide; whether these are more."""
    found, a = False, 0
    while a < count:
        i = problem.candidates[a]
        a += constants.size[i]
        if problem.acting[i]:
            continue
        # A measure that is not a number acts, and is found out.
        acts = constants.slides or constants.kind[i] not in (UNILATERAL, CONE) or not (state.measure[i] >= 0.0)
        for b in range(i, i + constants.size[i]):
            acts = acts or state.unknown[b] != 0.0
        if acts:
            problem.acting[i] = found = True
    return found


@inner
def list_acting(constants, problem, count):  # type: ignore[no-untyped-def]
    """List the candidates that act in `problem.ports`; their columns hold if they are those of the last solution."""
    ports, gathered, same, n, a = problem.ports, problem.gathered, True, 0, 0
    while a < count:
        i = problem.candidates[a]
        if problem.acting[i]:
            for b in range(i, i + constants.size[i]):
                same = same and gathered[n] == b
                ports[n] = gathered[n] = b
                n += 1
        a += constants.size[i]
    if not same or n != problem.size[1]:
        problem.size[1] = -1
    problem.size[0] = n


@inner
def begin_acting(state, problem):  # type: ignore[no-untyped-def]
    """Keep the list of all candidates, none of which acts, and list those with forces; returns how many all are."""
    count, n = problem.size[0], 0
    copy(problem.ports[:count], problem.candidates[:count])
    for i in problem.candidates[:count]:
        problem.acting[i] = False
        if state.unknown[i] != 0.0:
            problem.ports[n], problem.x[n] = i, state.unknown[i]
            n += 1
    problem.size[0] = n
    return count


@inner
def end_acting(problem, count):  # type: ignore[no-untyped-def]
    """List all candidates again."""
    copy(problem.candidates[:count], problem.ports[:count])
    problem.size[0] = count
