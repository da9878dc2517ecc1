"""Which ports may respond in a step, and their measures without the forces of the step's end."""

from gudgeon.solver.compiled import copy, embedded, inner
from gudgeon.solver.integrators.general.arrays import (
    CONE,
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
from gudgeon.solver.integrators.general.rows import bound_ways, displaced, four_alike, look_ahead, moved, moved_four
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


@embedded
def _add_forces(constants, state):  # type: ignore[no-untyped-def]
    """Set what the forces found add to the paths: of the step's end to coordinates, and Σ|Δr| of the step.

    Returns:
        Whether that is as much as was allowed for.
    """
    lead, near, norms, share, parts = state.lead[0], constants.near, constants.norms, constants.share, constants.parts
    unknown, last, extra, sides = state.unknown, state.last, state.extra, constants.sides
    lead[:] = 0.0
    for group in range(len(constants.groups)):
        first, end = constants.groups[group, 0], constants.groups[group, 1]
        reach, part, now, more = constants.farthest[first:end], share[first:end], unknown[first:end], extra[first:end]
        a, b, c, d = norms[0, first:end], norms[1, first:end], norms[2, first:end], norms[3, first:end]
        one, two, three, four = 0.0, 0.0, 0.0, 0.0
        for k in range(len(now)):
            amount = reach[k] * abs(part[k] * now[k] + more[k])
            one += amount * a[k]
            two += amount * b[k]
            three += amount * c[k]
            four += amount * d[k]
        lead[near[first, 0]] += one
        lead[near[first, 1]] += two
        lead[near[first, 2]] += three
        lead[near[first, 3]] += four
    for s in range(len(state.held)):
        memory, held = constants.memory[s], state.held[s]
        for group in range(len(constants.groups)):
            first, end = constants.groups[group, 0], constants.groups[group, 1]
            kept, by_last, by_now = memory[0, first:end], memory[1, first:end], memory[2, first:end]
            own, then, now, total = held[first:end], last[first:end], unknown[first:end], 0.0
            for k in range(len(own)):
                total += abs((kept[k] - 1.0) * own[k] + by_last[k] * then[k] + by_now[k] * now[k])
            for side in range(2):
                if sides[first, side] >= 0 and (side == s or len(state.held) == 1):
                    lead[len(parts) + sides[first, side]] += total
    enough = True
    for part in range(len(lead)):
        enough = enough and lead[part] <= state.lead[1, part]
    return enough


@embedded
def travelled(constants, state):  # type: ignore[no-untyped-def]
    """Set the paths up to the end of the step; what r changes in it was found with its forces."""
    # That of the coordinates by forces is in them.
    allowed, parts = state.lead[1], len(constants.parts)
    for part in range(len(allowed)):
        allowed[part] = state.lead[0, part] if part >= parts else 0.0
    look_ahead(constants.parts, (state.q, state.before[0]), state.travel, allowed, state.ahead)
    copy(state.ahead, state.travel)


@embedded
def find_candidates(constants, state, problem):  # type: ignore[no-untyped-def]
    """Set which ports of contacts may respond in the step."""
    # What the forces add is foreseen, so that few points are woken after a solution.
    for part in range(len(state.travel)):
        state.lead[1, part] = FORESIGHT * state.lead[0, part]
    look_ahead(constants.parts, (state.q, state.before[0]), state.travel, state.lead[1], state.ahead)
    if constants.slides and slide(constants, state):
        problem.size[1] = -1
    if constants.edged:
        find_beside(constants, state)
    bounds = (constants.near, constants.sides, constants.norms, constants.reach)
    bound_ways(constants.met, bounds, state.ahead, state.way)
    if constants.plain:
        _wake(constants.met, (state.margin, state.way, state.last, state.beside), problem.awake)
        return
    margin, way, last, awake = state.margin, state.way, state.last, problem.awake
    for n in range(len(constants.touching)):
        i = constants.touching[n]
        before = awake[0, i]
        awake[1, i] = before
        if state.slides.over[i]:
            beside = state.slides.corner[0, i] < 0
            state.slides.left[0] += beside and last[i] != 0.0
            now = not beside and (last[i] != 0.0 or state.slides.free[i] <= 0.0)
            if not now:
                state.unknown[i] = 0.0
        else:
            sleeps = margin[i] * (1.0 - SCRATCH) > way[i]
            now = last[i] != 0.0 or not (sleeps or state.beside[i])
        awake[0, i] = now
        if now and not before and not placed_late(constants, i):
            place(constants, state, i)


@inner
def _wake(met, ports, awake):  # type: ignore[no-untyped-def]
    """Set which points of contacts may respond in the step, where all need their places late.

    Args:
        ports: Margins, bounds of ways, forces a step ago, and whether they are beside faces, of all ports.
    """
    margin, way, last, beside = ports
    for group in range(len(met)):
        first, end = met[group, 0], met[group, 1]
        a, b, c, d = margin[first:end], way[first:end], last[first:end], beside[first:end]
        now, before = awake[0, first:end], awake[1, first:end]
        for k in range(len(now)):
            before[k] = now[k]
            now[k] = (c[k] != 0.0) | ((a[k] * (1.0 - SCRATCH) <= b[k]) & (not d[k]))


@embedded
def placed_late(constants, i):  # type: ignore[no-untyped-def]
    """Whether a block needs its place at the start of a step only once it closes."""
    return constants.kind[i] in (UNILATERAL, CONE) and constants.level[i] == POSITION


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


@embedded
def list_candidates(constants, state, problem):  # type: ignore[no-untyped-def]
    """List the candidates; rigid contact is one where its gap closes without it."""
    ports, awake, begin, end = problem.ports, problem.awake[0], 0, len(constants.touching) + len(constants.always)
    count, same = 0, True
    if constants.plain:
        count, same = _list_awake(constants.touching, awake, ports)
        begin = len(constants.touching)
    for n in range(begin, end):
        touching = n < len(constants.touching)
        i = constants.touching[n] if touching else constants.always[n - len(constants.touching)]
        if touching and not awake[i]:
            continue
        if constants.bounces and touching and constants.level[i] == VELOCITY:
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
            same = same and ports[count] == b
            ports[count] = b
            count += 1
    if not same or count != problem.size[0]:
        problem.size[0] = count
        if constants.plain:
            problem.size[1] = -1


@inner
def _list_awake(touching, awake, ports):  # type: ignore[no-untyped-def]
    """List the contacts that are awake, where each has one port; no branch could be foreseen.

    Returns:
        How many they are, and whether the list had them.
    """
    count, others = 0, 0
    for i in touching:
        kept, wakes = ports[count], awake[i]
        others += wakes & (kept != i)
        ports[count] = i if wakes else kept
        count += wakes
    return count, others == 0


@embedded
def free_measures(constants, state, problem, crank):  # type: ignore[no-untyped-def]
    """Set the measures of the candidates without their forces of the step's end, and the approach of laws."""
    dt, n, ports, gap = constants.dt[0], problem.size[0], problem.ports, state.gap
    rows, offset, q, v, kinds, size = constants.rows, constants.offset, state.q, state.v, constants.kind, constants.size
    listed, a = ports[:n], 0
    while a < n:
        i = ports[a]
        if four_alike(constants.pattern.group, listed, a):
            j, k, m = ports[a + 1], ports[a + 2], ports[a + 3]
            one, two, three, four = moved_four(rows, (i, j, k, m), q)
            gap[i], gap[j] = offset[i] + one, offset[j] + two
            gap[k], gap[m] = offset[k] + three, offset[m] + four
            a += 4
        else:
            gap[i] = offset[i] + moved(rows, i, q)
            a += 1
    if state.listed_known[0] > 0:
        for a in range(n):
            gap[ports[a]] += displaced(constants.residual, ports[a], state.known, state.listed_known)
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
            state.shift[i] = 0.0
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
    for a in range(0 if constants.plain else n):
        i = ports[a]
        if size[i] == 3 and constants.level[i] == POSITION and kinds[i] != DRIVEN:
            if gap[i] <= 0.0 and not problem.awake[1, i] and placed_late(constants, i):
                place(constants, state, i)
            _touch((constants.belt, dt), (state.displacement[1], gap, state.anchor), state.last[i] == 0.0, i)
        if size[i] > 0 and (kinds[i] == LAW or kinds[i] == RUBBING_LAW):
            rate = (state.displacement[1, i] - gap[i]) / dt
            if state.displacement[1, i] >= 0.0 and gap[i] < 0.0 and state.approach[i] <= 0.0:
                state.fastest[0] = max(state.fastest[0], rate)
                state.approach[i] = max(rate, constants.floor * state.fastest[0])


@embedded
def _set_free(constants, state, ports):  # type: ignore[no-untyped-def]
    """Set the gaps of points that slide over surfaces, and of those beside their faces."""
    if constants.slides:
        for i in ports:
            if state.slides.over[i]:
                state.gap[i] = state.slides.free[i]
    if constants.edged:
        clear(constants, state, ports)


@inner
def _touch(obstacle, places, was_open, i):  # type: ignore[no-untyped-def]
    """Measure the tangents of a cone from their anchors; one that closes in the step, from where it does.

    One that forces may still close in it does so at its end.

    Args:
        obstacle: Velocity of the obstacle, and the step [s].
        places: Displacements a step ago, measures and anchors of all ports.
    """
    belt, dt = obstacle
    before, gap, anchor = places
    begin, end = before[i], gap[i]
    for b in range(i + 1, i + 3):
        if was_open and end > 0.0:
            anchor[b] = gap[b] - belt[b] * dt
        elif was_open:
            share = begin / (begin - end) if begin > 0.0 else 0.0
            anchor[b] = before[b] + share * (gap[b] - before[b])
            anchor[b] -= share * belt[b] * dt
        gap[b] -= anchor[b] + belt[b] * dt


@embedded
def overlooked(constants, state, problem):  # type: ignore[no-untyped-def]
    """Wake the points that the forces found may have closed; whether there are any."""
    found, enough = False, _add_forces(constants, state)
    if constants.slides or not enough:
        look_ahead(constants.parts, (state.q, state.before[0]), state.travel, state.lead[0], state.ahead)
        if constants.slides:
            reach_surfaces(constants, state, problem)
        bounds = (constants.near, constants.sides, constants.norms, constants.reach)
        bound_ways(constants.met, bounds, state.ahead, state.way)
        for n in range(len(constants.touching)):
            i = constants.touching[n]
            if problem.awake[0, i]:
                continue
            if state.slides.over[i]:
                stays = state.slides.corner[0, i] < 0 or found_gap(constants, state, problem, i) > 0.0
            elif state.beside[i]:
                stays = True
            else:
                stays = state.margin[i] * (1.0 - SCRATCH) > state.way[i]
            if not stays:
                problem.awake[0, i] = found = True
                if not placed_late(constants, i):
                    place(constants, state, i)
    return found


@embedded
def used_margins(constants, state, problem):  # type: ignore[no-untyped-def]
    """Set the margin of open points, which they use up by the path of the coordinates and by forces."""
    bounds = (constants.near, constants.sides, constants.norms, constants.reach)
    bound_ways(constants.met, bounds, state.travel, state.way)
    if constants.plain:
        _keep_margins(constants.met, (state.displacement[0], state.way, state.unknown, problem.awake[0]), state.margin)
        return
    for n in range(len(constants.touching)):
        i = constants.touching[n]
        if problem.awake[0, i]:
            gap = state.displacement[0, i]
            state.margin[i] = gap + state.way[i] if state.unknown[i] == 0.0 and gap > 0.0 else 0.0


@inner
def _keep_margins(met, ports, margin):  # type: ignore[no-untyped-def]
    """Set the margin of points that are awake, where each has one port.

    Args:
        ports: Gaps, bounds of ways, forces, and whether they are awake, of all ports.
    """
    gaps, way, unknown, awake = ports
    for group in range(len(met)):
        first, end = met[group, 0], met[group, 1]
        a, b, c, d, out = gaps[first:end], way[first:end], unknown[first:end], awake[first:end], margin[first:end]
        for k in range(len(out)):
            new = a[k] + b[k] if (c[k] == 0.0) & (a[k] > 0.0) else 0.0
            out[k] = new if d[k] else out[k]
