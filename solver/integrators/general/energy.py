"""The energy balance of the loop over ports."""

from gudgeon.solver.compiled import embedded, inner
from gudgeon.solver.contact.pattern import between
from gudgeon.solver.integrators.balance import note_exchange
from gudgeon.solver.integrators.general.arrays import (
    BILATERAL,
    CONE,
    DRIVEN,
    LAW,
    RUBBING_LAW,
    SPRING,
    STABILISED,
    UNILATERAL,
    VELOCITY,
)
from gudgeon.solver.integrators.general.edges.kernel import lost_beside
from gudgeon.solver.integrators.general.fields.kernel import field_energy
from gudgeon.solver.integrators.general.rows import displaced, moved
from gudgeon.solver.integrators.general.solution.responses import spring_energy
from gudgeon.solver.integrators.outcome import DEEPEST, ENERGY_ERROR, EXCHANGED, START_ENERGY
from gudgeon.solver.laws.force import law_energy, quotient

KINETIC, STRAIN, CONTACT, DISSIPATED, WORK = range(5)


@embedded
def balance(constants, state, problem):  # type: ignore[no-untyped-def]
    """Set the energies [J] at the end of the step, and update the largest error of their balance."""
    q, v, q0, v0, force, loss = state.q, state.v, state.before[0], state.before[1], state.force, constants.loss
    parts, extreme = state.parts, state.extreme
    kinetic, strain, work, lost = 0.0, 0.0, 0.0, 0.0
    # Short loops: vector units process few arrays at once.
    stiffness, gravity = constants.stiffness, constants.gravity
    for k in range(len(q)):
        kinetic += v[k] * v[k]
        strain += stiffness[k] * q[k] * q[k]
    for k in range(len(q)):
        work += gravity[k] * (q[k] - q0[k])
    first, second, third = loss[0], loss[1], loss[2]
    for k in range(len(q0)):
        lost += first[k] * q0[k] * q0[k] + second[k] * q0[k] * v0[k] + third[k] * v0[k] * v0[k]
    first, second, third = loss[3], loss[4], loss[5]
    for k in range(len(q0)):
        lost += (first[k] * q0[k] + second[k] * v0[k] + third[k] * force[k]) * force[k]
    parts[KINETIC], parts[CONTACT] = 0.5 * kinetic, 0.0
    springs = _ports_energy(constants, state, problem)
    residual = residual_energy(constants, state)
    if constants.damped:
        given = 0.0
        for i in range(len(state.mean)):
            given += (state.mean[i] - state.extra[i]) * (state.response[0, i] - state.response[1, i])
        parts[DISSIPATED] += given - (residual - state.stored[0])
    state.stored[0] = residual
    parts[STRAIN] = 0.5 * strain + residual + springs
    if len(constants.field_start) > 0:
        parts[STRAIN] += field_energy(constants, state)
    parts[DISSIPATED] += lost + state.inside[1]
    parts[WORK] += work
    error = parts[KINETIC] + parts[STRAIN] + parts[CONTACT] + parts[DISSIPATED] - parts[WORK] - extreme[START_ENERGY]
    extreme[ENERGY_ERROR] = max(extreme[ENERGY_ERROR], abs(error))
    _exchange(constants, state)


@embedded
def _ports_energy(constants, state, problem):  # type: ignore[no-untyped-def]
    """Add what all ports store, lose and are given in the step [J]; returns what springs store."""
    parts, extreme = state.parts, state.extreme
    springs = 0.0
    mean, unknown, layer = state.mean, state.unknown, constants.layer
    # Of unilateral contact alone, ports without a force store and lose nothing.
    listed = state.forced[1 : state.forced[0] + 1] if constants.plain else problem.ports[: problem.size[0]]
    for i in listed:
        kind = constants.kind[i]
        if constants.edged and state.beside[i]:
            parts[DISSIPATED] += lost_beside(constants, state, i)
        elif (kind in (UNILATERAL, CONE)) and not constants.bounces:
            if constants.block[i] != i:
                belt = constants.belt[i] * constants.dt[0]
                rubbed = -mean[i] * (state.displacement[0, i] - state.displacement[1, i] - belt)
                if state.extra[i] != 0.0:
                    if unknown[i] == 0.0:
                        state.response[0, i] = displaced(constants.residual, i, state.held, state.listed)
                    rubbed += state.extra[i] * (state.response[0, i] - state.response[1, i])
                _rub(constants, state, i, rubbed)
                parts[WORK] += mean[i] * belt
            else:
                parts[CONTACT] += 0.5 * layer[i] * unknown[i] * unknown[i]
                extreme[DEEPEST] = max(extreme[DEEPEST], layer[i] * unknown[i])
        else:
            _port_energy(constants, state, i)
            if kind == SPRING:
                springs += spring_energy(constants.law[i], knots_of(constants, i), state.displacement[0, i])
    for n in range(len(constants.given)):
        i = constants.given[n]
        if constants.stored[n]:
            continue
        if state.unknown[i] != 0.0 or state.last[i] != 0.0 or state.mean[i] != 0.0:
            parts[WORK] += state.mean[i] * (state.displacement[0, i] - state.displacement[1, i])
            parts[WORK] -= state.extra[i] * (state.response[0, i] - state.response[1, i])
    return springs


@inner
def _port_energy(constants, state, i):  # type: ignore[no-untyped-def]
    """Add what one port stores, loses and is given in the step [J]."""
    kind, parts, mean = constants.kind[i], state.parts, state.mean[i]
    first = constants.block[i]
    step = state.displacement[0, i] - state.displacement[1, i]
    if kind in (BILATERAL, DRIVEN):
        parts[WORK] += mean * step
        if constants.bounces and constants.level[first] == STABILISED:
            # An impulse acts at the velocity of its time, not at the mean one of the step.
            gained = moved(constants.rows, i, state.v) - moved(constants.rows, i, state.before[1])
            sudden = state.unknown[i] - state.foreseen[i]
            parts[WORK] -= state.average[0] * constants.dt[0] * sudden * gained
    elif kind == SPRING:
        if constants.law[i, 1] > 0.0:
            law, knots = constants.law[i], knots_of(constants, i)
            stored = spring_energy(law, knots, state.displacement[0, i])
            stored -= spring_energy(law, knots, state.displacement[1, i])
            parts[DISSIPATED] += -mean * step - stored
    elif mean == 0.0 and state.unknown[i] == 0.0 and (first != i or kind in (UNILATERAL, CONE)):
        pass
    elif state.closing[first] >= 0.0:
        _struck(constants, state, i)
    elif first != i:
        belt = constants.belt[i] * constants.dt[0]
        extra = state.extra[i] * (state.response[0, i] - state.response[1, i])
        _rub(constants, state, i, extra - mean * (step - belt))
        parts[WORK] += mean * belt
    elif constants.level[i] == VELOCITY:
        if constants.restitution[i] < 1.0 and mean * step < 0.0:
            parts[DISSIPATED] -= mean * step
    elif kind in (LAW, RUBBING_LAW):
        law, before, after = constants.law[i], -state.displacement[1, i], -state.displacement[0, i]
        parts[CONTACT] += law_energy(law, after)
        state.extreme[DEEPEST] = max(state.extreme[DEEPEST], after)
        if law[2] > 0.0 or law[3] > 0.0:
            lost = (mean - quotient(law, before, after)) * (after - before)
            if lost > 0.0:  # No law creates energy: that of a wrong force shall appear as drift.
                parts[DISSIPATED] += lost
    else:
        parts[CONTACT] += 0.5 * constants.layer[i] * state.unknown[i] ** 2
        state.extreme[DEEPEST] = max(state.extreme[DEEPEST], constants.layer[i] * state.unknown[i])


@inner
def _rub(constants, state, i, energy):  # type: ignore[no-untyped-def]
    """Add the energy [J] that friction takes at a tangential port."""
    state.parts[DISSIPATED] += energy
    state.rubbed[constants.contact[i]] += energy


@inner
def _struck(constants, state, i):  # type: ignore[no-untyped-def]
    """Add what an impact of rigid contact loses, p ½ (u̇⁻ + u̇⁺) when it closes, and what a moving obstacle gives [J]."""
    first, mean = constants.block[i], state.mean[i]
    before, after = moved(constants.rows, i, state.before[1]), moved(constants.rows, i, state.v)
    free, share = state.rate[i] - before, state.closing[first]
    hit, sudden = before + share * free, state.sudden[first]
    left = hit + sudden * (after - state.rate[i])
    middle = sudden * 0.5 * (hit + left) + (1.0 - sudden) * 0.5 * (left + after) - constants.belt[i]
    if first != i:
        _rub(constants, state, i, -mean * constants.dt[0] * middle)
    elif constants.restitution[i] < 1.0:
        state.parts[DISSIPATED] -= mean * constants.dt[0] * middle
    state.parts[WORK] += mean * constants.dt[0] * constants.belt[i]


@embedded
def knots_of(constants, i):  # type: ignore[no-untyped-def]
    """Return the table of a spring, none where it is linear, (n, 2)."""
    return constants.knots[constants.table[i, 0] : constants.table[i, 1]]


@embedded
def residual_energy(constants, state):  # type: ignore[no-untyped-def]
    """Return what the residual flexibility stores [J]."""
    total, held, sides, listed = 0.0, state.held, constants.sides, state.listed
    if len(held) == 1:
        for n in range(1, listed[0] + 1):
            total += 0.5 * held[0, listed[n]] * state.response[0, listed[n]]
        return total
    pattern, residual = constants.pattern, constants.residual.values
    for s in range(len(held)):
        for n in range(1, listed[0] + 1):
            j = listed[n]
            for b in range(1, listed[0] + 1):
                i = listed[b]
                other = 0 if sides[i, 0] == sides[j, s] else 1
                total += 0.5 * held[other, i] * between(pattern, residual[s], i, j) * held[s, j]
    return total


@embedded
def _exchange(constants, state):  # type: ignore[no-untyped-def]
    """Add the contacts' work [J] in the step on each rigid coordinate and on all, and update the largest exchange."""
    work, count = state.work, len(constants.rigid)
    for number in range(count):
        k = constants.rigid[number]
        work[number] += state.pressed[k] * (state.q[k] - state.before[0, k])
    total = 0.0
    for k in range(len(state.q)):
        total += state.pressed[k] * (state.q[k] - state.before[0, k])
    work[count] += total
    if constants.divides:
        # Bodies at rest exchange round-off: it is compared with what their contact takes up in a step.
        taken = 0.0
        for k in range(len(state.q)):
            taken += (constants.dt[0] * state.pressed[k]) ** 2
        state.extreme[EXCHANGED] = max(state.extreme[EXCHANGED], 0.5 * taken)
    note_exchange(work, state.parts[CONTACT], state.extreme)
