"""Collocation of contact forces on exact modal motion, compiled.

Over a step of length h the force of every contact is the cubic through its values at the four Lobatto points 0,
(1 ∓ 1/√5)/2 and 1. Coordinates answer such forces exactly, so indentation and rate at the points are linear in the
values, and the law at the points gives as many equations as unknowns. Step lengths are H/2^level, so that what depends
on h is tabulated once.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.compiled import entry, inner
from gudgeon.solver.integrators.collocation.estimate import MONOMIALS, POINTS, WEIGHTS, cubic, missed, unbalanced
from gudgeon.solver.laws.force import law_energy, law_force

RATES = np.array([[sum(m * MONOMIALS[j, m] * x ** (m - 1) for m in range(1, 4)) for j in range(4)] for x in POINTS])
"""Derivative at each point of each of these cubics, per h, (4, 4)."""
LEVELS = 64
ITERATIONS = 40
EPS = float(np.finfo(float).eps)
GOING, FULL, OVER, MISSING, FAILED = 0, 1, 2, 3, 4


class Tables(NamedTuple):
    """What depends on the step. Shapes: L levels, c contacts, n coordinates."""

    known: np.ndarray
    """(L,)"""
    length: np.ndarray
    """h [s], (L,)."""
    free: np.ndarray
    """y←y, y←ẏ, ẏ←y, ẏ←ẏ, (L, 4, n)."""
    drift: np.ndarray
    """What constant forces add to y and ẏ, (L, 2, n)."""
    push: np.ndarray
    """y and ẏ per unit force value at each point, (L, 2, 4, n)."""
    gap: np.ndarray
    """Rate of g and g itself over y and ẏ at the last three points: (L, 2, 3, c, 2 n)."""
    gap_drift: np.ndarray
    """(L, 2, 3, c)"""
    reach: np.ndarray
    """Change of g and of its rate at the last three points per force value, (L, 2, c, c, 3, 4)."""


class Contacts(NamedTuple):
    """Shapes: c contacts, n coordinates."""

    rows: np.ndarray
    """∂g/∂y, (c, n)."""
    gap: np.ndarray
    """(c,)"""
    series: np.ndarray
    """R in series with each law [m/N], (c,)."""
    law: np.ndarray
    """(c, 4)"""


class Motion(NamedTuple):
    """What changes; arrays are updated in place."""

    y: np.ndarray
    v: np.ndarray
    force: np.ndarray
    """At the start of the step, (c,)."""
    before: np.ndarray
    """Values of the step before, (c, 4)."""
    approach: np.ndarray
    """v⁻ of each contact [m/s], 0 where it is open, (c,)."""
    clock: np.ndarray
    """Time, length of the step before or 0, reference force, largest approach speed, (4,)."""
    level: np.ndarray
    """Level of the next step, (1,)."""
    books: np.ndarray
    """Energy lost to laws, largest energy error, largest exchange, E₀, (4,)."""
    tally: np.ndarray
    """Steps, rejected steps, iterations, (3,)."""


class Track(NamedTuple):
    """Accepted steps, b of them at most."""

    start: np.ndarray
    """(b,)"""
    length: np.ndarray
    values: np.ndarray
    """(b, c, 4)"""
    y: np.ndarray
    """At the start, (b, n)."""
    v: np.ndarray
    lost: np.ndarray
    """Energy that laws have lost by its start and end, (b, 2)."""
    opening: np.ndarray
    """Gap and its rate at the end, (b, 2, c)."""


@entry
def march(tables, contacts, motion, track, stiffness, constant, start, end, tolerance, fixed, floor):  # type: ignore[no-untyped-def]
    """Advance until contact is over, time is up, the track is full or a level's table is missing.

    Args:
        stiffness: ω² (n,).
        constant: Constant forces, (n,).
        start: y at the start of the run, from which constant forces do work, (n,).
        end: [s]
        tolerance: Error of forces and energy over those of the reference force; round-off of gaps is allowed for.
        fixed: Level that every step has, or −1.
        floor: Least approach speed, relative to the largest.

    Returns:
        Code and number of accepted steps.
    """
    c = len(contacts.rows)
    values, guess = np.zeros((c, 4)), np.zeros((c, 4))
    depth, rate = np.zeros((c, 4)), np.zeros((c, 4))
    known, count = np.zeros(c), 0
    while True:
        if motion.clock[0] >= end:
            return GOING, count
        if count == len(track.start):
            return FULL, count
        level = motion.level[0]
        if not tables.known[level]:
            return MISSING, count
        h = tables.length[level]
        _predict(motion, h, guess)
        known[:], top = motion.approach, motion.clock[3]
        good = _solve(tables, contacts, motion, level, guess, values, depth, rate, floor)
        error = _error(contacts, motion, h, values, depth, rate) if good else np.inf
        allowed = tolerance * motion.clock[2]
        # What round-off adds to the error does not shrink with the step.
        small = error * 25 < allowed or (good and error <= _round_off(contacts, motion, depth))
        if fixed < 0 and not small and error > allowed:
            motion.tally[1] += 1
            motion.approach[:], motion.clock[3] = known, top
            if level + 1 >= LEVELS:
                return FAILED, count
            drop = int(np.ceil(np.log2(error / allowed) / 4)) if error < np.inf else 1
            motion.level[0] = min(level + max(1, drop), LEVELS - 1)
            continue
        if not good:
            return FAILED, count
        track.lost[count, 0] = motion.books[0]
        _accept(tables, contacts, motion, track, count, level, values, depth, rate)
        _balance(contacts, motion, values, depth, rate, h, stiffness, constant, start)
        track.lost[count, 1] = motion.books[0]
        count += 1
        if fixed < 0 and level > 0 and small:
            motion.level[0] = level - 1
        closed = False
        for i in range(c):
            if values[i, 3] > 0.0 or depth[i, 3] > 0.0:
                closed = True
            elif depth[i, 3] < 0.0:
                motion.approach[i] = 0.0
        if not closed:
            return OVER, count


@inner
def _predict(motion, h, guess):  # type: ignore[no-untyped-def]
    """Carry the cubics of the step before on."""
    before, last = motion.before, motion.clock[1]
    for i in range(len(guess)):
        guess[i, 0] = motion.force[i]
        for j in range(1, 4):
            if last > 0.0 and motion.approach[i] > 0.0:
                x, total = 1.0 + POINTS[j] * h / last, 0.0
                for k in range(4):
                    total += before[i, k] * cubic(k, x)
                guess[i, j] = max(total, 0.0)
            else:
                guess[i, j] = motion.force[i]


@inner
def _error(contacts, motion, h, values, depth, rate):  # type: ignore[no-untyped-def]
    """Error of the step [N], of forces or of what their energy amounts to; fills in indentations at its start."""
    for i in range(len(values)):
        deep, fast = -contacts.gap[i], 0.0
        for k in range(len(motion.y)):
            deep -= contacts.rows[i, k] * motion.y[k]
            fast -= contacts.rows[i, k] * motion.v[k]
        depth[i, 0] = deep - contacts.series[i] * values[i, 0]
        rate[i, 0] = fast
        for k in range(4):
            rate[i, 0] -= contacts.series[i] * RATES[0, k] * values[i, k] / h
    forces = missed(motion.before, motion.clock[1], h, values)
    return max(forces, unbalanced(contacts.law, motion.clock[2], h, values, depth, rate))


@inner
def _round_off(contacts, motion, depth):  # type: ignore[no-untyped-def]
    """Largest change of an elastic force in the step by the round-off of its gap."""
    worst = 0.0
    for i in range(len(depth)):
        blur = abs(contacts.gap[i])
        for k in range(len(motion.y)):
            blur += abs(contacts.rows[i, k] * motion.y[k])
        blur *= EPS
        deepest = max(depth[i, 1], depth[i, 2], depth[i, 3])
        if blur == 0.0 or deepest < -blur:
            continue
        low, _, _ = law_force(contacts.law[i], deepest, 0.0, 1.0)
        high, _, _ = law_force(contacts.law[i], max(deepest, 0.0) + blur, 0.0, 1.0)
        worst = max(worst, blur * (high - low) / (blur + (high - low) * contacts.series[i]))
    return worst


@inner
def _solve(tables, contacts, motion, level, guess, values, depth, rate, floor):  # type: ignore[no-untyped-def]
    """Newton for the forces at the last three points of all contacts; False where it does not converge."""
    c = len(contacts.rows)
    loose, loose_rate = np.empty((c, 3)), np.empty((c, 3))
    _let_go(tables, contacts, motion, level, guess, loose, loose_rate)
    _note_approach(tables, contacts, motion, level, guess, loose, loose_rate, floor)
    values[:] = guess
    matrix, wrong = np.empty((3 * c, 3 * c)), np.empty(3 * c)
    for _iteration in range(ITERATIONS):
        motion.tally[2] += 1
        for i in range(c):
            for j in range(3):
                deep, fast = _pressed(tables, contacts, level, values, i, j)
                depth[i, j + 1], rate[i, j + 1] = deep - loose[i, j], fast - loose_rate[i, j]
        _linearise(tables, contacts, motion, level, values, depth, rate, matrix, wrong)
        if not _eliminate(matrix, wrong):
            return False
        largest, step = 0.0, 0.0
        for i in range(c):
            for j in range(3):
                change = wrong[3 * i + j]
                largest, step = max(largest, abs(values[i, j + 1])), max(step, abs(change))
                values[i, j + 1] = max(values[i, j + 1] - change, 0.0)
        if step <= 1e-13 * max(largest, motion.clock[2]):
            return True
    return False


@inner
def _let_go(tables, contacts, motion, level, guess, loose, loose_rate):  # type: ignore[no-untyped-def]
    """Gaps and their rates at the last three points if forces stood at the first one alone."""
    c, n = contacts.rows.shape
    y, v = motion.y, motion.v
    gap, drift, reach = tables.gap[level], tables.gap_drift[level], tables.reach[level]
    for i in range(c):
        for j in range(3):
            place, speed = contacts.gap[i] + drift[0, j, i], drift[1, j, i]
            for k in range(n):
                place += gap[0, j, i, k] * y[k] + gap[0, j, i, n + k] * v[k]
                speed += gap[1, j, i, k] * y[k] + gap[1, j, i, n + k] * v[k]
            for other in range(c):
                place += reach[0, i, other, j, 0] * guess[other, 0]
                speed += reach[1, i, other, j, 0] * guess[other, 0]
            loose[i, j], loose_rate[i, j] = place, speed


@inner
def _note_approach(tables, contacts, motion, level, guess, loose, loose_rate, floor):  # type: ignore[no-untyped-def]
    """Note the approach speed of contacts that close in the step, where the motion that is guessed reaches them."""
    for i in range(len(loose)):
        if motion.approach[i] > 0.0:
            continue
        gap, rate = contacts.gap[i], 0.0
        for k in range(len(motion.y)):
            gap += contacts.rows[i, k] * motion.y[k]
            rate += contacts.rows[i, k] * motion.v[k]
        for j in range(3):
            deep, fast = _pressed(tables, contacts, level, guess, i, j)
            later, later_rate = loose[i, j] - deep, loose_rate[i, j] - fast
            if later < 0.0:
                # Under constant forces the square of the speed is linear over the way.
                share = gap / (gap - later) if gap > 0.0 else 0.0
                speed = np.sqrt(max(rate**2 + share * (later_rate**2 - rate**2), 0.0))
                motion.clock[3] = max(motion.clock[3], speed)
                motion.approach[i] = max(speed, floor * motion.clock[3])
                break
            gap, rate = later, later_rate


@inner
def _pressed(tables, contacts, level, values, i, j):  # type: ignore[no-untyped-def]
    """What forces at the last three points add to indentation and rate of a contact at one of them."""
    h, reach, series = tables.length[level], tables.reach[level], contacts.series[i]
    deep, fast = -series * values[i, j + 1], 0.0
    for other in range(len(values)):
        for k in range(1, 4):
            deep -= reach[0, i, other, j, k] * values[other, k]
            fast -= reach[1, i, other, j, k] * values[other, k]
    for k in range(4):
        fast -= series * RATES[j + 1, k] * values[i, k] / h
    return deep, fast


@inner
def _linearise(tables, contacts, motion, level, values, depth, rate, matrix, wrong):  # type: ignore[no-untyped-def]
    """How far values miss the laws, (3 c,), and its derivative by the values."""
    h, reach = tables.length[level], tables.reach[level]
    for i in range(len(values)):
        series = contacts.series[i]
        for j in range(3):
            force, by_depth, by_rate = law_force(contacts.law[i], depth[i, j + 1], rate[i, j + 1], motion.approach[i])
            row = 3 * i + j
            wrong[row] = values[i, j + 1] - force
            for other in range(len(values)):
                for k in range(1, 4):
                    matrix[row, 3 * other + k - 1] = (
                        by_depth * reach[0, i, other, j, k] + by_rate * reach[1, i, other, j, k]
                    )
            for k in range(1, 4):
                matrix[row, 3 * i + k - 1] += by_rate * series * RATES[j + 1, k] / h
            matrix[row, row] += 1.0 + by_depth * series


@inner
def _eliminate(matrix, right):  # type: ignore[no-untyped-def]
    """Solve in place by Gauss with pivots."""
    size = len(right)
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        if not abs(matrix[best, k]) > 0.0:
            return False
        if best != k:
            for j in range(k, size):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
            right[k], right[best] = right[best], right[k]
        for i in range(k + 1, size):
            factor = matrix[i, k] / matrix[k, k]
            if factor != 0.0:
                for j in range(k + 1, size):
                    matrix[i, j] -= factor * matrix[k, j]
                right[i] -= factor * right[k]
    for k in range(size - 1, -1, -1):
        total = right[k]
        for j in range(k + 1, size):
            total -= matrix[k, j] * right[j]
        right[k] = total / matrix[k, k]
    return True


@inner
def _accept(tables, contacts, motion, track, count, level, values, depth, rate):  # type: ignore[no-untyped-def]
    c, n = contacts.rows.shape
    y, v, h = motion.y, motion.v, tables.length[level]
    free, drift, push = tables.free[level], tables.drift[level], tables.push[level]
    track.start[count], track.length[count] = motion.clock[0], h
    track.values[count], track.y[count], track.v[count] = values, y, v
    for k in range(n):
        place = free[0, k] * y[k] + free[1, k] * v[k] + drift[0, k]
        speed = free[2, k] * y[k] + free[3, k] * v[k] + drift[1, k]
        for i in range(c):
            given, kick = 0.0, 0.0
            for j in range(4):
                given += push[0, j, k] * values[i, j]
                kick += push[1, j, k] * values[i, j]
            place += contacts.rows[i, k] * given
            speed += contacts.rows[i, k] * kick
        y[k], v[k] = place, speed
    for i in range(c):
        motion.force[i] = values[i, 3]
        motion.clock[2] = max(motion.clock[2], values[i, 3])
        track.opening[count, 0, i], track.opening[count, 1, i] = -depth[i, 3], -rate[i, 3]
    motion.before[:] = values
    motion.clock[0] += h
    motion.clock[1] = h
    motion.tally[0] += 1


@inner
def _balance(contacts, motion, values, depth, rate, h, stiffness, constant, start):  # type: ignore[no-untyped-def]
    """Keep the energy balance: what laws lose is integrated from forces and rates, not from states."""
    stored, total = 0.0, 0.0
    for i in range(len(values)):
        law, given = contacts.law[i], 0.0
        for j in range(4):
            given = max(given, values[i, j])
        if given == 0.0:
            # A surface that recovers by itself gives all that it stored away, however long the step.
            motion.books[0] += law_energy(law, depth[i, 0]) - law_energy(law, depth[i, 3])
        else:
            for j in range(4):
                deep, fast = depth[i, j], rate[i, j]
                elastic = law[0] * deep ** law[1] if deep > 0.0 else 0.0
                motion.books[0] += h * WEIGHTS[j] * (values[i, j] - elastic) * fast
        stored += law_energy(law, depth[i, 3]) + 0.5 * contacts.series[i] * values[i, 3] ** 2
    for k in range(len(motion.y)):
        y, v = motion.y[k], motion.v[k]
        total += 0.5 * (v * v + stiffness[k] * y * y) - constant[k] * (y - start[k])
    error = total + stored + motion.books[0] - motion.books[3]
    motion.books[1] = max(motion.books[1], abs(error))
    motion.books[2] = max(motion.books[2], stored)
