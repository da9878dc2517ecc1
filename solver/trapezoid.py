"""The implicit time loop: exact modal motion under the mean force of each step, contact by the trapezoidal rule.

Over a step every force is constant at its mean, so each coordinate moves exactly (`solver.flight`). A contact's mean
is ½ (λₙ + λ⁺), and 0 ≤ λ⁺ ⊥ g⁺ ≥ 0 at the end of the step, with

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

from solver.books import balance, exchange, load_work, relax
from solver.compliance import FAST, gather, inner
from solver.lcp import solve_lcp
from solver.rods import adjust, aim, hold
from solver.sliding import (
    drag_along,
    follow,
    image_of,
    move_masters,
    push_masters,
    renew,
    scatter,
    strain_masters,
)

GAP_TOLERANCE = 1e-12
"""Violation of a gap that counts as none, relative to the largest gap."""
PASSES = 4
FAR = 1.0
"""Gap of a point beyond its traction space [m]."""


@njit(cache=True, fastmath=FAST)
def march(  # type: ignore[no-untyped-def]
    dt, modes, points, masters, matrix, loads, books, first, given, crank, directions, forces, amounts, energies,
    snapshots, stride,
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
    iterate = slides or len(loads.lengths) > 0
    for number in range(len(forces)):
        for step in range(stride):
            here = number * stride + step
            aim(dt, modes, loads, given[here], crank[here])
            _fly(modes, points, loads, masters, dt)
            if slides:
                if follow(modes, points, masters, matrix):
                    renew(points, masters, matrix, books.tally)
                _half(modes, points, masters, matrix, 0)
                move_masters(modes, masters, matrix)
            _free_gaps(modes, points, masters, matrix, loads)
            hold(dt, modes, points, loads, crank[here])
            for trial in range(PASSES):
                _shift(points, loads)
                if slides:
                    _catch_up(points, masters, matrix)
                if not _close(points, matrix, books.tally, trial):
                    return False
                if not adjust(points, loads, iterate):
                    break
            _finish(modes, points, loads)
            if slides:
                _half(modes, points, masters, matrix, 1)
                move_masters(modes, masters, matrix)
                drag_along(points, masters, matrix)
            loads.pin[:] = crank[here]
            relax(points, masters, loads, books, dt)
            held = load_work(modes, points, loads, books)
            balance(modes, points, masters, books, held, (first + here + 1) * dt)
            exchange(modes, points, books)
            _sample(points, loads, directions, forces[number], amounts[number], stride)
        energies[number] = books.energy
        _snapshot(modes, loads, books, snapshots[number])
    return True


@inner
def _press(points, multipliers, force):  # type: ignore[no-untyped-def]
    """Add half of the multipliers to the generalised forces."""
    rows, first, last = points.rows, points.span[0], points.span[1]
    for i in range(len(multipliers)):
        half = 0.5 * multipliers[i]
        if half != 0.0:
            for k in range(first, last):
                force[k] += half * rows[i, k]


@inner
def _fly(modes, points, loads, masters, dt):  # type: ignore[no-untyped-def]
    """Move everything under the loads and the first half of the contact forces."""
    q, v, before, force, motion, push = modes.q, modes.v, modes.before, modes.force, modes.motion, modes.push
    last, drag, amount, held = points.last, masters.drag, loads.amount, loads.stress
    last[:] = points.multipliers
    points.guess[:] = last
    force[:] = modes.gravity
    _press(points, last, force)
    for i in range(len(amount)):
        row = loads.rows[i]
        for k in range(len(q)):
            force[k] += amount[i] * row[k]
        held[i] = loads.memory[0, i] * held[i] + loads.memory[1, i] * amount[i]
    for number in range(len(drag)):
        if drag[number] != 0.0:
            masters.drag_impulse[number] += dt * drag[number]
            row = masters.slide[number]
            for k in range(len(q)):
                force[k] += drag[number] * row[k]
    for k in range(len(q)):
        position, velocity = q[k], v[k]
        before[0, k], before[1, k] = position, velocity
        q[k] = motion[0, k] * position + motion[1, k] * velocity + push[0, k] * force[k]
        v[k] = motion[2, k] * position + motion[3, k] * velocity + push[1, k] * force[k]
    strain, image, memory = points.strain, points.image, points.memory
    for i in range(len(strain)):
        strain[i] = memory[0, i] * strain[i] + memory[1, i] * image[i]


@inner
def _half(modes, points, masters, matrix, end):  # type: ignore[no-untyped-def]
    """Put the forces at the start (end = 0) or at the end of the step (1) onto the traction spaces, half each."""
    if end:
        onto = masters.second
        onto[:] = 0.0
        scatter(matrix, points.contact, masters.place, masters.along, points.multipliers, 0.5, onto)
    else:
        onto = masters.onto
        onto[:] = 0.0
        scatter(matrix, points.contact, masters.old_place, masters.old_along, points.last, 0.5, onto)
        masters.strain[:] *= masters.memory[0]
    push_masters(modes, masters, onto)
    strain_masters(masters, matrix, onto, 1 + end)


@inner
def _free_gaps(modes, points, masters, matrix, loads):  # type: ignore[no-untyped-def]
    """Gaps at the end of the step without the contact forces of its end."""
    q, columns, free, gap, strain = modes.q, points.columns, points.free, points.gap, points.strain
    held, to_gap, contact, place = loads.stress, loads.to_gap, points.contact, masters.place
    for i in range(len(free)):
        free[i] = gap[i] + strain[i]
        for number in range(len(held)):
            free[i] += to_gap[i, number] * held[number]
    for k in range(points.span[0], points.span[1]):
        amount = q[k]
        for i in range(len(free)):
            free[i] += columns[k, i] * amount
    if len(masters.stress) > 0:
        gather(matrix.space, contact, place, matrix.across, masters.along, masters.inward, 1.0, free)
        for i in range(len(free)):
            if matrix.space[contact[i], 2] > 0 and place[i, 1] < 0:
                free[i] = FAR


@inner
def _shift(points, loads):  # type: ignore[no-untyped-def]
    """Add the corrections of the joints to the free gaps."""
    shifted, per_load = points.shifted, loads.gap_per_load
    shifted[:] = points.free
    for j in range(len(loads.correction)):
        lateral, along = loads.middle[j, 0] * loads.correction[j], loads.middle[j, 1] * loads.correction[j]
        for i in range(len(shifted)):
            shifted[i] += per_load[i, 2 * j] * lateral + per_load[i, 2 * j + 1] * along


@inner
def _catch_up(points, masters, matrix):  # type: ignore[no-untyped-def]
    """Add what the matrix, as it was made, misses of the masters' response to the guess."""
    guess, contact, work = points.guess, points.contact, masters.work
    onto = masters.second
    onto[:] = 0.0
    scatter(matrix, contact, masters.place, masters.along, guess, 1.0, onto)
    image_of(matrix, onto, work)
    gather(matrix.space, contact, masters.place, matrix.across, masters.along, work, 1.0, points.shifted)
    onto[:] = 0.0
    scatter(matrix, contact, matrix.place, matrix.along, guess, 1.0, onto)
    image_of(matrix, onto, work)
    gather(matrix.space, contact, matrix.place, matrix.across, matrix.along, work, -1.0, points.shifted)


@inner
def _close(points, matrix, tally, trial):  # type: ignore[no-untyped-def]
    """Multipliers at the end of the step; False where the rows are dependent."""
    shifted, scale = points.shifted, 0.0
    for i in range(len(shifted)):
        if shifted[i] < 0.5 * FAR:
            scale = max(scale, abs(shifted[i]))
    tally[0], pivots = solve_lcp(
        matrix, shifted, points.active, tally[0], points.factor, points.multipliers, points.gaps, GAP_TOLERANCE * scale
    )
    tally[2] += pivots
    tally[4] += trial > 0
    return pivots >= 0


@inner
def _finish(modes, points, loads):  # type: ignore[no-untyped-def]
    """Add the second half of the contact forces and the joints' corrections to the motion."""
    q, v, more, force, push = modes.q, modes.v, modes.more, modes.force, modes.push
    more[:] = 0.0
    _press(points, points.multipliers, more)
    for j in range(len(loads.correction)):
        loads.rod[j] += loads.correction[j]
        for axis in range(2):
            number, amount = 2 * j + axis, loads.middle[j, axis] * loads.correction[j]
            loads.amount[number] += amount
            loads.stress[number] += loads.memory[1, number] * amount
            row = loads.rows[number]
            for k in range(len(q)):
                more[k] += amount * row[k]
    for k in range(len(q)):
        force[k] += more[k]
        q[k] += push[0, k] * more[k]
        v[k] += push[1, k] * more[k]


@inner
def _sample(points, loads, directions, forces, amounts, stride):  # type: ignore[no-untyped-def]
    mean, contact = points.mean, points.contact
    for i in range(len(mean)):
        if mean[i] != 0.0:
            share = mean[i] / stride
            for axis in range(3):
                forces[contact[i], axis] += share * directions[i, axis]
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
