"""The implicit time loop over ports: exact modal motion under mean forces, all ports respond at the end of the step.

The mean force of a port over a step is ½ (fₙ + f⁺) where it has a compliance of its own, and its unknown where contact
is rigid, where a law is its only compliance, and for joints. Where contact closes or opens within the step, at the
share θ of it, the mean is ½ (1 − θ) f⁺ or ½ θ fₙ, so that it does the work that its compliance stores: the average of
the force along the step. Rigid contact keeps 0 ≤ f̄ ⊥ u̇⁺ + e u̇⁻ ≥ 0 once its gap closes (J. J. Moreau, 1988). Points
that the path of the coordinates cannot have closed are left out.
"""

import numpy as np

from gudgeon.solver.compiled import copy, embedded, entry, inner, unpacked
from gudgeon.solver.integrators.general.arrays import GIVEN, STABILISED
from gudgeon.solver.integrators.general.candidates import (
    find_candidates,
    free_measures,
    list_candidates,
    overlooked,
    travelled,
    used_margins,
)
from gudgeon.solver.integrators.general.closing import set_extra
from gudgeon.solver.integrators.general.ending import displace, follow, push_ends, set_lengths
from gudgeon.solver.integrators.general.energy import balance
from gudgeon.solver.integrators.general.fields.kernel import field_left, set_fields
from gudgeon.solver.integrators.general.impacts import collide, fall, first_closing, first_turning, retime, time_left
from gudgeon.solver.integrators.general.rebounds import foresee, keep_open, shifts_change, strike
from gudgeon.solver.integrators.general.resultants import log_forces, log_parts, note_part
from gudgeon.solver.integrators.general.rows import (
    displaced,
    list_forces,
    moved,
    push,
)
from gudgeon.solver.integrators.general.slides import (
    drag_along,
    place_surfaces,
    press_surfaces,
    pull_along,
)
from gudgeon.solver.integrators.general.solution.solve import solve

MOST_PARTS, MOST_TRIALS = 20_000, 100
"""Largest number of parts of a step, and of trials to find where rigid contact closes."""
SHORTEST = 1e-14
"""Share of a step that is round-off of its parts."""
PASSES = 6
"""Largest number of contact solutions in a step, since its means depend on what opens and closes in it."""


@entry
def march(loop, given, first, stride, out):  # type: ignore[no-untyped-def]
    """Advance `len(out.forces)` samples of `stride` steps from step number `first`; False where this failed.

    Args:
        loop: The Loop, whose arrays are changed in place.
        given: What the scene gives in these steps.
        out: The samples.
    """
    arrays = unpacked(loop.whole)
    loads, crank = given.loads, given.crank
    constants, state, log = arrays.constants, arrays.state, arrays.log
    for sample in range(len(out.forces)):
        for part in range(stride):
            step = sample * stride + part
            copy(given.driven[step], state.wanted)
            state.field_energy[1] = first + step
            if len(constants.field_start) > 0 and not set_fields(constants, state, loads[:, step]):
                return False
            if constants.divides:
                if not _divided(loop, loads[:, step], first + step):
                    return False
                _add_all(constants, state, stride, out.forces[sample])
            else:
                if not _advance(loop.whole, loads[:, step], crank[step]):
                    return False
                _finish(loop.whole, (first + step + 1) * constants.dt[0])
                for j in range(len(state.pin)):
                    copy(crank[step, j], state.pin[j])
                log_forces(constants, state, log, first + step)
                for n in range(1, state.forced[0] + 1):
                    i = state.forced[n]
                    k = constants.contact[i]
                    if k >= 0 and state.mean[i] != 0.0:
                        force = state.mean[i] / stride
                        for axis in range(3):
                            out.forces[sample, k, axis] += force * constants.direction[i, axis]
            if len(constants.field_start) > 0 and field_left(constants, state):
                return False
            for i in range(len(constants.loaded)):
                out.loads[sample, i] += state.mean[constants.loaded[i]] / stride
        copy(state.parts, out.energies[sample])
        copy(state.q, out.q[sample])
        copy(state.v, out.v[sample])
        copy(state.unknown, out.ports[sample])
        set_lengths(constants, state, out.lengths[sample])
    return True


@inner
def _advance(kept, loads, crank):  # type: ignore[no-untyped-def]
    """Find the forces of a step or of a part of one; False where the sweeps do not converge.

    Args:
        kept: Arrays of whole steps or of parts.
        loads: Given loads [N]: means, and at the end, (2, g).
        crank: Driven points of joints at the end, (j, 4).
    """
    arrays = unpacked(kept)
    constants, state = arrays.constants, arrays.state
    _aim(constants, state, crank)
    _fly(constants, state, loads)
    find_candidates(constants, state, arrays.problem)
    return _respond(kept, crank)


@inner
def _add_all(constants, state, stride, forces):  # type: ignore[no-untyped-def]
    """Add the resultants of contacts in a step of many parts to those of its sample [N]."""
    for i in range(len(state.mean)):
        k = constants.contact[i]
        if k >= 0 and state.mean[i] != 0.0:
            force = state.mean[i] / stride
            for axis in range(3):
                forces[k, axis] += force * constants.direction[i, axis]


@inner
def _divided(loop, loads, number):  # type: ignore[no-untyped-def]
    """Take a step, divided where rigid contact closes; False where forces are not found, or parts are too many."""
    arrays = unpacked(loop.whole)
    state, problem = arrays.state, arrays.problem
    dt = arrays.constants.dt[0]
    start, done, sound = number * dt, 0.0, True
    copy(state.unknown, state.begun)
    state.total[:] = 0.0
    state.sudden_impulses[0, :] = 0.0
    for turn in range(MOST_PARTS):
        if not collide(loop, number, start + done):
            return False
        kept, length = loop.whole, dt - done
        if not length > SHORTEST * dt:
            break
        if turn > 0:
            kept = loop.part
            retime(loop, length)
        length = _part(loop, kept, (loads, done), length)
        if not length > 0.0:
            return False
        kept = loop.whole if length == dt else loop.part
        _finish(kept, start + done + length)
        if state.turning[0] >= 0:
            state.sliding[state.turning[0]] = False
        note_part(arrays, (start + done, length))
        done += length
        for i in range(len(state.mean)):
            state.total[i] += length * state.mean[i]
        sound = turn + 1 < MOST_PARTS
        if length != dt:
            problem.size[1] = -1
    for i in range(len(state.mean)):
        state.mean[i] = (state.total[i] + state.sudden_impulses[0, i]) / dt
    log_parts(arrays, number)
    return sound


@inner
def _part(loop, kept, given, length):  # type: ignore[no-untyped-def]
    """Find the forces up to where the first rigid contact closes, and how long that takes [s]; 0 where none are found.

    Args:
        kept: Arrays of whole steps or of parts.
        given: Loads of the whole step, means and at its end [N], and what is done of it [s].
        length: What is left of it [s].
    """
    arrays, constants = unpacked(loop.whole), unpacked(kept).constants
    state, problem = arrays.state, arrays.problem
    dt, low, high, hit, state.turning[0] = arrays.constants.dt[0], 0.0, length, -1, -1
    _keep(state)
    for _turn in range(MOST_TRIALS):
        if _turn > 0:
            _restore(state, problem)
            kept = loop.part
            constants = unpacked(kept).constants
            retime(loop, length)
        _share_loads(constants, state, given, dt)
        if not _advance(kept, state.loads, state.pin):
            return 0.0
        fall(constants, state, problem)
        found, time = first_closing(constants, state, problem, dt)
        if found >= 0:
            hit, high, state.turning[0] = found, length, -1
        else:
            left = time_left(constants, state, hit, dt) if hit >= 0 else 0.0
            if left == 0.0 and state.turning[0] < 0:
                time = first_turning(kept, loop)
                if state.turning[0] >= 0:
                    hit, high, length = -1, length, time
                    continue
            if left == 0.0 or high - low < SHORTEST * dt:
                return length
            low, time = length, length + left
        length = time if low < time < high else 0.5 * (low + high)
    return 0.0


@inner
def _keep(state):  # type: ignore[no-untyped-def]
    """Keep what a trial of a part of a step changes."""
    copy(state.approach, state.kept[: len(state.approach)])
    state.kept[len(state.approach)] = state.fastest[0]


@inner
def _restore(state, problem):  # type: ignore[no-untyped-def]
    """Go back to the start of a part of the step."""
    copy(state.last, state.unknown)
    copy(state.before[0], state.q)
    copy(state.before[1], state.v)
    copy(state.kept[: len(state.approach)], state.approach)
    state.fastest[0] = state.kept[len(state.approach)]
    for i in range(len(state.last)):
        problem.awake[0, i] = problem.awake[1, i]


@inner
def _share_loads(constants, state, given, dt):  # type: ignore[no-untyped-def]
    """Set the means of given loads in a part of the step and at its end [N], by the parabola through the whole step."""
    loads, done = given
    s, e = done / dt, (done + constants.dt[0]) / dt
    for n in range(loads.shape[1]):
        mean, end = loads[0, n], loads[1, n]
        begin = end if mean == end else state.begun[constants.given[n]]
        bend = 3.0 * (begin + end - 2.0 * mean)
        slope = end - begin - bend
        state.loads[0, n] = begin + 0.5 * slope * (s + e) + bend * (s * s + s * e + e * e) / 3.0
        state.loads[1, n] = begin + (slope + bend * e) * e


@embedded
def _aim(constants, state, crank):  # type: ignore[no-untyped-def]
    """Set the direction of each joint's force in the middle of the step, and the length of its measure [m]."""
    dt = constants.dt[0]
    for n in range(len(constants.joints)):
        i = constants.joints[n]
        j = constants.joint[i]
        size, apart, closing, speed = 0.0, 0.0, 0.0, 0.0
        for axis in range(2):
            rate = moved(constants.rows, i + axis, state.v)
            here, pin = state.displacement[0, i + axis], state.pin[j, axis]
            state.rod[j, axis] = 2 * here + dt * rate - pin - crank[j, axis]
            size += state.rod[j, axis] ** 2
            apart += (here - pin) ** 2
            closing += (here - pin) * (rate - state.pin[j, 2 + axis])
            speed += (rate - state.pin[j, 2 + axis]) ** 2
        for axis in range(2):
            state.rod[j, axis] /= np.sqrt(size)
        across = max(0.0, speed - closing * closing / apart)
        state.rod[j, 2] = constants.lengths[i]
        if constants.level[i] == STABILISED:
            state.rod[j, 2] += dt * dt * across / (8.0 * constants.lengths[i])


@embedded
def _fly(constants, state, loads):  # type: ignore[no-untyped-def]
    """Set q and q̇ to the end of the step under the loads and the first half of the forces that are not zero."""
    q, v, force, last, motion = state.q, state.v, state.force, state.last, constants.motion
    copy(state.unknown, last)
    copy(state.displacement[0], state.displacement[1])
    copy(state.response[0], state.response[1])
    copy(q, state.before[0])
    copy(v, state.before[1])
    gravity, contacts, others = constants.gravity, state.half[0], state.half[1]
    for k in range(len(force)):
        force[k] = gravity[k] + contacts[k] + others[k]
    state.extra[:] = 0.0
    for n in range(len(constants.given)):
        i, mean, end = constants.given[n], loads[0, n], loads[1, n]
        if mean != 0.0:
            push(constants.rows, i, mean, force)
        if last[i] == 0.0 and (mean != 0.0 or end != 0.0):
            _place_given(constants, state, i)
        state.unknown[i] = end
        state.extra[i] = mean - 0.5 * (last[i] + end)
    if constants.slides:
        pull_along(constants, state, force)
    q0, v0 = state.before[0], state.before[1]
    a, b, c = motion[0], motion[1], constants.push[0]
    for k in range(len(q)):
        q[k] = a[k] * q0[k] + b[k] * v0[k] + c[k] * force[k]
    a, b, c = motion[2], motion[3], constants.push[1]
    for k in range(len(v)):
        v[k] = a[k] * q0[k] + b[k] * v0[k] + c[k] * force[k]
    if not (constants.damped or len(constants.given) > 0):
        return
    for s in range(len(state.held)):
        memory = constants.memory[s]
        for i in range(len(last)):
            state.known[s, i] = memory[0, i] * state.held[s, i] + memory[1, i] * last[i]
        for n in range(len(constants.given)):
            i = constants.given[n]
            state.known[s, i] += memory[2, i] * state.unknown[i]
    list_forces(state.known, state.listed_known)


@inner
def _place_given(constants, state, i):  # type: ignore[no-untyped-def]
    """Set where a given load that begins was at the start of the step [m]."""
    response = displaced(constants.residual, i, state.held, state.listed)
    state.response[1, i] = response
    state.displacement[1, i] = constants.offset[i] + moved(constants.rows, i, state.before[0]) + response


@embedded
def _respond(kept, crank):  # type: ignore[no-untyped-def]
    """Find the forces of all candidates; False where the sweeps do not converge."""
    arrays = unpacked(kept)
    constants, state, problem = arrays.constants, arrays.state, arrays.problem
    foresees = constants.bounces and not constants.divides
    missed = True
    for turn in range(PASSES + 1):
        if missed:
            list_candidates(constants, state, problem)
            free_measures(constants, state, problem, crank)
        if turn == PASSES:
            break
        if foresees and missed and keep_open(constants, state, problem):
            if not solve(kept):
                return False
            foresee(constants, state, problem)
        if problem.size[0] > 0 and not solve(kept):
            return False
        unsettled = set_extra(constants, state, problem)
        if foresees and problem.size[0] > 0:
            unsettled = shifts_change(constants, state, problem) or unsettled
        if constants.slides:
            press_surfaces(constants, state)
        missed = overlooked(constants, state, problem)
        problem.size[2] = not missed
        if not (missed or unsettled):
            break
        state.counts[4] += 1
    return True


@embedded
def _list_forced(constants, state):  # type: ignore[no-untyped-def]
    """Set the mean forces and impulses of the step, and list the ports with forces that respond or are surfaces."""
    count, unknown, last, extra, forced = 0, state.unknown, state.last, state.extra, state.forced
    mean, impulses, share, dt = state.mean, state.impulses, constants.share, constants.dt[0]
    for i in range(len(mean)):
        mean[i] = share[i] * unknown[i] + (1.0 - share[i]) * last[i] + extra[i]
        impulses[i] += dt * mean[i]
    for i in range(len(mean)):
        acts = (unknown[i] != 0.0) | (last[i] != 0.0) | (extra[i] != 0.0)
        # Without a branch, which could not be foreseen.
        forced[count + 1] = i
        count += acts & (constants.kind[i] != GIVEN)
    forced[0] = count


@inner
def _finish(kept, time):  # type: ignore[no-untyped-def]
    """Bring all ports and coordinates to the end of the step [s], and its energies."""
    arrays = unpacked(kept)
    constants, state, problem = arrays.constants, arrays.state, arrays.problem
    _list_forced(constants, state)
    q, v, force, half, rest, pressed = state.q, state.v, state.force, state.half, state.rest, state.pressed
    copy(half[0], pressed)
    half[:, :] = 0.0
    rest[:, :] = 0.0
    push_ends(constants, state)
    by_q, by_v = constants.push[0], constants.push[1]
    for k in range(len(q)):
        contacts = half[0, k] + rest[0, k]
        second = contacts + half[1, k] + rest[1, k]
        pressed[k] += contacts
        force[k] += second
        q[k] += by_q[k] * second
        v[k] += by_v[k] * second
    if constants.bounces and not constants.divides:
        strike(constants, state, problem)
    travelled(constants, state)
    held = state.held
    for s in range(len(held)):
        memory, own = constants.memory[s], held[s]
        kept, begin, end, last, now = memory[0], memory[1], memory[2], state.last, state.unknown
        for i in range(len(own)):
            own[i] = kept[i] * own[i] + begin[i] * last[i] + end[i] * now[i]
    list_forces(held, state.listed)
    displace(constants, state, problem)
    if constants.slides:
        place_surfaces(constants, state)
        drag_along(constants, state)
    if not constants.plain:
        follow(constants, state, problem, time)
    used_margins(constants, state, problem)
    balance(constants, state, problem)
