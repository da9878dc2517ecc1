"""Contact that closes or opens within a step: by how much its mean force differs from the trapezoidal rule."""

import numpy as np

from gudgeon.solver.compiled import embedded
from gudgeon.solver.contact.pattern import between
from gudgeon.solver.integrators.general.arrays import CONE, POSITION, UNILATERAL
from gudgeon.solver.integrators.general.candidates import place, placed_late
from gudgeon.solver.integrators.general.rows import displaced
from gudgeon.solver.integrators.general.slides import BEFORE, NOW, coupling, displaced_over
from gudgeon.solver.integrators.general.solution.solve import add_means

SETTLED = 1e-6
"""Change of these means, relative to the largest force, at which they are found."""


@embedded
def set_extra(constants, state, problem):  # type: ignore[no-untyped-def]
    """Set by how much means differ from the trapezoidal rule where contact opens or closes; whether that changed.

    The measures that `problem.free` has are those with it.
    """
    largest, change = 0.0, 0.0
    for a in range(problem.size[0]):
        i = problem.ports[a]
        largest = max(largest, abs(state.unknown[i]))
        acts, acted = state.unknown[i] != 0.0, state.last[i] != 0.0
        if acts == acted and state.extra[i] == 0.0 and constants.size[i] < 3:
            continue
        kind = constants.kind[i]
        if constants.size[i] == 0 or constants.level[i] != POSITION or kind not in (UNILATERAL, CONE):
            continue
        part = constants.share[i]
        share, given = 1.0, part * state.unknown[i] + (1.0 - part) * state.last[i]
        if acts != acted:
            if acts and not problem.awake[1, i] and placed_late(constants, i):
                place(constants, state, i)
            share, given = _closed_share(constants, state, problem, i)
        for b in range(constants.size[i]):
            if b > 0:
                given = part * state.unknown[i + b] + (1.0 - part) * state.last[i + b]
            wanted = (share - 1.0) * given
            step = wanted - state.extra[i + b]
            if step != 0.0:
                change = max(change, abs(step))
                add_means(constants, state, problem, i + b, step)
                state.extra[i + b] = wanted
                if state.last[i + b] == 0.0:
                    state.response[1, i + b] = displaced(constants.residual, i + b, state.held, state.listed)
    return change > SETTLED * largest


@embedded
def _closed_share(constants, state, problem, i):  # type: ignore[no-untyped-def]
    """Return the share of the step in which a port that closes or opens is closed, and its mean force without it [N].

    They solve share · force · (way of the coordinates) = −force · (way of the compliance), so that the port does the
    work that its compliance takes, with the forces of other ports as they are.
    """
    extra, part, now, last = state.extra[i], constants.share[i], state.unknown[i], state.last[i]
    if constants.slides:
        inertia = coupling(constants.pattern, constants.inertia, state.slides, i, i)
        own = coupling(constants.pattern, constants.columns, state.slides, i, i) - part * inertia
    else:
        inertia = between(constants.pattern, constants.inertia, i, i)
        own = between(constants.pattern, constants.yields, i, i)
    way = _yields(constants, state, problem, i)
    if now > 0.0:
        begin, force = max(0.0, state.displacement[1, i]), part * now
        if begin == 0.0 or own <= 0.0:
            return 1.0, force
        way = way if way > 0.0 else own * now
        depth = way + inertia * (force + extra)
        one = 1.0 + inertia * force / way
        root = np.sqrt(max(0.0, (depth - begin) ** 2 + 4.0 * one * depth * begin))
        found = max(0.0, 0.5 * (depth - begin + root) / one)
        return found / (found + begin), force * found / way
    end, force = max(0.0, state.measure[i] - inertia * extra), (1.0 - part) * last
    if end == 0.0 or own <= 0.0:
        return 1.0, force
    way = way if way < 0.0 else -own * last
    less = end + way - force * inertia
    end = 0.5 * (less + np.sqrt(less * less - 4.0 * end * way))
    return way / (way - end), force


@embedded
def _yields(constants, state, problem, i):  # type: ignore[no-untyped-def]
    """Return by how much the compliance of a port gives way in the step under all forces found [m]."""
    slides, last = state.slides, constants.layer[i] * state.last[i]
    if not constants.slides:
        total = displaced(constants.residual, i, state.known, state.listed_known)
        total -= displaced(constants.residual, i, state.held, state.listed)
        for a in range(problem.size[0]):
            j = problem.ports[a]
            amount = state.unknown[j]
            if amount != 0.0:
                total += between(constants.pattern, constants.yields, j, i) * amount
        return total - last
    total = displaced_over(constants, slides, i, NOW, (state.known, state.listed_known))
    # Of a port without a force, `state.response` is not kept from step to step.
    total -= displaced_over(constants, slides, i, BEFORE, (state.held, state.listed))
    for a in range(problem.size[0]):
        j = problem.ports[a]
        total += coupling(constants.pattern, constants.yields, slides, j, i) * state.unknown[j]
    return total - last
