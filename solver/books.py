"""Energies and work of the implicit loop, kept at every step."""

from solver.compliance import inner

KINETIC, STRAIN, CONTACT, DISSIPATED, WORK = 0, 1, 2, 3, 4


@inner
def relax(points, masters, loads, books, dt):  # type: ignore[no-untyped-def]
    """Bring the residual deformations up to date, with the energy that their damping took."""
    now, last, image, strain = points.multipliers, points.last, points.image, points.strain
    stress, whole, mean, residual = points.stress, points.whole, points.mean, points.residual
    to_gap, held, impulses = loads.to_gap, loads.stress, points.impulses
    c, lost = len(now), 0.0
    image[:] = 0.0
    for i in range(c):
        amount = now[i]
        if amount != 0.0:
            for j in range(c):
                image[j] += amount * residual[i, j]
    memory = points.memory
    for i in range(c):
        mean[i], before = 0.5 * (last[i] + now[i]), stress[i]
        impulses[i] += dt * mean[i]
        strain[i] += memory[2, i] * image[i]
        after, place = memory[0, i] * before + memory[1, i] * last[i] + memory[2, i] * now[i], strain[i]
        for number in range(len(held)):
            place += to_gap[i, number] * held[number]
        lost += (mean[i] - 0.5 * (before + after)) * (place - whole[i])
        stress[i], whole[i] = after, place
    memory, onto, second = masters.memory, masters.onto, masters.second
    stress, whole, strain, impulses = masters.stress, masters.whole, masters.strain, masters.impulses
    for f in range(len(onto)):
        force, before = onto[f] + second[f], stress[f]
        impulses[f] += dt * force
        after = memory[0, f] * before + 2 * (memory[1, f] * onto[f] + memory[2, f] * second[f])
        lost += (force - 0.5 * (before + after)) * (strain[f] - whole[f])
        stress[f], whole[f] = after, strain[f]
    books.energy[DISSIPATED] += lost


@inner
def load_work(modes, points, loads, books):  # type: ignore[no-untyped-def]
    """Account for loads and joints; returns twice the energy held in their residual deformation [J]."""
    q, stress, to_gap, amount = modes.q, points.stress, loads.to_gap, loads.amount
    held = 0.0
    for i in range(len(amount)):
        moved, whole, row = 0.0, 0.0, loads.rows[i]
        for k in range(len(q)):
            moved += row[k] * q[k]
        for j in range(len(amount)):
            whole += loads.residual[i, j] * loads.stress[j]
        for j in range(len(stress)):
            if stress[j] != 0.0:
                whole += to_gap[j, i] * stress[j]
        held += loads.stress[i] * whole
        books.energy[WORK] += amount[i] * (moved + whole - loads.place[i])
        middle = 0.5 * (loads.stress[i] + loads.before[i])
        books.energy[DISSIPATED] += (amount[i] - middle) * (whole - loads.whole[i])
        loads.place[i], loads.whole[i], loads.before[i] = moved + whole, whole, loads.stress[i]
    return held


@inner
def balance(modes, points, masters, books, held, time):  # type: ignore[no-untyped-def]
    """Energies at the end of the step and the balance so far."""
    q, v, q0, v0, force, loss = modes.q, modes.v, modes.before[0], modes.before[1], modes.force, modes.loss
    stiffness, gravity, energy, extreme = modes.stiffness, modes.gravity, books.energy, books.extreme
    kinetic, strain, work, lost = 0.0, 0.0, 0.0, 0.0
    for k in range(len(q)):
        kinetic += v[k] * v[k]
        strain += stiffness[k] * q[k] * q[k]
        work += gravity[k] * (q[k] - q0[k])
        lost += loss[0, k] * q0[k] * q0[k] + loss[1, k] * q0[k] * v0[k] + loss[2, k] * v0[k] * v0[k]
        lost += (loss[3, k] * q0[k] + loss[4, k] * v0[k] + loss[5, k] * force[k]) * force[k]
    layer, now, stress, whole, gaps = 0.0, points.multipliers, points.stress, points.whole, points.gaps
    for i in range(len(now)):
        held += stress[i] * whole[i]
        layer += points.layer[i] * now[i] * now[i]
        extreme[3] = max(extreme[3], -gaps[i])
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


@inner
def exchange(modes, points, books):  # type: ignore[no-untyped-def]
    """Work of the contacts on each rigid coordinate and on all, and the largest exchange so far."""
    q, q0, rows, mean, rigid, work = modes.q, modes.before[0], points.rows, points.mean, books.rigid, books.work
    total, swing, count = 0.0, 0.0, len(rigid)
    for i in range(len(mean)):
        amount = mean[i]
        if amount != 0.0:
            for number in range(count):
                k = rigid[number]
                work[number] += amount * rows[i, k] * (q[k] - q0[k])
            for k in range(points.span[0], points.span[1]):
                total += amount * rows[i, k] * (q[k] - q0[k])
    work[count] += total
    rest = work[count]
    for number in range(count):
        swing += abs(work[number])
        rest -= work[number]
    books.extreme[2] = max(books.extreme[2], 0.5 * (swing + abs(rest) + books.energy[CONTACT]))
