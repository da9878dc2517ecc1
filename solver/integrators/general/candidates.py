"""Which ports may respond in a step, and their measures without the forces of the step's end."""

import numpy as np

from gudgeon.solver.compiled import copy, inner
from gudgeon.solver.integrators.general.arrays import (
    DRIVEN,
    LAW,
    POSITION,
    RUBBING_LAW,
    STABILISED,
    UNILATERAL,
    VELOCITY,
)
from gudgeon.solver.integrators.general.edges.kernel import clear, find_beside
from gudgeon.solver.integrators.general.impacts import speed_bound
from gudgeon.solver.integrators.general.rebounds import rebound
from gudgeon.solver.integrators.general.rows import displaced, four_in_a_row, moved, moved_four
from gudgeon.solver.integrators.general.slides import (
    BEFORE,
    displaced_over,
    found_gap,
    moved_over,
    reach_surfaces,
    slide,
)

SCRATCH = 1e-13
"""Share of its margin by which a sleeping point is round-off from waking."""
VANISHING = 1e-14
"""Share of the speeds of a point in rigid contact that is round-off, which no force follows."""
FORESIGHT = 2.0
"""What the forces of a step are expected to add to the paths, over what those of the last step did."""


@inner
def _used(near, norms, reach, path, i):  # type: ignore[no-untyped-def]
    """Return a bound of what a port can have moved over a path of its parts and of r [m]."""
    used = reach[i] * path[len(path) - 1]
    for n in range(4):
        used += norms[i, n] * path[near[i, n]]
    return used


@inner
def _look_ahead(constants, state, further, change):  # type: ignore[no-untyped-def]
    """Set the paths up to the state, with those that forces still add to coordinates [m kg^½] and to r [N]."""
    q, before, ranges, ahead = state.q, state.before[0], constants.parts, state.ahead
    for part in range(len(ranges)):
        length, now, then = 0.0, q[ranges[part, 0] : ranges[part, 1]], before[ranges[part, 0] : ranges[part, 1]]
        for k in range(len(now)):
            length += (now[k] - then[k]) ** 2
        ahead[part] = state.travel[part] + np.sqrt(length) + further
    ahead[len(ranges)] = state.travel[len(ranges)] + change


@inner
def _changed(constants, state):  # type: ignore[no-untyped-def]
    """Return Σ|Δr| of the step with the forces found [N]."""
    total, held, last, unknown = 0.0, state.held, state.last, state.unknown
    for s in range(len(held)):
        memory, own = constants.memory[s], held[s]
        kept, begin, end = memory[0], memory[1], memory[2]
        for i in range(len(own)):
            total += abs((kept[i] - 1.0) * own[i] + begin[i] * last[i] + end[i] * unknown[i])
    return total


@inner
def travelled(constants, state):  # type: ignore[no-untyped-def]
    """Set the paths up to the end of the step, before r is brought there."""
    state.lead[1] = _changed(constants, state)
    _look_ahead(constants, state, 0.0, state.lead[1])
    copy(state.ahead, state.travel)


@inner
def find_candidates(constants, state, problem):  # type: ignore[no-untyped-def]
    """List the ports that may respond in the step."""
    # What the forces add is foreseen, so that few points are woken after a solution.
    state.lead[2], state.lead[3] = FORESIGHT * state.lead[0], FORESIGHT * state.lead[1]
    _look_ahead(constants, state, state.lead[2], state.lead[3])
    if constants.slides and slide(constants, state):
        problem.size[1] = -1
    if constants.edged:
        find_beside(constants, state)
    near, norms, reach, ahead, margin = constants.near, constants.norms, constants.reach, state.ahead, state.margin
    for n in range(len(constants.touching)):
        i = constants.touching[n]
        problem.awake[1, i] = problem.awake[0, i]
        if state.slides.over[i]:
            beside = state.slides.corner[0, i] < 0
            state.slides.left[0] += beside and state.last[i] != 0.0
            problem.awake[0, i] = not beside and (state.last[i] != 0.0 or state.slides.free[i] <= 0.0)
            if not problem.awake[0, i]:
                state.unknown[i] = 0.0
        else:
            sleeps = margin[i] * (1.0 - SCRATCH) > _used(near, norms, reach, ahead, i)
            problem.awake[0, i] = state.last[i] != 0.0 or not (sleeps or state.beside[i])
        if problem.awake[0, i] and not problem.awake[1, i] and not placed_late(constants, i):
            place(constants, state, i)
    _list(constants, state, problem)


@inner
def placed_late(constants, i):  # type: ignore[no-untyped-def]
    """Whether a block needs its place at the start of a step only once it has a force."""
    return constants.kind[i] == UNILATERAL and constants.level[i] == POSITION


@inner
def place(constants, state, i):  # type: ignore[no-untyped-def]
    """Set where a block that wakes was at the start of the step [m]."""
    for b in range(i, i + constants.size[i]):
        response = displaced(constants.residual, b, state.held, state.listed)
        state.response[1, b] = response
        place = moved(constants.rows, b, state.before[0]) + response
        if state.slides.over[b]:
            place = moved_over(constants, state.slides, b, BEFORE, state.before[0])
            place += displaced_over(constants, state.slides, b, BEFORE, (state.held, state.listed))
        state.displacement[1, b] = constants.offset[b] + place
        state.anchor[b] = state.displacement[1, b]


@inner
def _list(constants, state, problem):  # type: ignore[no-untyped-def]
    """List the candidates; rigid contact is one where its gap closes without it."""
    count, same = 0, True
    for n in range(len(constants.touching) + len(constants.always)):
        touching = n < len(constants.touching)
        i = constants.touching[n] if touching else constants.always[n - len(constants.touching)]
        if touching and not problem.awake[0, i]:
            continue
        if touching and constants.level[i] == VELOCITY:
            state.closing[i] = -1.0
            if constants.divides:
                opened = not state.closed[i]
            else:
                opened = constants.offset[i] + moved(constants.rows, i, state.q) > 0.0
            if opened:
                for b in range(i, i + constants.size[i]):
                    state.unknown[b] = 0.0
                continue
        for b in range(i, i + constants.size[i]):
            same = same and count < problem.size[0] and problem.ports[count] == b
            problem.ports[count] = b
            count += 1
    if not same or count != problem.size[0]:
        problem.size[0], problem.size[1] = count, -1


@inner
def free_measures(constants, state, problem, crank):  # type: ignore[no-untyped-def]
    """Set the measures of the candidates without their forces of the step's end, and the approach of laws."""
    dt, n, ports, gap = constants.dt[0], problem.size[0], problem.ports, state.gap
    rows, offset, q, v, kinds, size = constants.rows, constants.offset, state.q, state.v, constants.kind, constants.size
    listed, a = ports[:n], 0
    while a < n:
        i = ports[a]
        if four_in_a_row(rows, listed, a):
            gap[i], gap[i + 1], gap[i + 2], gap[i + 3] = moved_four(rows, i, q)
            a += 4
        else:
            gap[i] = moved(rows, i, q)
            a += 1
    for a in range(n):
        gap[ports[a]] += offset[ports[a]]
        state.shift[ports[a]] = 0.0
    if state.listed_known[0] > 0:
        residual, known, listed = constants.residual, state.known, state.listed_known
        for a in range(n):
            i = ports[a]
            gap[i] += displaced(residual, i, known, listed)
    _set_free(constants, state, ports[:n])
    for j in range(len(constants.joints)):
        for axis in range(2):
            i = constants.joints[j] + axis
            gap[i] -= crank[j, axis]
            if constants.level[i] == STABILISED:
                gap[i] += 0.5 * dt * (moved(rows, i, v) - crank[j, 2 + axis])
    for d in range(len(constants.drives)):
        i = constants.drives[d]
        gap[i] -= state.wanted[d]
        if constants.level[i] == STABILISED:
            gap[i] += 0.5 * dt * moved(rows, i, v)
    if constants.bounces:
        for a in range(n):
            i = ports[a]
            first = constants.block[i]
            if constants.level[first] == VELOCITY:
                rate = moved(rows, i, v)
                state.rate[i] = rate
                if constants.divides:
                    wanted = constants.belt[i]
                    state.swift[i] = max(state.swift[i], speed_bound(constants, i, v))
                else:
                    wanted = constants.belt[i] if i > first else rebound(constants, state, i, rate)
                gap[i] = dt * (rate - wanted)
                if constants.divides and abs(rate - wanted) <= VANISHING * state.swift[first]:
                    gap[i] = 0.0
    for a in range(n):
        i = ports[a]
        if size[i] == 3 and constants.level[i] == POSITION and kinds[i] != DRIVEN:
            _touch((constants.belt, dt), (state.displacement[1], gap, state.anchor), state.last[i] == 0.0, i)
        if size[i] > 0 and (kinds[i] == LAW or kinds[i] == RUBBING_LAW):
            rate = (state.displacement[1, i] - gap[i]) / dt
            if state.displacement[1, i] >= 0.0 and gap[i] < 0.0 and state.approach[i] <= 0.0:
                state.fastest[0] = max(state.fastest[0], rate)
                state.approach[i] = max(rate, constants.floor * state.fastest[0])


@inner
def _set_free(constants, state, ports):  # type: ignore[no-untyped-def]
    """Set the gaps of points that slide over surfaces, and of those beside their faces."""
    if constants.slides:
        for i in ports:
            if state.slides.over[i]:
                state.gap[i] = state.slides.free[i]
    clear(constants, state, ports)


@inner
def _touch(obstacle, places, was_open, i):  # type: ignore[no-untyped-def]
    """Measure the tangents of a cone from their anchors; one that closes in the step, from where it does.

    Args:
        obstacle: Velocity of the obstacle, and the step [s].
        places: Displacements a step ago, measures and anchors of all ports.
    """
    belt, dt = obstacle
    before, gap, anchor = places
    begin, end = before[i], gap[i]
    for b in range(i + 1, i + 3):
        if was_open:
            share = begin / (begin - end) if begin > 0.0 >= end else (0.0 if end <= 0.0 else 1.0)
            anchor[b] = before[b] + share * (gap[b] - before[b])
            anchor[b] -= share * belt[b] * dt
        gap[b] -= anchor[b] + belt[b] * dt


@inner
def overlooked(constants, state, problem):  # type: ignore[no-untyped-def]
    """Wake the points that the forces found may have closed; whether there are any."""
    found, further = False, 0.0
    for a in range(problem.size[0]):
        i = problem.ports[a]
        amount = constants.share[i] * state.unknown[i] + state.extra[i]
        further += abs(amount) * constants.norm[i] * constants.farthest
    change = _changed(constants, state)
    state.lead[0] = further
    if further <= state.lead[2] and change <= state.lead[3] and not constants.slides:
        return False
    _look_ahead(constants, state, further, change)
    if constants.slides:
        reach_surfaces(constants, state, problem)
    near, norms, reach, ahead, margin = constants.near, constants.norms, constants.reach, state.ahead, state.margin
    for n in range(len(constants.touching)):
        i = constants.touching[n]
        if problem.awake[0, i]:
            continue
        if state.slides.over[i]:
            stays = state.slides.corner[0, i] < 0 or found_gap(constants, state, problem, i) > 0.0
        elif state.beside[i]:
            stays = True
        else:
            stays = margin[i] * (1.0 - SCRATCH) > _used(near, norms, reach, ahead, i)
        if not stays:
            problem.awake[0, i] = found = True
            if not placed_late(constants, i):
                place(constants, state, i)
    if found:
        _list(constants, state, problem)
    return found


@inner
def used_margins(constants, state, problem):  # type: ignore[no-untyped-def]
    """Set the margin of open points, which they use up by the path of the coordinates and by forces."""
    near, norms, reach, travel = constants.near, constants.norms, constants.reach, state.travel
    for n in range(len(constants.touching)):
        i = constants.touching[n]
        if not problem.awake[0, i]:
            continue
        gap = state.displacement[0, i]
        if state.unknown[i] == 0.0 and gap > 0.0:
            state.margin[i] = gap + _used(near, norms, reach, travel, i)
        else:
            state.margin[i] = 0.0
