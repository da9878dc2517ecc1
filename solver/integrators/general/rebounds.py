"""Rigid contact that closes within a step: when it does, what it asks for, and what its impulse moves."""

import numpy as np

from gudgeon.solver.compiled import inner
from gudgeon.solver.integrators.general.arrays import STABILISED, VELOCITY
from gudgeon.solver.integrators.general.rows import moved, push
from gudgeon.solver.integrators.general.slides import coupling

SETTLED = 1e-6
"""Change of where ports are, relative to the way of rigid contact in a step, at which they are found."""
FAR = 1e9
"""Gap of what does not close, over the largest measure."""


@inner
def rebound(constants, state, i, rate):  # type: ignore[no-untyped-def]
    """Return the velocity [m/s] that rigid contact asks for at the end of the step, and set when it closes in it.

    What closes at the share θ of the step rebounds by e of its velocity there, and then moves on freely; or it stays,
    where its force would close it again: then only a part of the impulse, `sudden`, acts when it closes.
    """
    begin, before = state.displacement[1, i], moved(constants.rows, i, state.before[1])
    end = constants.offset[i] + moved(constants.rows, i, state.q)
    state.closing[i] = -1.0
    if begin > 0.0 > end:
        bend = 0.5 * constants.dt[0] * (rate - before)
        slope = end - begin - bend
        state.closing[i] = 2.0 * begin / (np.sqrt(slope * slope - 4.0 * bend * begin) - slope)
    share = max(0.0, state.closing[i])
    hit = before + share * (rate - before)
    wanted = (1.0 - share) * (rate - before) - constants.restitution[i] * min(0.0, hit)
    state.sudden[i] = 1.0 if wanted > 0.0 or rate >= 0.0 else min(1.0, max(0.0, hit / rate))
    return max(0.0, wanted)


@inner
def keep_open(constants, state, problem):  # type: ignore[no-untyped-def]
    """Keep rigid contact from closing, so that the forces of all other ports are found without it.

    Returns:
        Whether there are rigid contact and other ports among the candidates.
    """
    far, rigid, others = 0.0, False, False
    for a in range(problem.size[0]):
        i = problem.ports[a]
        far = max(far, abs(state.gap[i]))
        if constants.level[constants.block[i]] == VELOCITY:
            rigid = True
        else:
            others = True
    if not (rigid and others):
        return False
    for a in range(problem.size[0]):
        i = problem.ports[a]
        if constants.level[constants.block[i]] == VELOCITY:
            state.unknown[i] = 0.0
            state.gap[i] = FAR * far if constants.block[i] == i else 0.0
    return True


@inner
def foresee(constants, state, problem):  # type: ignore[no-untyped-def]
    """Set what rigid contact asks for where all other ports have the forces found without it."""
    for a in range(problem.size[0]):
        i = problem.ports[a]
        first = constants.block[i]
        state.foreseen[i] = state.unknown[i]
        if constants.level[first] != VELOCITY:
            continue
        own = state.rate[i]
        for b in range(problem.size[0]):
            j = problem.ports[b]
            moves = coupling(constants.pattern, constants.columns, state.slides, j, i)
            state.rate[i] += moves * state.unknown[j] / constants.dt[0]
        wanted = constants.belt[i] if i > first else rebound(constants, state, i, state.rate[i])
        state.gap[i] = constants.dt[0] * (own - wanted)


@inner
def shifts_change(constants, state, problem):  # type: ignore[no-untyped-def]
    """Move other ports by the impulses of rigid contact when these act; whether that changed where they are."""
    changed, way = 0.0, 0.0
    average = _average(constants, state, problem)
    for a in range(problem.size[0]):
        i = problem.ports[a]
        if constants.level[constants.block[i]] == VELOCITY:
            way = max(way, constants.dt[0] * abs(state.rate[i]))
            continue
        shift = 0.0
        for b in range(problem.size[0]):
            j = problem.ports[b]
            amount = _sudden(constants, state, j, average)
            if amount != 0.0:
                shift += amount * coupling(constants.pattern, constants.inertia, state.slides, j, i)
        changed = max(changed, abs(shift - state.shift[i]))
        state.gap[i] += shift - state.shift[i]
        state.shift[i] = shift
    return changed > SETTLED * way


@inner
def _earlier(constants, state, i):  # type: ignore[no-untyped-def]
    """Return by which share of the step the impulse of rigid contact acts earlier than over the whole step."""
    first = constants.block[i]
    share, sudden = state.closing[first], state.sudden[first]
    return sudden * (0.5 - share) - (1.0 - sudden) * 0.5 * share if share >= 0.0 else 0.0


@inner
def _average(constants, state, problem):  # type: ignore[no-untyped-def]
    """Return the mean of `_earlier` over the impulses of the step: that of the impulses that joints answer with."""
    total, weighted = 0.0, 0.0
    for a in range(problem.size[0]):
        i = problem.ports[a]
        if constants.level[i] == VELOCITY and constants.block[i] == i and state.closing[i] >= 0.0:
            total += abs(state.unknown[i])
            weighted += abs(state.unknown[i]) * _earlier(constants, state, i)
    return weighted / total if total > 0.0 else 0.0


@inner
def _sudden(constants, state, i, average):  # type: ignore[no-untyped-def]
    """Return the force of a port over the step [N] times the share of it by which it acts earlier.

    A joint or drive without a compliance of its own answers impulses with an impulse, beside its force without them.
    """
    level = constants.level[constants.block[i]]
    if level == VELOCITY:
        return _earlier(constants, state, i) * state.unknown[i]
    if level == STABILISED:
        return average * (state.unknown[i] - state.foreseen[i])
    return 0.0


@inner
def strike(constants, state, problem):  # type: ignore[no-untyped-def]
    """Let impulses of rigid contact that closes within the step act when it closes and from then on."""
    by_v, q, second = constants.push[1], state.q, state.rest[0]
    second[:] = 0.0
    average = _average(constants, state, problem)
    state.average[0] = average
    for a in range(problem.size[0]):
        i = problem.ports[a]
        amount = _sudden(constants, state, i, average)
        if amount != 0.0:
            push(constants.rows, i, amount, second)
    for k in range(len(q)):
        q[k] += constants.dt[0] * by_v[k] * second[k]
