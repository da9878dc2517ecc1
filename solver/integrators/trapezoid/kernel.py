"""The implicit time loop: exact modal motion under the mean force of each step, contact by the trapezoidal rule.

Over a step every force is constant at its mean, so each coordinate moves exactly (`integrators.flight`). A contact's
mean is ½ (λₙ + λ⁺), and 0 ≤ λ⁺ ⊥ g⁺ ≥ 0 at the end of the step, with

    g⁺ = g₀ + rows q⁺ + R r⁺ + N⁺ e⁺ + layer λ⁺,   r + β ṙ = λ, λ linear within the step

the residual flexibility R as a Kelvin-Voigt element of the body's damping β (r = λ without it), and e the inward
displacement of another body's traction space with weights N that follow the sliding pair. What contact forces do to
gaps within the step makes the matrix base + N M Nᵀ of the complementarity problem. The mean force on the master is
½ (Nₙᵀλₙ + N⁺ᵀλ⁺); what is left of λ̄ᵀΔ(N e) is the drag of a deformed surface, λ̄ᵀΔN ē, and acts along the way of
sliding. A joint's force holds the length |P − C| = L in g + ½ dt ġ = 0, which brings a
violation back within one step. The trapezoidal rule keeps the energy of contact where no point opens or closes.
"""

import numpy as np
from numba import njit

from gudgeon.solver.compiled import FAST, inner, ordered
from gudgeon.solver.contact.compliance import combine
from gudgeon.solver.contact.lcp import solve_lcp
from gudgeon.solver.integrators.trapezoid.energy import balance, exchange, load_work, relax, relax_masters
from gudgeon.solver.integrators.trapezoid.open_contacts import add_up, may_touch, settle
from gudgeon.solver.integrators.trapezoid.rods import adjust, aim, hold
from gudgeon.solver.integrators.trapezoid.sliding import (
    FAR,
    carry,
    catch_up,
    drag_along,
    follow,
    keep_up,
    press_masters,
    renew,
    start_masters,
    strain_masters,
)

GAP_TOLERANCE = 1e-12
"""Violation of a gap that counts as none, relative to the largest gap."""
PASSES = 4


@njit(cache=True, fastmath=FAST)
def march(  # type: ignore[no-untyped-def]
    dt, modes, points, masters, matrix, loads, bounds, books, first, given, crank, directions, forces, amounts,
    energies, snapshots, stride,
):  # fmt: skip
    """Advance `len(forces)` samples of `stride` steps each; the groups change in place.

    Args:
        first: Number of the first step.
        given: Mean of each load row over each step, zero for joints', (steps, L).
        crank: Crank pins at the end of each step, (steps, j, 4).
        directions: Of each row's force on its body, (c, 3).
        forces: Out: mean resultant of each contact, (samples, k, 3).
        amounts: Out: mean of each load row, (samples, L).
        energies: Out: (samples, 5).
        snapshots: Out: rigid coordinates and rates at the end of each sample, then each joint's length error,
            (samples, 2 r + j).

    Returns:
        False where the contact rows proved linearly dependent.
    """
    slides = len(masters.stress) > 0
    for number in range(len(forces)):
        for step in range(stride):
            here = number * stride + step
            aim(dt, modes, loads, given[here], crank[here])
            _fly(modes, points, loads, masters, dt)
            _look(modes, points, masters, matrix, loads, bounds, books.tally, slides)
            hold(dt, modes, points, loads, crank[here])
            if not _press(modes, points, masters, matrix, loads, bounds, books.tally, slides):
                return False
            _finish(modes, points, loads)
            if slides:
                strain_masters(masters, matrix)
                drag_along(modes, points, masters, matrix)
                relax_masters(masters, books, dt)
            settle(bounds)
            loads.pin[:] = crank[here]
            relax(points, loads, books, dt)
            held = load_work(modes, points, loads, books)
            balance(modes, points, masters, matrix, books, held, (first + here + 1) * dt)
            exchange(modes, points, books)
            _sample(points, loads, directions, forces[number], amounts[number], stride)
        energies[number] = books.energy
        _snapshot(modes, loads, books, snapshots[number])
    return True


@inner
def _fly(modes, points, loads, masters, dt):  # type: ignore[no-untyped-def]
    """Move everything under the loads and the first half of the contact forces."""
    q, v, before, force, motion, push = modes.q, modes.v, modes.before, modes.force, modes.motion, modes.push
    amount, held, count = loads.amount, loads.stress, points.counts
    points.last[:] = points.multipliers
    points.guess[:] = points.multipliers
    count[0] = count[1]
    points.pressed[0, : count[0]] = points.pressed[1, : count[0]]
    points.amounts[0, : count[0]] = points.amounts[1, : count[0]]
    before[0], before[1] = q, v
    force[:] = modes.gravity
    combine(points.rows, points.pressed[0], points.amounts[0], count[0], 0.5, points.span[0], points.span[1], force)
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
    strain, image, memory = points.strain, points.image, points.memory
    for i in range(len(strain)):
        strain[i] = memory[0, i] * strain[i] + memory[1, i] * image[i]


@inner
def _look(modes, points, masters, matrix, loads, bounds, tally, slides):  # type: ignore[no-untyped-def]
    """Tell which contacts are near, and find the gaps of their points without the forces of the end of the step."""
    modes.more[:] = 0.0
    stale = slides and follow(modes, masters, matrix)
    for k in range(len(matrix.near)):
        matrix.near[k] = bounds.pressed[0, k] > 0.0 or may_touch(modes, points, matrix, loads, bounds, k)
        if matrix.near[k] and slides:
            keep_up(masters, matrix, k)
    if stale:
        renew(points, masters, matrix, tally)
    if slides:
        start_masters(masters)
    for k in range(len(matrix.near)):
        if matrix.near[k]:
            _free_gaps(modes, points, masters, matrix, loads, k, slides)


@inner
def _free_gaps(modes, points, masters, matrix, loads, k, slides):  # type: ignore[no-untyped-def]
    """Gaps of a contact's points, less what masters do, at the end of the step without the forces of its end."""
    first, last = matrix.block[k, 0], matrix.block[k, 1]
    own, q = points.coordinates, modes.q[points.span[0] : points.span[1]]
    free, gap, strain = points.free[first:last], points.gap[first:last], points.strain[first:last]
    for i in range(len(free)):
        free[i] = gap[i] + strain[i]
    combine(loads.to_gap, loads.numbers, loads.stress, len(loads.stress), 1.0, first, last, points.free)
    combine(points.columns, own, q, len(own), 1.0, first, last, points.free)
    if slides and matrix.space[k, 2] > 0:
        carry(modes, masters, matrix, k)
        corner = masters.corner[0, first:last]
        for i in range(len(free)):
            if corner[i] < 0:
                free[i] = FAR


@inner
def _press(modes, points, masters, matrix, loads, bounds, tally, slides):  # type: ignore[no-untyped-def]
    """Find the forces of the end of the step; False where the rows are dependent."""
    iterate, guess = slides or len(loads.lengths) > 0, 0
    while True:
        for trial in range(PASSES):
            _shift(points, matrix, loads)
            if slides:
                catch_up(points, masters, matrix, points.pressed[guess], points.amounts[guess], points.counts[guess])
            if not _close(points, matrix, tally):
                return False
            tally[4] += trial > 0
            guess = 1
            if not adjust(points, loads, iterate):
                break
        _answer(modes, points, masters, matrix, loads, slides)
        add_up(bounds, points, matrix)
        overlooked = False
        for k in range(len(matrix.near)):
            if not matrix.near[k] and may_touch(modes, points, matrix, loads, bounds, k):
                overlooked = matrix.near[k] = True
                tally[5] += 1
                if slides:
                    keep_up(masters, matrix, k)
                _free_gaps(modes, points, masters, matrix, loads, k, slides)
        if not overlooked:
            return True


@inner
def _shift(points, matrix, loads):  # type: ignore[no-untyped-def]
    """Add the corrections of the joints to the free gaps."""
    for k in range(len(matrix.near)):
        if matrix.near[k]:
            first, last = matrix.block[k, 0], matrix.block[k, 1]
            points.shifted[first:last] = points.free[first:last]
            for j in range(len(loads.correction)):
                per_load, numbers = loads.gap_per_load, loads.numbers[2 * j :]
                combine(per_load, numbers, loads.middle[j], 2, loads.correction[j], first, last, points.shifted)


@inner
def _close(points, matrix, tally):  # type: ignore[no-untyped-def]
    """Multipliers at the end of the step; False where the rows are dependent."""
    shifted, scale, multipliers, active = points.shifted, 0.0, points.multipliers, points.active
    for k in range(len(matrix.near)):
        if matrix.near[k]:
            scale = max(scale, _size(shifted[matrix.block[k, 0] : matrix.block[k, 1]]))
    tally[0], pivots = solve_lcp(
        matrix, shifted, active, tally[0], points.factor, multipliers, points.gaps, GAP_TOLERANCE * scale
    )
    tally[2] += pivots
    count = 0
    for a in range(tally[0]):
        if multipliers[active[a]] != 0.0:
            points.pressed[1, count], points.amounts[1, count] = active[a], multipliers[active[a]]
            count += 1
    points.counts[1] = count
    return pivots >= 0


@ordered
def _size(gaps):  # type: ignore[no-untyped-def]
    """Return the largest gap, but for points beyond their traction space."""
    largest = 0.0
    for i in range(len(gaps)):
        largest = max(largest, abs(gaps[i]) if gaps[i] < 0.5 * FAR else 0.0)
    return largest


@inner
def _answer(modes, points, masters, matrix, loads, slides):  # type: ignore[no-untyped-def]
    """Find the generalised forces of the second half of the contact forces and of the joints' corrections."""
    more, rows, count = modes.more, points.pressed[1], points.counts[1]
    more[:] = 0.0
    combine(points.rows, rows, points.amounts[1], count, 0.5, points.span[0], points.span[1], more)
    for j in range(len(loads.correction)):
        combine(loads.rows, loads.numbers[2 * j :], loads.middle[j], 2, loads.correction[j], 0, len(more), more)
    if slides:
        press_masters(masters, matrix, rows, points.amounts[1], count)
        for k in range(len(more)):
            more[k] += masters.force[k]


@inner
def _finish(modes, points, loads):  # type: ignore[no-untyped-def]
    """Add them to the motion."""
    q, v, more, force, push = modes.q, modes.v, modes.more, modes.force, modes.push
    for j in range(len(loads.correction)):
        loads.rod[j] += loads.correction[j]
        for axis in range(2):
            number, amount = 2 * j + axis, loads.middle[j, axis] * loads.correction[j]
            loads.amount[number] += amount
            loads.stress[number] += loads.memory[1, number] * amount
    for k in range(len(q)):
        q[k] += push[0, k] * more[k]
    for k in range(len(v)):
        v[k] += push[1, k] * more[k]
    for k in range(len(force)):
        force[k] += more[k]


@inner
def _sample(points, loads, directions, forces, amounts, stride):  # type: ignore[no-untyped-def]
    for moment in range(2):
        for n in range(points.counts[moment]):
            i, share = points.pressed[moment, n], 0.5 * points.amounts[moment, n] / stride
            for axis in range(3):
                forces[points.contact[i], axis] += share * directions[i, axis]
    for i in range(len(amounts)):
        amounts[i] += loads.amount[i] / stride


@inner
def _snapshot(modes, loads, books, out):  # type: ignore[no-untyped-def]
    r, rigid = len(books.rigid), books.rigid
    for a in range(r):
        out[a], out[r + a] = modes.q[rigid[a]], modes.v[rigid[a]]
    for j in range(len(loads.lengths)):
        lateral = loads.anchor[j, 0] + loads.place[2 * j] - loads.pin[j, 0]
        along = loads.anchor[j, 1] + loads.place[2 * j + 1] - loads.pin[j, 1]
        out[2 * r + j] = np.hypot(lateral, along) - loads.lengths[j]
