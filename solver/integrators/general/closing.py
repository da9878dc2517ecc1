"""Contact that closes or opens within a step: by how much its mean force differs from the trapezoidal rule."""

import numpy as np

from gudgeon.solver.compiled import embedded, inner
from gudgeon.solver.contact.pattern import between
from gudgeon.solver.integrators.general.arrays import CONE, POSITION, UNILATERAL
from gudgeon.solver.integrators.general.candidates import place, placed_late
from gudgeon.solver.integrators.general.rows import displaced, yielded
from gudgeon.solver.integrators.general.slides import BEFORE, NOW, coupling, displaced_over
from gudgeon.solver.integrators.general.solution.solve import add_means

SETTLED = 1e-6
"""Change of these means, relative to the largest force, at which they are found."""


@embedded
def set_extra(constants, state, problem):  # type: ignore[no-untyped-def]
    """Set by how much means differ from the trapezoidal rule where contact opens or closes; whether that changed.

    The measures that `problem.free` has are those with it.
    """
    if constants.plain and not _alters(state.last, state.unknown, state.extra):
        return False
    forces, change = (state.last, state.unknown, state.extra), 0.0
    count, largest = _list_altered(problem.ports[: problem.size[0]], forces, constants.size, problem.altered)
    for n in range(count):
        i = problem.altered[n]
        acts, acted, kind = state.unknown[i] != 0.0, state.last[i] != 0.0, constants.kind[i]
        if constants.size[i] == 0 or constants.level[i] != POSITION or kind not in (UNILATERAL, CONE):
            continue
        part = constants.share[i]
        share, given = 1.0, part * state.unknown[i] + (1.0 - part) * state.last[i]
        wakes = acts and state.extra[i] == 0.0 and not problem.awake[1, i] and placed_late(constants, i)
        if acts != acted:
            if wakes:
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
                if state.last[i + b] == 0.0 and state.extra[i + b] == 0.0 and not wakes:
                    state.response[1, i + b] = displaced(constants.residual, i + b, state.held, state.listed)
                state.extra[i + b] = wanted
    return change > SETTLED * largest


@inner
def _alters(last, unknown, extra):  # type: ignore[no-untyped-def]
    """Whether any port opens or closes, or has an extra mean."""
    some = 0
    for i in range(len(last)):
        some += ((last[i] != 0.0) != (unknown[i] != 0.0)) | (extra[i] != 0.0)
    return some > 0


@inner
def _list_altered(ports, forces, sizes, altered):  # type: ignore[no-untyped-def]
    """List the candidates that open or close or have an extra mean, and all cones; no branch could be foreseen.

    Args:
        forces: At the start and at the end of the step, and the extra means, of all ports [N].

    Returns:
        How many they are, and the largest force of all candidates [N].
    """
    last, unknown, extra = forces
    count, largest = 0, 0.0
    for i in ports:
        altered[count] = i
        count += ((unknown[i] != 0.0) != (last[i] != 0.0)) | (extra[i] != 0.0) | (sizes[i] >= 3)
        largest = max(largest, abs(unknown[i]))
    return count, largest


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
        forces = (state.held, state.last, state.unknown)
        return yielded(constants.residual, i, constants.memory, forces) + constants.layer[i] * state.unknown[i] - last
    total = displaced_over(constants, slides, i, NOW, (state.known, state.listed_known))
    # Of a port without a force, `state.response` is not kept from step to step.
    total -= displaced_over(constants, slides, i, BEFORE, (state.held, state.listed))
    for a in range(problem.size[0]):
        j = problem.ports[a]
        total += coupling(constants.pattern, constants.yields, slides, j, i) * state.unknown[j]
    return total - last
