"""The end of a step: pushes, displacements of ports, anchors of friction, slip and stick, lengths of joints."""

import numpy as np

from gudgeon.solver.compiled import embedded, inner
from gudgeon.solver.contact.pattern import between
from gudgeon.solver.integrators.general.arrays import BILATERAL, DRIVEN, LAW, POSITION, RUBBING_LAW, SURFACE, VELOCITY
from gudgeon.solver.integrators.general.rows import displace_listed, displaced, four_alike, moved, push, push_four
from gudgeon.solver.integrators.general.slides import NOW, displaced_over, moved_over
from gudgeon.solver.integrators.general.solution.responses import rubbed


@embedded
def push_ends(constants, state):  # type: ignore[no-untyped-def]
    """Set the generalised forces by what acts at the step's end on ports that respond, and on surfaces."""
    rows, unknown, extra, a = constants.rows, state.unknown, state.extra, 0
    ports = state.forced[1 : state.forced[0] + 1]
    while a < len(ports):
        i = ports[a]
        a += 1
        if unknown[i] == 0.0 and extra[i] == 0.0:
            continue
        group = 0 if constants.contact[i] >= 0 or constants.kind[i] == SURFACE else 1
        if four_alike(constants.pattern.group, ports, a - 1):
            four = (i, ports[a], ports[a + 1], ports[a + 2])
            if _pushed_alike((constants.contact, constants.share, extra), four):
                amounts = (0.5 * unknown[i], 0.5 * unknown[four[1]], 0.5 * unknown[four[2]], 0.5 * unknown[four[3]])
                push_four(rows, four, amounts, state.half[group])
                a += 3
                continue
        if constants.share[i] < 1.0:
            push(rows, i, 0.5 * unknown[i], state.half[group])
            if extra[i] != 0.0:
                push(rows, i, extra[i], state.rest[group])
        else:
            push(rows, i, unknown[i] + extra[i], state.rest[group])


@inner
def _pushed_alike(ports, four):  # type: ignore[no-untyped-def]
    """Whether four ports are of contacts and have no extra mean force.

    Args:
        ports: Contacts, shares and extra means of all.
    """
    (contact, share, extra), alike = ports, True
    for n in range(4):
        i = four[n]
        alike = alike and contact[i] >= 0 and share[i] < 1.0 and extra[i] == 0.0
    return alike


@embedded
def displace(constants, state, problem):  # type: ignore[no-untyped-def]
    """Set the displacement of the ports that respond or are loaded, at the end of the step [m].

    That of a candidate over a compliance is its measure less its layer, from its anchor.
    """
    # Rigid contact moves what it pushes once more, after its impulses are found: see `_strike`.
    step, solved = constants.dt[0], problem.size[2] != 0 and not constants.bounces
    displacement, response, layer, unknown = state.displacement[0], state.response[0], constants.layer, state.unknown
    residual, held, listed = constants.residual, state.held, state.listed
    plain = constants.plain and solved and not (constants.edged or constants.damped)
    if plain:
        for i in problem.ports[: problem.size[0]]:
            displacement[i] = problem.free[i] - layer[i] * unknown[i]
    for a in range(0 if plain else problem.size[0]):
        i = problem.ports[a]
        first = constants.block[i]
        measured = solved and not state.beside[i]
        if measured and constants.level[first] == POSITION and constants.kind[i] not in (BILATERAL, DRIVEN):
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
    if len(held) == 1:
        displace_listed(residual, held, listed, response)


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


@embedded
def follow(constants, state, problem, time):  # type: ignore[no-untyped-def]
    """Let the anchors of tangents that slip or are open follow them, and end the approach of laws that are open."""
    for a in range(problem.size[0]):
        i = problem.ports[a]
        if constants.size[i] == 0:
            continue
        kind = constants.kind[i]
        if (kind in (LAW, RUBBING_LAW)) and (state.displacement[0, i] >= 0.0 or state.beside[i]):
            state.approach[i] = 0.0
        if constants.size[i] != 3 or kind == DRIVEN:
            continue
        slips = True
        if state.unknown[i] > 0.0:
            reach = max(
                between(constants.pattern, constants.columns, i + 1, i + 1),
                between(constants.pattern, constants.columns, i + 2, i + 2),
            )
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
            state.anchor[b] = (
                state.displacement[0, b] if slips else state.anchor[b] + constants.belt[b] * constants.dt[0]
            )


@inner
def _note(contact, time, begins, slips):  # type: ignore[no-untyped-def]
    """Keep a change between slip and stick [s]."""
    count = int(slips[0, 0])
    slips[0, 0] = count + 1
    if count + 1 < len(slips):
        slips[count + 1, 0], slips[count + 1, 1], slips[count + 1, 2] = contact, time, begins


@inner
def set_lengths(constants, state, out):  # type: ignore[no-untyped-def]
    """Set the length error of each joint [m]."""
    for n in range(len(constants.joints)):
        i = constants.joints[n]
        j = constants.joint[i]
        lateral = state.displacement[0, i] - state.pin[j, 0]
        along = state.displacement[0, i + 1] - state.pin[j, 1]
        out[j] = np.hypot(lateral, along) - constants.lengths[i]
