"""The implicit time loop: exact modal motion under the mean force of each step, contact by the trapezoidal rule.

Over a step every force is constant at its mean, so each coordinate moves exactly (`integrators.flight`). A contact's
mean is ½ (λₙ + λ⁺), and 0 ≤ λ⁺ ⊥ g⁺ ≥ 0 at the end of the step, with

    g⁺ = g₀ + rows q⁺ + R r⁺ + N⁺ e⁺ + layer λ⁺,   r + β ṙ = λ, λ linear within the step

the residual flexibility R as a Kelvin-Voigt element of the body's damping β (r = λ without it), and e the inward
displacement of another body's traction space with weights N that follow the sliding pair. What contact forces do to
gaps within the step makes the matrix base + N M Nᵀ of the complementarity problem. The mean force on the master is
½ (Nₙᵀλₙ + N⁺ᵀλ⁺); what is left of λ̄ᵀΔ(N e) is the drag of a deformed surface, λ̄ᵀΔN ē, and acts along the line
of sliding. A joint's force holds the length |P − C| = L in g + ½ dt ġ = 0, which brings a
violation back within one step. The trapezoidal rule keeps the energy of contact where no point opens or closes.
"""

import numpy as np

from gudgeon.solver.compiled import copy, embedded, entry, inner, ordered
from gudgeon.solver.contact.compliance import Listed, combine, know
from gudgeon.solver.contact.lcp import solve_lcp
from gudgeon.solver.integrators.impact_log import GOING, ROW, changes, log_step, note_change
from gudgeon.solver.integrators.implicit.energy import (
    balance,
    exchange,
    follow_residual,
    load_work,
    relax,
    relax_masters,
)
from gudgeon.solver.integrators.implicit.open_contacts import may_touch, next_step, sum_multipliers
from gudgeon.solver.integrators.implicit.rods import direction, follow_contact_forces, force_without_contact
from gudgeon.solver.integrators.implicit.sliding import (
    FAR,
    displace_masters,
    drag_along,
    is_bound,
    press_as_expected,
    press_masters,
    rebuild_matrix,
    start_masters,
    surface_displacement,
    update_sliding_distance,
    update_weights,
)
from gudgeon.solver.integrators.outcome import ACTIVE, CONTACT_STEPS, PIVOTS
from gudgeon.solver.integrators.paths import keep_paths
from gudgeon.solver.integrators.peaks import keep_peaks

GAP_TOLERANCE = 1e-12
"""Violation of a gap that is accepted, relative to the largest gap."""
PASSES = 4
"""Largest number of contact solutions in a step, since rods and sliding surfaces depend on the forces."""


@entry
def march(arrays, drive, out, first, stride):  # type: ignore[no-untyped-def]
    """Advance `len(out.forces)` samples of `stride` steps each; False where contact rows are linearly dependent.

    Args:
        arrays: The Arrays, changed in place.
        drive: The Drive of these steps.
        out: The Samples; all but the gauges are filled.
        first: Number of the first step.
    """
    dt, modes, points, masters = arrays.dt, arrays.modes, arrays.points, arrays.masters
    matrix, loads, bounds, energy, log = arrays.matrix, arrays.loads, arrays.bounds, arrays.energy, arrays.log
    slides = len(masters.residual_force) > 0
    for number in range(len(out.forces)):
        for step in range(number * stride, (number + 1) * stride):
            direction(modes, loads, drive, step, dt)
            _fly(modes, points, loads, masters, dt)
            _free_gaps_of_candidates(arrays, slides)
            force_without_contact(modes, points, loads, drive.crank[step], dt)
            if not _solve_contact(arrays, slides):
                return False
            _apply(modes, loads)
            if slides:
                displace_masters(masters, matrix)
                drag_along(modes, points, masters, matrix)
                relax_masters(masters, energy, dt)
            next_step(bounds)
            for j in range(len(loads.pin)):
                copy(drive.crank[step, j], loads.pin[j])
            relax(points, matrix, loads, bounds, energy, dt)
            held = load_work(modes, points, loads, energy)
            balance(modes, points, masters, matrix, energy, held)
            exchange(modes, points, energy)
            if energy.counts[ACTIVE] > 0:
                energy.counts[CONTACT_STEPS] += 1
            _sample(loads, out.loads[number], stride)
            if points.counts[0] > 0 or points.counts[1] > 0 or log.counts[GOING] > 0:
                _resultants(points, log, out.forces[number], stride)
                _note_changes(arrays, (first + step + 1) * dt)
                log_step(log, first + step)
        copy(energy.parts, out.energies[number])
        _snapshot(modes, loads, energy.rigid, out.snapshots[number])
        state, until = (modes.q, modes.v, points.multipliers), first // stride + number + 1
        keep_paths(out.paths, number, modes.q, points.multipliers)
        keep_peaks(out.peaks, out.forces[number], until, state, masters.residual_force)
    return True


@inner
def _fly(modes, points, loads, masters, dt):  # type: ignore[no-untyped-def]
    """Set q [m kg^½] and q̇ to the end of the step under the loads and the first half of the contact forces."""
    q, v, before, force, motion, push = modes.q, modes.v, modes.before, modes.force, modes.motion, modes.push
    amount, held, count = loads.amount, loads.residual_force, points.counts
    copy(points.multipliers, points.last)
    copy(points.multipliers, points.guess)
    count[0] = count[1]
    for n in range(count[0]):
        points.pressed[0, n], points.amounts[0, n] = points.pressed[1, n], points.amounts[1, n]
    copy(q, before[0])
    copy(v, before[1])
    copy(modes.gravity, force)
    # Until the forces of the step are found, `moved` has q at its end under the contact forces of its start.
    start_force = modes.moved
    start_force[:] = 0.0
    listed = Listed(points.pressed[0], points.amounts[0], count[0])
    combine(points.rows, listed, 0.5, points.span[0], points.span[1], start_force)
    for k in range(len(force)):
        force[k] += start_force[k]
    for i in range(len(amount)):
        row = loads.rows[i]
        for k in range(len(force)):
            force[k] += amount[i] * row[k]
        held[i] = loads.memory[0, i] * held[i] + loads.memory[1, i] * amount[i]
    for k in range(len(force)):
        force[k] += masters.force[k]
    for number in range(len(masters.drag)):
        drag = masters.drag[number]
        if drag != 0.0:
            masters.drag_impulse[number] += dt * drag
            row = masters.slide[number]
            for k in range(len(force)):
                force[k] += drag * row[k]
    q0, v0 = before[0], before[1]
    for k in range(len(q)):
        q[k] = motion[0, k] * q0[k] + motion[1, k] * v0[k] + push[0, k] * force[k]
    for k in range(len(v)):
        v[k] = motion[2, k] * q0[k] + motion[3, k] * v0[k] + push[1, k] * force[k]
    for k in range(len(q)):
        start_force[k] = q[k] + push[0, k] * start_force[k]
    displacement, response, memory = points.residual_displacement, points.response, points.memory
    first, second = memory[0], memory[1]
    for i in range(len(displacement)):
        displacement[i] = first[i] * displacement[i] + second[i] * response[i]


@embedded
def _free_gaps_of_candidates(arrays, slides):  # type: ignore[no-untyped-def]
    """Set which contacts may touch, and the gaps [m] of their points without the forces of the step's end."""
    modes, points, masters = arrays.modes, arrays.points, arrays.masters
    matrix, loads, bounds, energy = arrays.matrix, arrays.loads, arrays.bounds, arrays.energy
    candidate = matrix.candidate
    modes.end_force[:] = 0.0
    stale = slides and update_sliding_distance(modes, masters, matrix)
    for k in range(len(candidate)):
        candidate[k] = bounds.pressed[0, k] > 0.0 or may_touch(modes, points, matrix, loads, bounds, k)
    for a in range(points.active.size[0]):
        candidate[points.contact[points.active.rows[a]]] = True
    for k in range(len(candidate)):
        if candidate[k] and slides:
            update_weights(masters, matrix, k)
    if stale:
        rebuild_matrix(masters, matrix, points.active)
        energy.counts[3] += 1
    if slides:
        start_masters(masters)
    for k in range(len(candidate)):
        if candidate[k]:
            know(matrix, k, points.active.rows, points.active.size[0])
            _free_gaps(modes, points, masters, matrix, loads, k)


@inner
def _free_gaps(modes, points, masters, matrix, loads, k):  # type: ignore[no-untyped-def]
    """Set the gaps [m] of contact k at the end of the step, without masters and without the forces of its end.

    Where bodies slide, they are those under the contact forces of the step's start.
    """
    first, last = matrix.block[k, 0], matrix.block[k, 1]
    if not points.followed[k]:
        follow_residual(points, loads, first, last)
        points.followed[k] = True
    own, q = points.coordinates, modes.q[points.span[0] : points.span[1]]
    free, gap, displacement = points.free[first:last], points.gap[first:last], points.residual_displacement[first:last]
    for i in range(len(free)):
        free[i] = gap[i] + displacement[i]
    if len(masters.residual_force) > 0:
        response, end = points.response[first:last], points.memory[2, first:last]
        for i in range(len(free)):
            free[i] += end[i] * response[i]
        for n in range(points.counts[0]):
            i = points.pressed[0, n]
            if first <= i < last:
                points.free[i] += points.layer[i] * points.amounts[0, n]
        q = modes.moved[points.span[0] : points.span[1]]
    given = Listed(loads.numbers, loads.residual_force, len(loads.residual_force))
    combine(loads.to_gap, given, 1.0, first, last, points.free)
    combine(points.columns, Listed(own, q, len(own)), 1.0, first, last, points.free)
    if matrix.space[k, 2] > 0:
        surface_displacement(modes, masters, matrix, k)
        corner = masters.corner[0, first:last]
        for i in range(len(free)):
            if corner[i] < 0:
                free[i] = FAR
                masters.left[0] += points.multipliers[first + i] > 0.0


@embedded
def _solve_contact(arrays, slides):  # type: ignore[no-untyped-def]
    """Find the contact forces [N] of the end of the step; False where the rows are dependent."""
    modes, points, masters = arrays.modes, arrays.points, arrays.masters
    matrix, loads, bounds, energy = arrays.matrix, arrays.loads, arrays.bounds, arrays.energy
    counts, iterate, guess = energy.counts, slides or len(loads.lengths) > 0, 0
    while True:
        for trial in range(PASSES):
            for exact in range(2):
                _shift(points, matrix, loads)
                if slides:
                    expected = Listed(points.pressed[guess], points.amounts[guess], points.counts[guess])
                    press_as_expected(points, masters, matrix, expected, (guess == 1, exact == 1))
                if not _solve_lcp(points, matrix, counts):
                    return False
                if not (slides and is_bound(points, masters)):
                    break
            counts[4] += trial > 0
            guess = 1
            if not follow_contact_forces(points, loads, iterate):
                break
        _contact_forces(modes, points, masters, matrix, loads)
        sum_multipliers(bounds, points, matrix)
        overlooked = False
        for k in range(len(matrix.candidate)):
            if not matrix.candidate[k] and may_touch(modes, points, matrix, loads, bounds, k):
                overlooked = matrix.candidate[k] = True
                counts[5] += 1
                if slides:
                    update_weights(masters, matrix, k)
                know(matrix, k, points.active.rows, points.active.size[0])
                _free_gaps(modes, points, masters, matrix, loads, k)
        if not overlooked:
            return True


@inner
def _shift(points, matrix, loads):  # type: ignore[no-untyped-def]
    """Set the gaps [m] with the effect of the joints' corrections."""
    for k in range(len(matrix.candidate)):
        if matrix.candidate[k]:
            first, last = matrix.block[k, 0], matrix.block[k, 1]
            copy(points.free[first:last], points.shifted[first:last])
            for j in range(len(loads.correction)):
                rod = Listed(loads.numbers[2 * j :], loads.direction[j], 2)
                combine(loads.gap_per_load, rod, loads.correction[j], first, last, points.shifted)


@inner
def _solve_lcp(points, matrix, counts):  # type: ignore[no-untyped-def]
    """Find the multipliers [N] at the end of the step for the shifted gaps; False where the rows are dependent."""
    shifted, scale, multipliers, active = points.shifted, 0.0, points.multipliers, points.active
    for k in range(len(matrix.candidate)):
        if matrix.candidate[k]:
            scale = max(scale, _largest(shifted[matrix.block[k, 0] : matrix.block[k, 1]]))
    pivots = solve_lcp(matrix, shifted, active, multipliers, points.gaps, GAP_TOLERANCE * scale)
    counts[ACTIVE] = active.size[0]
    counts[PIVOTS] += pivots
    count = 0
    for a in range(counts[ACTIVE]):
        row = active.rows[a]
        if multipliers[row] != 0.0:
            points.pressed[1, count], points.amounts[1, count] = row, multipliers[row]
            count += 1
    points.counts[1] = count
    return pivots >= 0


@ordered
def _largest(gaps):  # type: ignore[no-untyped-def]
    """Return the largest gap [m], but for points beyond their traction space."""
    largest = 0.0
    for i in range(len(gaps)):
        largest = max(largest, abs(gaps[i]) if gaps[i] < 0.5 * FAR else 0.0)
    return largest


@inner
def _contact_forces(modes, points, masters, matrix, loads):  # type: ignore[no-untyped-def]
    """Find the generalised forces of the second half of the contact forces and of the joints' corrections."""
    force, listed = modes.end_force, Listed(points.pressed[1], points.amounts[1], points.counts[1])
    force[:] = 0.0
    combine(points.rows, listed, 0.5, points.span[0], points.span[1], force)
    for j in range(len(loads.correction)):
        rod = Listed(loads.numbers[2 * j :], loads.direction[j], 2)
        combine(loads.rows, rod, loads.correction[j], 0, len(force), force)
    if len(masters.force):
        press_masters(masters, matrix, listed)
        for k in range(len(force)):
            force[k] += masters.force[k]


@inner
def _apply(modes, loads):  # type: ignore[no-untyped-def]
    """Add the effect of these forces to q, q̇ and the forces of the step."""
    q, v, end_force, force, push = modes.q, modes.v, modes.end_force, modes.force, modes.push
    for j in range(len(loads.correction)):
        loads.rod[j] += loads.correction[j]
        for axis in range(2):
            number, amount = 2 * j + axis, loads.direction[j, axis] * loads.correction[j]
            loads.amount[number] += amount
            loads.residual_force[number] += loads.memory[1, number] * amount
    for k in range(len(q)):
        q[k] += push[0, k] * end_force[k]
    for k in range(len(v)):
        v[k] += push[1, k] * end_force[k]
    for k in range(len(force)):
        force[k] += end_force[k]


@inner
def _sample(loads, amounts, stride):  # type: ignore[no-untyped-def]
    """Add the mean loads of a step to those of its sample."""
    for i in range(len(amounts)):
        amounts[i] += loads.amount[i] / stride


@inner
def _resultants(points, log, forces, stride):  # type: ignore[no-untyped-def]
    """Set the mean resultant of each contact in the step [N], and add it to that of its sample."""
    resultant, multipliers = log.force, points.multipliers
    for moment in range(2):
        for n in range(points.counts[moment]):
            i, amount = points.pressed[moment, n], points.amounts[moment, n]
            k = points.contact[i]
            for axis in range(3):
                resultant[k, axis] += 0.5 * amount * points.directions[i, axis]
            if multipliers[i] > multipliers[log.steps[k, ROW]]:
                log.steps[k, ROW] = i
    for k in range(len(resultant)):
        for axis in range(3):
            forces[k, axis] += resultant[k, axis] / stride


@inner
def _note_changes(arrays, time):  # type: ignore[no-untyped-def]
    """Tell the log which contacts touch and which part at the end of the step, at a time [s]."""
    modes, points, masters, log = arrays.modes, arrays.points, arrays.masters, arrays.log
    for k in range(len(log.force)):
        acts = arrays.bounds.pressed[1, k] > 0.0
        if not changes(log, k, acts):
            continue
        i = log.steps[k, ROW]
        if acts:
            rate = _rate(points, masters, arrays.matrix, i, modes.before[1])
            gap = points.gaps[i]
            for n in range(points.counts[1]):
                gap -= arrays.matrix.values[arrays.matrix.pattern.at[i] + points.pressed[1, n]] * points.amounts[1, n]
            note_change(log, k, True, time, gap, rate)
        else:
            rate = _rate(points, masters, arrays.matrix, i, modes.v)
            note_change(log, k, False, time, points.gaps[i], rate)


@inner
def _rate(points, masters, matrix, i, v):  # type: ignore[no-untyped-def]
    """Return the rate [m/s] of the gap of a point by the velocities of the coordinates."""
    row, rate, corner = points.rows[i], 0.0, masters.corner[0, i]
    width, across = matrix.space[points.contact[i], 1], matrix.across
    for k in range(len(v)):
        rate += row[k] * v[k]
    if corner >= 0:
        for b in range(4):
            for a in range(4):
                function, part = masters.functions[corner + b * width + a], 0.0
                for k in range(len(v)):
                    part += function[k] * v[k]
                rate += masters.along[0, b, i] * across[i, a] * part
    return rate


@inner
def _snapshot(modes, loads, rigid, out):  # type: ignore[no-untyped-def]
    """Put rigid coordinates, their rates, and the length error [m] of each joint into a sample."""
    r = len(rigid)
    for a in range(r):
        out[a], out[r + a] = modes.q[rigid[a]], modes.v[rigid[a]]
    for j in range(len(loads.lengths)):
        lateral = loads.anchor[j, 0] + loads.displacement[2 * j] - loads.pin[j, 0]
        along = loads.anchor[j, 1] + loads.displacement[2 * j + 1] - loads.pin[j, 1]
        out[2 * r + j] = np.hypot(lateral, along) - loads.lengths[j]
