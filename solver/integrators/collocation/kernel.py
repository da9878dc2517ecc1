"""Collocation of contact forces on exact modal motion, compiled.

Over a step of length h the force of every contact is the cubic through its values at the four Lobatto points 0,
(1 ∓ 1/√5)/2 and 1. The response of the coordinates to such forces is exact, so indentation and rate at the points are
linear in the values, and the law at the points gives as many equations as unknowns. Step lengths are H/2^level, so that
what depends on h is tabulated once.
"""

import numpy as np

from gudgeon.solver.compiled import allocating, copy, inner
from gudgeon.solver.integrators.balance import LOST, update_balance
from gudgeon.solver.integrators.collocation.arrays import (
    FASTEST,
    ITERATIONS,
    LAST,
    REFERENCE,
    REJECTED,
    STEPS,
    TIME,
    Table,
    Trial,
)
from gudgeon.solver.integrators.collocation.estimate import MONOMIALS, POINTS, WEIGHTS, cubic, missed, unbalanced
from gudgeon.solver.integrators.elimination import eliminate
from gudgeon.solver.laws.force import law_energy, law_force

RATES = np.array([[sum(m * MONOMIALS[j, m] * x ** (m - 1) for m in range(1, 4)) for j in range(4)] for x in POINTS])
"""Derivative at each point of the cubic that is 1 at one point and 0 at the others, times h, (4, 4)."""
LEVELS, NEWTON_STEPS = 64, 40
EPS = float(np.finfo(float).eps)
GOING, FULL, OVER, MISSING, FAILED = 0, 1, 2, 3, 4


@allocating
def march(tables, constants, motion, track, end):  # type: ignore[no-untyped-def]
    """Advance until contact is over, `end` [s] is passed, the track is full or a level's table is missing.

    Returns:
        Code and number of accepted steps.
    """
    c, fixed = len(constants.rows), constants.fixed
    trial = Trial(
        guess=np.zeros((c, 4)), values=np.zeros((c, 4)), depth=np.zeros((c, 4)), rate=np.zeros((c, 4)),
        loose=np.empty((c, 3)), loose_rate=np.empty((c, 3)), matrix=np.empty((3 * c, 3 * c)), wrong=np.empty(3 * c),
    )  # fmt: skip
    values, depth, known, count = trial.values, trial.depth, np.zeros(c), 0
    while True:
        if motion.clock[TIME] >= end:
            return GOING, count
        if count == len(track.start):
            return FULL, count
        level = motion.level[0]
        if not tables.known[level]:
            return MISSING, count
        table = Table(
            length=tables.length[level], free=tables.free[level], drift=tables.drift[level], push=tables.push[level],
            gap=tables.gap[level], gap_drift=tables.gap_drift[level], reach=tables.reach[level],
        )  # fmt: skip
        _predict(motion, table.length, trial.guess)
        copy(motion.approach, known)
        top = motion.clock[FASTEST]
        good = _solve(table, constants, motion, trial)
        error = _error(constants, motion, trial, table.length) if good else np.inf
        allowed = constants.tolerance * motion.clock[REFERENCE]
        # The part of the error by round-off does not shrink with the step.
        small = error * 25 < allowed or (good and error <= _round_off(constants, motion, depth))
        if fixed < 0 and not small and error > allowed:
            motion.counts[REJECTED] += 1
            copy(known, motion.approach)
            motion.clock[FASTEST] = top
            if level + 1 >= LEVELS:
                return FAILED, count
            drop = int(np.ceil(np.log2(error / allowed) / 4)) if error < np.inf else 1
            motion.level[0] = min(level + max(1, drop), LEVELS - 1)
            continue
        if not good:
            return FAILED, count
        track.lost[count, 0] = motion.balance[LOST]
        _accept(table, constants, motion, track, trial, count)
        _balance(constants, motion, trial, table.length)
        track.lost[count, 1] = motion.balance[LOST]
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
    """Predict the forces [N] at the four points from the cubics of the step before."""
    before, last = motion.before, motion.clock[LAST]
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
def _error(constants, motion, trial, h):  # type: ignore[no-untyped-def]
    """Return the error of the step [N], the larger of two estimates, and set depth and rate at its start."""
    values, depth, rate = trial.values, trial.depth, trial.rate
    for i in range(len(values)):
        gap, speed = _gap_and_rate(constants, motion, i)
        depth[i, 0], rate[i, 0] = -gap - constants.series[i] * values[i, 0], -speed
        for k in range(4):
            rate[i, 0] -= constants.series[i] * RATES[0, k] * values[i, k] / h
    forces = missed(motion.before, motion.clock[LAST], h, values)
    return max(forces, unbalanced(constants.law, motion.clock[REFERENCE], h, values, depth, rate))


@inner
def _gap_and_rate(constants, motion, i):  # type: ignore[no-untyped-def]
    """Return the gap [m] of a contact at the start of the step, without R, and its rate [m/s]."""
    gap, rate = constants.gap[i], 0.0
    for k in range(len(motion.y)):
        gap += constants.rows[i, k] * motion.y[k]
        rate += constants.rows[i, k] * motion.v[k]
    return gap, rate


@inner
def _round_off(constants, motion, depth):  # type: ignore[no-untyped-def]
    """Return the largest change [N] of an elastic force by the round-off of its gap."""
    worst = 0.0
    for i in range(len(depth)):
        blur = abs(constants.gap[i])
        for k in range(len(motion.y)):
            blur += abs(constants.rows[i, k] * motion.y[k])
        blur *= EPS
        deepest = max(depth[i, 1], depth[i, 2], depth[i, 3])
        if blur == 0.0 or deepest < -blur:
            continue
        low, _, _ = law_force(constants.law[i], deepest, 0.0, 1.0)
        high, _, _ = law_force(constants.law[i], max(deepest, 0.0) + blur, 0.0, 1.0)
        worst = max(worst, blur * (high - low) / (blur + (high - low) * constants.series[i]))
    return worst


@inner
def _solve(table, constants, motion, trial):  # type: ignore[no-untyped-def]
    """Compute the forces [N] at the last three points by Newton's method; False where it does not converge."""
    guess, values, depth, rate, loose, loose_rate, matrix, wrong = trial
    c = len(values)
    _free_gaps(table, constants, motion, trial)
    _set_approach(table, constants, motion, trial)
    for i in range(c):
        copy(guess[i], values[i])
    for _iteration in range(NEWTON_STEPS):
        motion.counts[ITERATIONS] += 1
        for i in range(c):
            for j in range(3):
                deep, fast = _pressed(table, constants, values, i, j)
                depth[i, j + 1], rate[i, j + 1] = deep - loose[i, j], fast - loose_rate[i, j]
        _linearise(table, constants, motion, trial)
        if not eliminate(matrix, wrong):
            return False
        largest, step = 0.0, 0.0
        for i in range(c):
            for j in range(3):
                change = wrong[3 * i + j]
                largest, step = max(largest, abs(values[i, j + 1])), max(step, abs(change))
                values[i, j + 1] = max(values[i, j + 1] - change, 0.0)
        if step <= 1e-13 * max(largest, motion.clock[REFERENCE]):
            return True
    return False


@inner
def _free_gaps(table, constants, motion, trial):  # type: ignore[no-untyped-def]
    """Compute gaps [m] and rates [m/s] at the last three points with the forces of the first point only."""
    c, n = constants.rows.shape
    y, v, guess, loose, loose_rate = motion.y, motion.v, trial.guess, trial.loose, trial.loose_rate
    gap, drift, reach = table.gap, table.gap_drift, table.reach
    for i in range(c):
        for j in range(3):
            place, speed = constants.gap[i] + drift[0, j, i], drift[1, j, i]
            for k in range(n):
                place += gap[0, j, i, k] * y[k] + gap[0, j, i, n + k] * v[k]
                speed += gap[1, j, i, k] * y[k] + gap[1, j, i, n + k] * v[k]
            for other in range(c):
                place += reach[0, i, other, j, 0] * guess[other, 0]
                speed += reach[1, i, other, j, 0] * guess[other, 0]
            loose[i, j], loose_rate[i, j] = place, speed


@inner
def _set_approach(table, constants, motion, trial):  # type: ignore[no-untyped-def]
    """Set the approach speed [m/s] of contacts that close in the step, at the zero of the predicted gap."""
    guess, loose, loose_rate = trial.guess, trial.loose, trial.loose_rate
    for i in range(len(loose)):
        if motion.approach[i] > 0.0:
            continue
        gap, rate = _gap_and_rate(constants, motion, i)
        for j in range(3):
            deep, fast = _pressed(table, constants, guess, i, j)
            later, later_rate = loose[i, j] - deep, loose_rate[i, j] - fast
            if later < 0.0:
                # Under constant forces the square of the speed is linear in the displacement.
                share = gap / (gap - later) if gap > 0.0 else 0.0
                speed = np.sqrt(max(rate**2 + share * (later_rate**2 - rate**2), 0.0))
                motion.clock[FASTEST] = max(motion.clock[FASTEST], speed)
                motion.approach[i] = max(speed, constants.floor * motion.clock[FASTEST])
                break
            gap, rate = later, later_rate


@inner
def _pressed(table, constants, values, i, j):  # type: ignore[no-untyped-def]
    """Return the part of indentation [m] and rate [m/s] at one of the last three points by the forces at these."""
    h, reach, series = table.length, table.reach, constants.series[i]
    deep, fast = -series * values[i, j + 1], 0.0
    for other in range(len(values)):
        for k in range(1, 4):
            deep -= reach[0, i, other, j, k] * values[other, k]
            fast -= reach[1, i, other, j, k] * values[other, k]
    for k in range(4):
        fast -= series * RATES[j + 1, k] * values[i, k] / h
    return deep, fast


@inner
def _linearise(table, constants, motion, trial):  # type: ignore[no-untyped-def]
    """Set the residual of the laws [N], (3 c,), and its derivative by the force values, (3 c, 3 c)."""
    h, reach = table.length, table.reach
    _, values, depth, rate, _, _, matrix, wrong = trial
    for i in range(len(values)):
        series = constants.series[i]
        for j in range(3):
            force, by_depth, by_rate = law_force(constants.law[i], depth[i, j + 1], rate[i, j + 1], motion.approach[i])
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
def _accept(table, constants, motion, track, trial, count):  # type: ignore[no-untyped-def]
    """Append a step to the track, and set y [m kg^½] and ẏ to those at its end."""
    c, n = constants.rows.shape
    y, v, h, values, depth, rate = motion.y, motion.v, table.length, trial.values, trial.depth, trial.rate
    free, drift, push = table.free, table.drift, table.push
    track.start[count], track.length[count] = motion.clock[TIME], h
    copy(y, track.y[count])
    copy(v, track.v[count])
    for k in range(n):
        place = free[0, k] * y[k] + free[1, k] * v[k] + drift[0, k]
        speed = free[2, k] * y[k] + free[3, k] * v[k] + drift[1, k]
        for i in range(c):
            given, change = 0.0, 0.0
            for j in range(4):
                given += push[0, j, k] * values[i, j]
                change += push[1, j, k] * values[i, j]
            place += constants.rows[i, k] * given
            speed += constants.rows[i, k] * change
        y[k], v[k] = place, speed
    for i in range(c):
        copy(values[i], track.values[count, i])
        copy(values[i], motion.before[i])
        motion.force[i] = values[i, 3]
        motion.clock[REFERENCE] = max(motion.clock[REFERENCE], values[i, 3])
        track.opening[count, 0, i], track.opening[count, 1, i] = -depth[i, 3], -rate[i, 3]
    motion.clock[TIME] += h
    motion.clock[LAST] = h
    motion.counts[STEPS] += 1


@inner
def _balance(constants, motion, trial, h):  # type: ignore[no-untyped-def]
    """Update the energy balance [J]; losses are integrated from forces and rates, independently of the states."""
    values, depth, rate, stored = trial.values, trial.depth, trial.rate, 0.0
    for i in range(len(values)):
        law, given = constants.law[i], 0.0
        for j in range(4):
            given = max(given, values[i, j])
        if given == 0.0:
            # A surface that recovers without force loses all its energy, however long the step.
            motion.balance[LOST] += law_energy(law, depth[i, 0]) - law_energy(law, depth[i, 3])
        else:
            for j in range(4):
                deep, fast = depth[i, j], rate[i, j]
                elastic = law[0] * deep ** law[1] if deep > 0.0 else 0.0
                motion.balance[LOST] += h * WEIGHTS[j] * (values[i, j] - elastic) * fast
        stored += law_energy(law, depth[i, 3]) + 0.5 * constants.series[i] * values[i, 3] ** 2
    update_balance(constants, motion.y, motion.v, stored, motion.balance)
