"""Energies and work of the implicit loop at every step, in short loops: vector units process few arrays at once."""

from gudgeon.solver.compiled import copy, inner
from gudgeon.solver.contact.compliance import Listed, combine
from gudgeon.solver.integrators.balance import note_exchange
from gudgeon.solver.integrators.implicit.open_contacts import least
from gudgeon.solver.integrators.outcome import DEEPEST, ENERGY_ERROR, START_ENERGY

KINETIC, STRAIN, CONTACT, DISSIPATED, WORK = range(5)


@inner
def relax(points, matrix, loads, bounds, energy, dt):  # type: ignore[no-untyped-def]
    """Bring residual forces [N] and displacements [m] of the points to the end of the step.

    The energy [J] that their damping took and the impulses of the rows [N s] grow by the step's. Displacements of a
    contact that is no candidate and without residual forces are followed no longer.
    """
    lost = 0.0
    for k in range(len(matrix.block)):
        if matrix.candidate[k] or bounds.held[0, k] > 0.0:
            lost += _relax(points, loads, matrix.block[k, 0], matrix.block[k, 1])
        else:
            points.followed[k] = False
    for moment in range(2):
        for n in range(points.counts[moment]):
            points.impulses[points.pressed[moment, n]] += 0.5 * dt * points.amounts[moment, n]
    energy.parts[DISSIPATED] += lost


@inner
def _relax(points, loads, first, last):  # type: ignore[no-untyped-def]
    """Relax the rows of one contact; returns the energy that their damping took [J]."""
    now, then = points.multipliers[first:last], points.last[first:last]
    by_contact, response = points.residual_displacement[first:last], points.response[first:last]
    force, end_force = points.residual_force[first:last], points.end_residual_force[first:last]
    before, total = points.total_displacement[first:last], points.end_total_displacement[first:last]
    kept, start, end = points.memory[0, first:last], points.memory[1, first:last], points.memory[2, first:last]
    response[:] = 0.0
    listed = Listed(points.pressed[1], points.amounts[1], points.counts[1])
    combine(points.residual, listed, 1.0, first, last, points.response)
    for i in range(len(by_contact)):
        by_contact[i] += end[i] * response[i]
    copy(by_contact, total)
    given = Listed(loads.numbers, loads.residual_force, len(loads.residual_force))
    combine(loads.to_gap, given, 1.0, first, last, points.end_total_displacement)
    for i in range(len(end_force)):
        end_force[i] = kept[i] * force[i] + start[i] * then[i] + end[i] * now[i]
    lost = 0.0
    for i in range(len(end_force)):
        lost += 0.5 * (then[i] + now[i] - force[i] - end_force[i]) * (total[i] - before[i])
    copy(end_force, force)
    copy(total, before)
    return lost


@inner
def follow_residual(points, loads, first, last):  # type: ignore[no-untyped-def]
    """Set the residual displacements [m] of rows at the start of the step, and without the forces of its end."""
    free, before, response = points.residual_displacement, points.total_displacement, points.response
    force, now = points.residual_force, points.last
    free[first:last] = 0.0
    before[first:last] = 0.0
    response[first:last] = 0.0
    for j in range(len(force)):
        if force[j] != 0.0 or now[j] != 0.0:
            row, flown = points.residual[j], points.memory[0, j] * force[j] + points.memory[1, j] * now[j]
            for i in range(first, last):
                before[i] += row[i] * force[j]
                free[i] += row[i] * flown
                response[i] += row[i] * now[j]
    given = Listed(loads.numbers, loads.last_residual_force, len(loads.last_residual_force))
    combine(loads.to_gap, given, 1.0, first, last, before)


@inner
def relax_masters(masters, energy, dt):  # type: ignore[no-untyped-def]
    """Do as `relax` does for the functions of the traction spaces."""
    first, second, memory, lost = masters.function_forces[0], masters.function_forces[1], masters.memory, 0.0
    force, end_force, impulses = masters.residual_force, masters.end_residual_force, masters.impulses
    before, now = masters.last_displacement, masters.residual_displacement
    for f in range(len(end_force)):
        end_force[f] = memory[0, f] * force[f] + 2 * (memory[1, f] * first[f] + memory[2, f] * second[f])
    for f in range(len(end_force)):
        lost += (first[f] + second[f] - 0.5 * (force[f] + end_force[f])) * (now[f] - before[f])
    for f in range(len(impulses)):
        impulses[f] += dt * (first[f] + second[f])
    copy(end_force, force)
    copy(now, before)
    energy.parts[DISSIPATED] += lost


@inner
def load_work(modes, points, loads, energy):  # type: ignore[no-untyped-def]
    """Add the work of loads and joints in the step [J]; returns twice the energy of their residual displacement [J]."""
    q, force, amount, held = modes.q, points.residual_force, loads.amount, 0.0
    for i in range(len(amount)):
        moved, residual, row, to_gap = 0.0, 0.0, loads.rows[i], loads.to_gap[i]
        for k in range(len(q)):
            moved += row[k] * q[k]
        for j in range(len(amount)):
            residual += loads.residual[i, j] * loads.residual_force[j]
        for j in range(len(force)):
            residual += to_gap[j] * force[j]
        held += loads.residual_force[i] * residual
        energy.parts[WORK] += amount[i] * (moved + residual - loads.displacement[i])
        middle = 0.5 * (loads.residual_force[i] + loads.last_residual_force[i])
        energy.parts[DISSIPATED] += (amount[i] - middle) * (residual - loads.residual_displacement[i])
        loads.displacement[i], loads.residual_displacement[i] = moved + residual, residual
        loads.last_residual_force[i] = loads.residual_force[i]
    return held


@inner
def balance(modes, points, masters, matrix, energy, held):  # type: ignore[no-untyped-def]
    """Set the energies [J] at the end of the step, and update the largest error of their balance.

    Args:
        held: Twice the energy of the loads' residual displacement [J].
    """
    q, v, q0, v0, force, loss = modes.q, modes.v, modes.before[0], modes.before[1], modes.force, modes.loss
    stiffness, gravity, moved = modes.stiffness, modes.gravity, modes.moved
    parts, extreme = energy.parts, energy.extreme
    kinetic, strain, work, lost = 0.0, 0.0, 0.0, 0.0
    for k in range(len(q)):
        moved[k] = q[k] - q0[k]
    for k in range(len(q)):
        kinetic += v[k] * v[k]
        strain += stiffness[k] * q[k] * q[k]
        work += gravity[k] * moved[k]
        lost += loss[0, k] * q0[k] * q0[k] + loss[1, k] * q0[k] * v0[k] + loss[2, k] * v0[k] * v0[k]
        lost += (loss[3, k] * q0[k] + loss[4, k] * v0[k] + loss[5, k] * force[k]) * force[k]
    layer, own, displacement = 0.0, points.residual_force, points.total_displacement
    for i in range(len(own)):
        held += own[i] * displacement[i]
    for n in range(points.counts[1]):
        layer += points.layer[points.pressed[1, n]] * points.amounts[1, n] ** 2
    for k in range(len(matrix.block)):
        if matrix.candidate[k]:
            extreme[DEEPEST] = max(extreme[DEEPEST], -least(points.gaps[matrix.block[k, 0] : matrix.block[k, 1]]))
    own, displacement = masters.residual_force, masters.residual_displacement
    for f in range(len(own)):
        held += own[f] * displacement[f]
    parts[KINETIC], parts[STRAIN], parts[CONTACT] = 0.5 * kinetic, 0.5 * (strain + held), 0.5 * layer
    parts[DISSIPATED] += lost
    parts[WORK] += work
    error = parts[KINETIC] + parts[STRAIN] + parts[CONTACT] + parts[DISSIPATED] - parts[WORK] - extreme[START_ENERGY]
    extreme[ENERGY_ERROR] = max(extreme[ENERGY_ERROR], abs(error))


@inner
def exchange(modes, points, energy):  # type: ignore[no-untyped-def]
    """Add the contacts' work [J] in the step on each rigid coordinate and on all, and update the largest exchange."""
    moved, rigid, work, count = modes.moved, energy.rigid, energy.work, len(energy.rigid)
    first, last = points.span[0], points.span[1]
    distance = moved[first:last]
    for moment in range(2):
        for n in range(points.counts[moment]):
            row, amount, total = points.rows[points.pressed[moment, n]], 0.5 * points.amounts[moment, n], 0.0
            for number in range(count):
                work[number] += amount * row[rigid[number]] * moved[rigid[number]]
            row = row[first:last]
            for k in range(len(distance)):
                total += row[k] * distance[k]
            work[count] += amount * total
    note_exchange(work, energy.parts[CONTACT], energy.extreme)
