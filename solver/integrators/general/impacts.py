"""Rigid contact that closes within a step: the step is divided there, so that impacts act when and as they happen.

Bodies fly until the first gap closes; what touches then and approaches rebounds by Newton's law, u̇⁺ + e u̇⁻ ≥ 0
complementary to its impulse, with Coulomb's cone for friction, together with all that is closed. A point that
rebounds again within `COLLAPSE` of a step stays closed.
"""

import numpy as np

from gudgeon.solver.compiled import copy, inner, unpacked
from gudgeon.solver.contact.pattern import between
from gudgeon.solver.integrators.balance import note_exchange
from gudgeon.solver.integrators.general.arrays import POSITION, VELOCITY
from gudgeon.solver.integrators.general.energy import CONTACT, DISSIPATED, KINETIC, WORK
from gudgeon.solver.integrators.general.rows import moved, push
from gudgeon.solver.integrators.general.solution.solve import solve
from gudgeon.solver.integrators.impact_log import add_jump, note_change, note_impact
from gudgeon.solver.integrators.outcome import EXCHANGED

COLLAPSE = 1e-6
"""Share of a step within which a point that rebounds again stays closed: rebounds follow each other without end."""
REACHED = 1e-10
"""Way in a step that is left of a gap when it closes, as a share."""
STILL = 1e-9
"""Share of its largest speed so far below which a point neither approaches nor parts."""
SLIPS = 1e-9
"""Share by which friction is below its limit, and slip ends before a part of a step does, where it does."""
ROUND_OFF = 64 * 2.0**-52


@inner
def retime(loop, step):  # type: ignore[no-untyped-def]
    """Set the motion of undamped coordinates over a part of a step [s], and what ports do in it."""
    arrays, part = unpacked(loop.whole), unpacked(loop.part).constants
    whole = arrays.constants
    part.dt[0], arrays.problem.size[1] = step, -1
    motion, pushes = part.motion, part.push
    for k in range(len(whole.stiffness)):
        square = whole.stiffness[k]
        omega = np.sqrt(square)
        sine = np.sin(omega * step)
        motion[0, k] = motion[3, k] = np.cos(omega * step)
        motion[1, k] = sine / omega if square > 0.0 else step
        motion[2, k] = -omega * sine
        half = np.sin(0.5 * omega * step)
        pushes[0, k] = 2.0 * half * half / square if square > 0.0 else 0.5 * step * step
        pushes[1, k] = motion[1, k]
    _couple(whole, part, arrays.state)


@inner
def _couple(whole, part, state):  # type: ignore[no-untyped-def]
    """Set what forces of a part of a step do to the measures of ports."""
    by_q, by_v, step = part.push[0], part.push[1], part.dt[0]
    rows, level, share = whole.rows, whole.level, whole.share
    place, rate, pattern = state.ends[0], state.ends[1], whole.pattern
    for j in range(len(level)):
        place[:] = 0.0
        push(rows, j, 1.0, place)
        for k in range(len(place)):
            rate[k] = step * by_v[k] * place[k]
            place[k] *= by_q[k]
        own = pattern.group[j]
        for r in range(pattern.span[own, 0], pattern.span[own, 1]):
            for i in range(pattern.runs[r, 0], pattern.runs[r, 1]):
                at = pattern.at[j] + pattern.runs[r, 2] + i
                reach = moved(rows, i, rate) if level[i] == VELOCITY else moved(rows, i, place)
                part.inertia[at] = reach
                part.columns[at] = share[j] * reach + (whole.yields[at] if level[i] == POSITION else 0.0)


@inner
def fall(constants, state, problem):  # type: ignore[no-untyped-def]
    """Set where coordinates are at the end of a part of the step with the forces found."""
    place, rate, force = state.ends[0], state.ends[1], state.rest[0]
    force[:] = 0.0
    for a in range(problem.size[0]):
        i = problem.ports[a]
        part = 0.5 if constants.share[i] < 1.0 else 1.0
        amount = part * state.unknown[i] + state.extra[i]
        if amount != 0.0:
            push(constants.rows, i, amount, force)
    for k in range(len(place)):
        place[k] = state.q[k] + constants.push[0][k] * force[k]
        rate[k] = state.v[k] + constants.push[1][k] * force[k]


@inner
def speed_bound(constants, i, values):  # type: ignore[no-untyped-def]
    """Return a bound of W times values of the coordinates of one port, of the size of their round-off."""
    total = 0.0
    for n in range(4):
        if constants.norms[n, i] != 0.0:
            square, part = 0.0, constants.parts[constants.near[i, n]]
            for k in range(part[0], part[1]):
                square += values[k] * values[k]
            total += constants.norms[n, i] * np.sqrt(square)
    return total


@inner
def still(constants, state, i):  # type: ignore[no-untyped-def]
    """Return the speed [m/s] below which a point neither approaches nor parts."""
    state.swift[i] = max(state.swift[i], speed_bound(constants, i, state.v))
    return STILL * state.swift[i]


@inner
def _reached(constants, state, i, whole):  # type: ignore[no-untyped-def]
    """Return the gap [m] at which a point touches."""
    rate = max(abs(moved(constants.rows, i, state.before[1])), abs(moved(constants.rows, i, state.ends[1])))
    size = abs(constants.offset[i]) + speed_bound(constants, i, state.ends[0])
    return REACHED * whole * rate + ROUND_OFF * size


@inner
def first_closing(constants, state, problem, whole):  # type: ignore[no-untyped-def]
    """Return the point whose gap closes first in a part of the step and when [s]; −1 where none does.

    Args:
        whole: Length of the step [s].
    """
    found, when, step = -1, constants.dt[0], constants.dt[0]
    for n in range(len(constants.touching)):
        i = constants.touching[n]
        if constants.level[i] != VELOCITY or state.closed[i] or not problem.awake[0, i]:
            continue
        begin, speed = state.displacement[1, i], moved(constants.rows, i, state.before[1])
        end = constants.offset[i] + moved(constants.rows, i, state.ends[0])
        # A gap below zero by round-off is none.
        begin, end = max(0.0, begin), end - min(0.0, begin)
        bend = 2.0 * (end - begin - speed * step) / (step * step)
        allowed = _reached(constants, state, i, whole)
        dips = bend > 0.0 and 0.0 < -speed < bend * step and 0.5 * speed * speed / bend > begin + allowed
        if not (end < -allowed or dips):
            continue
        root = np.sqrt(max(0.0, speed * speed - 2.0 * bend * begin))
        time = 2.0 * begin / (root - speed) if speed < 0.0 else -(speed + root) / bend
        if found < 0 or time < when:
            found, when = i, time
    return found, when


@inner
def first_turning(kept, loop):  # type: ignore[no-untyped-def]
    """Return when the slip of a closed point first ends in a part of the step [s], and set which does.

    Friction at its limit brakes u̇ by D from the velocity u₀ on, besides what other forces do: u₀ = t (D − a).
    """
    arrays, mobility = unpacked(kept), unpacked(loop.impact).constants.columns
    constants, state, problem = arrays.constants, arrays.state, arrays.problem
    when, step = constants.dt[0], constants.dt[0]
    state.turning[0] = -1
    for a in range(problem.size[0]):
        i = problem.ports[a]
        if constants.level[i] != VELOCITY or constants.size[i] != 3 or state.unknown[i] == 0.0:
            continue
        first = moved(constants.rows, i + 1, state.before[1]) - constants.belt[i + 1]
        second = moved(constants.rows, i + 2, state.before[1]) - constants.belt[i + 2]
        begin = np.sqrt(first * first + second * second)
        if begin <= still(constants, state, i):
            continue
        first, second = first / begin, second / begin
        end = first * (moved(constants.rows, i + 1, state.ends[1]) - constants.belt[i + 1])
        end += second * (moved(constants.rows, i + 2, state.ends[1]) - constants.belt[i + 2])
        brake, limit = -first * state.unknown[i + 1] - second * state.unknown[i + 2], constants.friction[i, 1]
        limit *= state.unknown[i]
        reach = first * first * between(constants.pattern, mobility, i + 1, i + 1)
        reach += second * second * between(constants.pattern, mobility, i + 2, i + 2)
        reach += 2.0 * first * second * between(constants.pattern, mobility, i + 1, i + 2)
        left = reach * (limit - brake) + (begin - end) / step
        if brake < limit * (1.0 - SLIPS) and left > 0.0 and begin / left < when * (1.0 - SLIPS):
            state.turning[0], when = i, begin / left
    return when


@inner
def time_left(constants, state, i, whole):  # type: ignore[no-untyped-def]
    """Return how long after the end of a part of the step a point touches [s]; 0 where it does."""
    gap, rate = constants.offset[i] + moved(constants.rows, i, state.ends[0]), moved(constants.rows, i, state.ends[1])
    if gap <= _reached(constants, state, i, whole):
        return 0.0
    return gap / -rate if rate < 0.0 else whole


@inner
def collide(loop, number, time):  # type: ignore[no-untyped-def]
    """Let all rigid contact that touches and approaches rebound; False where the impulses are not found.

    Args:
        number: Of the step.
        time: [s]
    """
    arrays = unpacked(loop.whole)
    state, problem = arrays.state, arrays.problem
    if not _touching(loop, time):
        return True
    count = problem.size[0]
    sound = solve(loop.impact)
    for a in range(count):
        i = problem.ports[a]
        state.sudden_impulses[1, i], state.unknown[i] = state.unknown[i], state.foreseen[i]
    if sound:
        _strike(arrays, number, time)
    problem.size[0], problem.size[1] = 0, -1
    return sound


@inner
def _touching(loop, time):  # type: ignore[no-untyped-def]
    """List rigid contact that touches, with what it asks for, where any of it approaches; whether any does."""
    arrays, whole = unpacked(loop.impact), unpacked(loop.whole).constants.dt[0]
    constants, state, problem, count, strikes = arrays.constants, arrays.state, arrays.problem, 0, False
    copy(state.q, state.ends[0])
    copy(state.v, state.ends[1])
    copy(state.v, state.before[1])
    for n in range(len(constants.touching)):
        i = constants.touching[n]
        if constants.level[i] != VELOCITY or not problem.awake[0, i]:
            continue
        if state.closed[i] or state.displacement[0, i] <= _reached(constants, state, i, whole):
            rate, least = moved(constants.rows, i, state.v), still(constants, state, i)
            strikes = strikes or rate < -least
            state.closed[i] = state.closed[i] or rate <= least
    if not strikes:
        return False
    for n in range(len(constants.touching)):
        i = constants.touching[n]
        if not state.closed[i] or constants.level[i] != VELOCITY:
            continue
        rate, least = moved(constants.rows, i, state.v), still(constants, state, i)
        bounces = rate < -least and time - state.since[i] > COLLAPSE * whole
        state.rate[i] = rate
        state.gap[i] = rate + (constants.restitution[i] * rate if bounces else 0.0)
        for b in range(i, i + constants.size[i]):
            if b > i:
                state.rate[b] = moved(constants.rows, b, state.v)
                state.gap[b] = state.rate[b] - constants.belt[b]
            state.foreseen[b] = state.unknown[b]
            state.unknown[b] = 0.0
            problem.ports[count] = b
            count += 1
    problem.size[0], problem.size[1] = count, -1
    return True


@inner
def _strike(arrays, number, time):  # type: ignore[no-untyped-def]
    """Move bodies by the impulses found, account for them, and see what parts."""
    constants, state, problem, log = arrays.constants, arrays.state, arrays.problem, arrays.log
    impulses, change = state.sudden_impulses[1], state.rest[0]
    change[:] = 0.0
    for a in range(problem.size[0]):
        i = problem.ports[a]
        if impulses[i] != 0.0:
            push(constants.rows, i, impulses[i], change)
    for k in range(len(state.v)):
        state.v[k] += change[k]
    _exchange(constants, state, change)
    lost, kinetic, taken = 0.0, 0.0, 0.0
    for a in range(problem.size[0]):
        i = problem.ports[a]
        state.impulses[i] += impulses[i]
        state.sudden_impulses[0, i] += impulses[i]
        middle = 0.5 * (state.rate[i] + moved(constants.rows, i, state.v))
        own = -impulses[i] * (middle - constants.belt[i])
        lost += own
        state.parts[WORK] += impulses[i] * constants.belt[i]
        if constants.block[i] != i:
            state.rubbed[constants.contact[i]] += own
        else:
            taken -= 0.5 * impulses[i] * min(0.0, state.rate[i]) / (1.0 + constants.restitution[i])
    state.extreme[EXCHANGED] = max(state.extreme[EXCHANGED], taken)
    for k in range(len(state.v)):
        kinetic += state.v[k] * state.v[k]
    state.parts[KINETIC] = 0.5 * kinetic
    if lost > 0.0:  # No impact creates energy: that of a wrong impulse shall appear as drift.
        state.parts[DISSIPATED] += lost
    for a in range(problem.size[0]):
        i = problem.ports[a]
        if constants.block[i] != i:
            continue
        k = constants.contact[i]
        if impulses[i] != 0.0:
            note_impact(log, k, number, time, state.rate[i])
            state.since[i] = time
            for axis in range(3):
                add_jump(log, k, axis, impulses[i] * constants.direction[i, axis])
        state.closed[i] = moved(constants.rows, i, state.v) <= still(constants, state, i)
    for k in range(len(log.force)):
        touches, opening = False, 0.0
        for a in range(problem.size[0]):
            i = problem.ports[a]
            if constants.contact[i] == k and constants.block[i] == i:
                touches = touches or state.closed[i]
                opening = max(opening, moved(constants.rows, i, state.v)) if impulses[i] != 0.0 else opening
        if opening > 0.0 and not touches:
            note_change(log, k, False, time, 0.0, opening)


@inner
def _exchange(constants, state, change):  # type: ignore[no-untyped-def]
    """Add the work of impulses [J] on each rigid coordinate and on all, and update the largest exchange."""
    work, count, total = state.work, len(constants.rigid), 0.0
    for n in range(count):
        k = constants.rigid[n]
        work[n] += change[k] * (state.v[k] - 0.5 * change[k])
    for k in range(len(change)):
        total += change[k] * (state.v[k] - 0.5 * change[k])
    work[count] += total
    note_exchange(work, state.parts[CONTACT], state.extreme)
