"""The implicit time loop over ports: exact modal motion under mean forces, all ports respond at the end of the step.

The mean force of a port over a step is ½ (fₙ + f⁺) where it has a compliance of its own, and its unknown where contact
is rigid, where a law is its only compliance, and for joints. Where contact closes or opens within the step, at the
share θ of it, the mean is ½ (1 − θ) f⁺ or ½ θ fₙ, so that it does the work that its compliance stores: the average of
the force along the step. Rigid contact keeps 0 ≤ f̄ ⊥ u̇⁺ + e u̇⁻ ≥ 0 once its gap closes (J. J. Moreau, 1988). Points
that the path of the coordinates cannot have closed are left out.
"""

import numpy as np

from gudgeon.solver.compiled import copy, entry, inner
from gudgeon.solver.integrators.general.arrays import (
    BILATERAL,
    DRIVEN,
    LAW,
    POSITION,
    RUBBING_LAW,
    STABILISED,
    SURFACE,
    VELOCITY,
)
from gudgeon.solver.integrators.general.candidates import (
    find_candidates,
    free_measures,
    overlooked,
    travelled,
    used_margins,
)
from gudgeon.solver.integrators.general.closing import set_extra
from gudgeon.solver.integrators.general.energy import balance
from gudgeon.solver.integrators.general.rebounds import foresee, keep_open, shifts_change, strike
from gudgeon.solver.integrators.general.resultants import log_forces
from gudgeon.solver.integrators.general.rows import (
    displaced,
    four_in_a_row,
    list_forces,
    moved,
    push,
    push_four,
    respond,
)
from gudgeon.solver.integrators.general.slides import (
    NOW,
    displaced_over,
    drag_along,
    moved_over,
    place_surfaces,
    press_surfaces,
    pull_along,
)
from gudgeon.solver.integrators.general.solution.responses import rubbed
from gudgeon.solver.integrators.general.solution.solve import solve

PASSES = 6
"""Largest number of contact solutions in a step, since its means depend on what opens and closes in it."""


@entry
def march(arrays, given, first, stride, out):  # type: ignore[no-untyped-def]
    """Advance `len(out.forces)` samples of `stride` steps from step number `first`; False where this failed."""
    loads, crank = given.loads, given.crank
    constants, state, problem, log = arrays.constants, arrays.state, arrays.problem, arrays.log
    for sample in range(len(out.forces)):
        for part in range(stride):
            step = sample * stride + part
            _aim(constants, state, crank[step])
            copy(given.driven[step], state.wanted)
            _fly(constants, state, loads[:, step])
            find_candidates(constants, state, problem)
            free_measures(constants, state, problem, crank[step])
            if not _respond(constants, state, problem, crank[step]):
                return False
            _finish(constants, state, problem, (first + step + 1) * constants.dt)
            for j in range(len(state.pin)):
                copy(crank[step, j], state.pin[j])
            balance(constants, state, problem)
            log_forces(constants, state, problem, log, first + step)
            for a in range(problem.size[0]):
                i = problem.ports[a]
                k = constants.contact[i]
                if k >= 0 and state.mean[i] != 0.0:
                    for axis in range(3):
                        out.forces[sample, k, axis] += state.mean[i] * constants.direction[i, axis] / stride
            for i in range(len(constants.loaded)):
                out.loads[sample, i] += state.mean[constants.loaded[i]] / stride
        copy(state.parts, out.energies[sample])
        copy(state.q, out.q[sample])
        copy(state.v, out.v[sample])
        copy(state.unknown, out.ports[sample])
        _lengths(constants, state, out.lengths[sample])
    return True


@inner
def _aim(constants, state, crank):  # type: ignore[no-untyped-def]
    """Set the direction of each joint's force in the middle of the step, and the length of its measure [m]."""
    dt = constants.dt
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


@inner
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


@inner
def _respond(constants, state, problem, crank):  # type: ignore[no-untyped-def]
    """Find the forces of all candidates; False where the sweeps do not converge."""
    fresh = constants.bounces
    for _trial in range(PASSES):
        if fresh and keep_open(constants, state, problem):
            if not solve(constants, state, problem):
                return False
            foresee(constants, state, problem)
        if problem.size[0] > 0 and not solve(constants, state, problem):
            return False
        unsettled = set_extra(constants, state, problem)
        if constants.bounces and problem.size[0] > 0:
            unsettled = shifts_change(constants, state, problem) or unsettled
        if constants.slides:
            press_surfaces(constants, state)
        missed = overlooked(constants, state, problem)
        problem.size[2] = not missed
        if missed:
            free_measures(constants, state, problem, crank)
        if not (missed or unsettled):
            return True
        fresh = missed and constants.bounces
        state.counts[4] += 1
    return True


@inner
def _finish(constants, state, problem, time):  # type: ignore[no-untyped-def]
    """Bring all ports and coordinates to the end of the step."""
    p = len(state.unknown)
    for i in range(p):
        now, last = state.unknown[i], state.last[i]
        share = constants.share[i]
        state.mean[i] = share * now + (1.0 - share) * last + state.extra[i]
        state.impulses[i] += constants.dt * state.mean[i]
    q, v, force, half, rest, pressed = state.q, state.v, state.force, state.half, state.rest, state.pressed
    copy(half[0], pressed)
    half[:, :] = 0.0
    rest[:, :] = 0.0
    _push_ends(constants, state, problem.ports[: problem.size[0]])
    _push_ends(constants, state, state.slides.functions)
    by_q, by_v = constants.push[0], constants.push[1]
    for k in range(len(q)):
        contacts = half[0, k] + rest[0, k]
        second = contacts + half[1, k] + rest[1, k]
        pressed[k] += contacts
        force[k] += second
        q[k] += by_q[k] * second
        v[k] += by_v[k] * second
    if constants.bounces:
        strike(constants, state, problem)
    travelled(constants, state)
    held = state.held
    for s in range(len(held)):
        memory = constants.memory[s]
        for i in range(p):
            held[s, i] = memory[0, i] * held[s, i] + memory[1, i] * state.last[i] + memory[2, i] * state.unknown[i]
    list_forces(held, state.listed)
    _displace(constants, state, problem)
    if constants.slides:
        place_surfaces(constants, state)
        drag_along(constants, state)
    _anchor(constants, state, problem, time)
    used_margins(constants, state, problem)


@inner
def _push_ends(constants, state, ports):  # type: ignore[no-untyped-def]
    """Add the generalised forces of some ports by what acts at the step's end."""
    rows, unknown, extra, size, a = constants.rows, state.unknown, state.extra, len(ports), 0
    while a < size:
        i = ports[a]
        a += 1
        if unknown[i] == 0.0 and extra[i] == 0.0:
            continue
        group = 0 if constants.contact[i] >= 0 or constants.kind[i] == SURFACE else 1
        if _push_alike((constants.contact, constants.share, unknown, extra), i) and four_in_a_row(rows, ports, a - 1):
            amounts = (0.5 * unknown[i], 0.5 * unknown[i + 1], 0.5 * unknown[i + 2], 0.5 * unknown[i + 3])
            push_four(rows, i, amounts, state.half[group])
            a += 3
        elif constants.share[i] < 1.0:
            push(rows, i, 0.5 * unknown[i], state.half[group])
            if extra[i] != 0.0:
                push(rows, i, extra[i], state.rest[group])
        else:
            push(rows, i, unknown[i] + extra[i], state.rest[group])


@inner
def _push_alike(ports, i):  # type: ignore[no-untyped-def]
    """Whether four ports from i on are of the same contact and have forces without an extra one.

    Args:
        ports: Contacts, shares, unknowns and extra means of all.
    """
    contact, share, unknown, extra = ports
    if i + 4 > len(unknown) or contact[i] < 0:
        return False
    alike = True
    for j in range(i, i + 4):
        alike = alike and contact[j] == contact[i] and share[j] < 1.0
        alike = alike and unknown[j] != 0.0 and extra[j] == 0.0
    return alike


@inner
def _displace(constants, state, problem):  # type: ignore[no-untyped-def]
    """Set the displacement of the ports that respond or are loaded, at the end of the step [m].

    That of a candidate over a compliance is its measure less its layer, from its anchor.
    """
    # Rigid contact moves what it pushes once more, after its impulses are found: see `_strike`.
    step, solved = constants.dt, problem.size[2] != 0 and not constants.bounces
    displacement, response, layer, unknown = state.displacement[0], state.response[0], constants.layer, state.unknown
    residual, held, listed = constants.residual, state.held, state.listed
    for a in range(problem.size[0]):
        i = problem.ports[a]
        first = constants.block[i]
        if solved and constants.level[first] == POSITION and constants.kind[i] not in (BILATERAL, DRIVEN):
            displacement[i] = problem.free[i] - layer[i] * unknown[i]
            if i > first and constants.contact[i] >= 0:
                displacement[i] += state.anchor[i] + constants.belt[i] * step
            if constants.damped:
                response[i] = displaced(residual, i, held, listed)
        else:
            _displace_fully(constants, state, i)
    for n in range(len(constants.given)):
        i = constants.given[n]
        if unknown[i] != 0.0 or state.last[i] != 0.0 or state.mean[i] != 0.0:
            _displace_fully(constants, state, i)
    if constants.bounces:
        for n in range(len(constants.touching)):
            i = constants.touching[n]
            if constants.level[i] == VELOCITY and problem.awake[0, i]:
                for b in range(i, i + constants.size[i]):
                    _displace_fully(constants, state, b)
    if len(state.held) == 1:
        respond(residual[0], listed, held[0], response)


@inner
def _displace_fully(constants, state, i):  # type: ignore[no-untyped-def]
    """Set the displacement of one port by its row."""
    response = displaced(constants.residual, i, state.held, state.listed)
    state.response[0, i] = response
    place = moved(constants.rows, i, state.q) + response
    if state.slides.over[i]:
        place = moved_over(constants, state.slides, i, NOW, state.q)
        place += displaced_over(constants, state.slides, i, NOW, (state.held, state.listed))
    state.displacement[0, i] = constants.offset[i] + place


@inner
def _anchor(constants, state, problem, time):  # type: ignore[no-untyped-def]
    """Let the anchors of tangents that slip or are open follow them, and end the approach of laws that are open."""
    for a in range(problem.size[0]):
        i = problem.ports[a]
        if constants.size[i] == 0:
            continue
        kind = constants.kind[i]
        if (kind in (LAW, RUBBING_LAW)) and state.displacement[0, i] >= 0.0:
            state.approach[i] = 0.0
        if constants.size[i] != 3 or kind == DRIVEN:
            continue
        slips = True
        if state.unknown[i] > 0.0:
            reach = max(constants.columns[i + 1, i + 1], constants.columns[i + 2, i + 2])
            limit = (constants.friction[i, 0] * state.unknown[i], constants.friction[i, 1] * state.unknown[i])
            weight = 1.0 / reach if reach > 0.0 else 0.0
            first = state.unknown[i + 1] - weight * state.measure[i + 1]
            second = state.unknown[i + 2] - weight * state.measure[i + 2]
            # A force on the border of its disc by round-off sticks.
            slips = rubbed((limit[0] * (1 + 1e-9), limit[1] * (1 + 1e-9)), problem.slipped[i], first, second)[2]
        slides = slips and state.unknown[i] > 0.0
        if slides != state.sliding[i] and state.last[i] > 0.0 and state.unknown[i] > 0.0:
            _note(constants.contact[i], time, slides, state.slips)
        state.sliding[i] = slides
        for b in range(i + 1, i + 3):
            state.anchor[b] = state.displacement[0, b] if slips else state.anchor[b] + constants.belt[b] * constants.dt


@inner
def _note(contact, time, begins, slips):  # type: ignore[no-untyped-def]
    """Keep a change between slip and stick [s]."""
    count = int(slips[0, 0])
    slips[0, 0] = count + 1
    if count + 1 < len(slips):
        slips[count + 1, 0], slips[count + 1, 1], slips[count + 1, 2] = contact, time, begins


@inner
def _lengths(constants, state, out):  # type: ignore[no-untyped-def]
    """Set the length error of each joint [m]."""
    for n in range(len(constants.joints)):
        i = constants.joints[n]
        j = constants.joint[i]
        lateral = state.displacement[0, i] - state.pin[j, 0]
        along = state.displacement[0, i + 1] - state.pin[j, 1]
        out[j] = np.hypot(lateral, along) - constants.lengths[i]
