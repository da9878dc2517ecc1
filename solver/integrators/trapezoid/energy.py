"""Energies and work of the implicit loop, kept at every step. Loops are short: vector units take few arrays at once."""

from gudgeon.solver.compiled import inner, ordered
from gudgeon.solver.contact.compliance import combine

KINETIC, STRAIN, CONTACT, DISSIPATED, WORK = 0, 1, 2, 3, 4


@inner
def relax(points, loads, books, dt):  # type: ignore[no-untyped-def]
    """Bring the residual deformation of the points up to date, with the energy that its damping took."""
    now, last, image, strain, memory = points.multipliers, points.last, points.image, points.strain, points.memory
    stress, whole, after, place, lost = points.stress, points.whole, points.after, points.place, 0.0
    image[:] = 0.0
    combine(points.residual, points.pressed[1], points.amounts[1], points.counts[1], 1.0, 0, len(now), image)
    for i in range(len(strain)):
        strain[i] += memory[2, i] * image[i]
    place[:] = strain
    for number in range(len(loads.stress)):
        row, amount = loads.to_gap[number], loads.stress[number]
        for i in range(len(place)):
            place[i] += row[i] * amount
    for i in range(len(after)):
        after[i] = memory[0, i] * stress[i] + memory[1, i] * last[i] + memory[2, i] * now[i]
    for i in range(len(after)):
        lost += 0.5 * (last[i] + now[i] - stress[i] - after[i]) * (place[i] - whole[i])
    stress[:] = after
    whole[:] = place
    for moment in range(2):
        for n in range(points.counts[moment]):
            points.impulses[points.pressed[moment, n]] += 0.5 * dt * points.amounts[moment, n]
    books.energy[DISSIPATED] += lost


@inner
def relax_masters(masters, books, dt):  # type: ignore[no-untyped-def]
    """Do the same for the traction spaces."""
    first, second, strain, memory, lost = masters.onto[0], masters.onto[1], masters.strain, masters.memory, 0.0
    stress, whole, after, impulses = masters.stress, masters.whole, masters.after, masters.impulses
    for f in range(len(after)):
        after[f] = memory[0, f] * stress[f] + 2 * (memory[1, f] * first[f] + memory[2, f] * second[f])
    for f in range(len(after)):
        lost += (first[f] + second[f] - 0.5 * (stress[f] + after[f])) * (strain[f] - whole[f])
    for f in range(len(impulses)):
        impulses[f] += dt * (first[f] + second[f])
    stress[:] = after
    whole[:] = strain
    books.energy[DISSIPATED] += lost


@inner
def load_work(modes, points, loads, books):  # type: ignore[no-untyped-def]
    """Account for loads and joints; returns twice the energy held in their residual deformation [J]."""
    q, stress, amount, held = modes.q, points.stress, loads.amount, 0.0
    for i in range(len(amount)):
        moved, whole, row, to_gap = 0.0, 0.0, loads.rows[i], loads.to_gap[i]
        for k in range(len(q)):
            moved += row[k] * q[k]
        for j in range(len(amount)):
            whole += loads.residual[i, j] * loads.stress[j]
        for j in range(len(stress)):
            whole += to_gap[j] * stress[j]
        held += loads.stress[i] * whole
        books.energy[WORK] += amount[i] * (moved + whole - loads.place[i])
        middle = 0.5 * (loads.stress[i] + loads.before[i])
        books.energy[DISSIPATED] += (amount[i] - middle) * (whole - loads.whole[i])
        loads.place[i], loads.whole[i], loads.before[i] = moved + whole, whole, loads.stress[i]
    return held


@inner
def balance(modes, points, masters, matrix, books, held, time):  # type: ignore[no-untyped-def]
    """Energies at the end of the step and the balance so far."""
    q, v, q0, v0, force, loss = modes.q, modes.v, modes.before[0], modes.before[1], modes.force, modes.loss
    stiffness, gravity, moved = modes.stiffness, modes.gravity, modes.moved
    energy, extreme = books.energy, books.extreme
    kinetic, strain, work, lost = 0.0, 0.0, 0.0, 0.0
    for k in range(len(q)):
        moved[k] = q[k] - q0[k]
    for k in range(len(q)):
        kinetic += v[k] * v[k]
        strain += stiffness[k] * q[k] * q[k]
        work += gravity[k] * moved[k]
        lost += loss[0, k] * q0[k] * q0[k] + loss[1, k] * q0[k] * v0[k] + loss[2, k] * v0[k] * v0[k]
        lost += (loss[3, k] * q0[k] + loss[4, k] * v0[k] + loss[5, k] * force[k]) * force[k]
    layer, stress, whole = 0.0, points.stress, points.whole
    for i in range(len(stress)):
        held += stress[i] * whole[i]
    for n in range(points.counts[1]):
        layer += points.layer[points.pressed[1, n]] * points.amounts[1, n] ** 2
    for k in range(len(matrix.block)):
        if matrix.near[k]:
            extreme[3] = max(extreme[3], _deepest(points.gaps[matrix.block[k, 0] : matrix.block[k, 1]]))
    stress, whole = masters.stress, masters.strain
    for f in range(len(stress)):
        held += stress[f] * whole[f]
    energy[KINETIC], energy[STRAIN], energy[CONTACT] = 0.5 * kinetic, 0.5 * (strain + held), 0.5 * layer
    energy[DISSIPATED] += lost
    energy[WORK] += work
    error = energy[KINETIC] + energy[STRAIN] + energy[CONTACT] + energy[DISSIPATED] - energy[WORK] - extreme[0]
    extreme[1] = max(extreme[1], abs(error))
    if books.tally[0] > 0:
        books.tally[1] += 1
        if extreme[4] < 0.0:
            extreme[4] = time
        extreme[5] = time


@ordered
def _deepest(gaps):  # type: ignore[no-untyped-def]
    deepest = 0.0
    for i in range(len(gaps)):
        deepest = max(deepest, -gaps[i])
    return deepest


@inner
def exchange(modes, points, books):  # type: ignore[no-untyped-def]
    """Work of the contacts on each rigid coordinate and on all, and the largest exchange so far."""
    moved, rigid, work, swing, count = modes.moved, books.rigid, books.work, 0.0, len(books.rigid)
    first, last = points.span[0], points.span[1]
    way = moved[first:last]
    for moment in range(2):
        for n in range(points.counts[moment]):
            row, amount, total = points.rows[points.pressed[moment, n]], 0.5 * points.amounts[moment, n], 0.0
            for number in range(count):
                work[number] += amount * row[rigid[number]] * moved[rigid[number]]
            row = row[first:last]
            for k in range(len(way)):
                total += row[k] * way[k]
            work[count] += amount * total
    rest = work[count]
    for number in range(count):
        swing += abs(work[number])
        rest -= work[number]
    books.extreme[2] = max(books.extreme[2], 0.5 * (swing + abs(rest) + books.energy[CONTACT]))
