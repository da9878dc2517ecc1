"""The massless rods of slider-cranks in the implicit loop: direction before a step, force that holds the length."""

import numpy as np

from gudgeon.solver.compiled import copy, inner, ordered

SETTLED = 1e-3
"""Change of the multipliers in a pass, relative to the largest, up to which it was the last. At 2e-2 the energy drift
of an elastic piston did not fall with the step; below 1e-3 nothing changes any more."""


@inner
def direction(modes, loads, drive, step, dt):  # type: ignore[no-untyped-def]
    """Set the loads of a step [N]: the given ones, and each rod's last force in its direction at mid-step."""
    amount, middle, v, crank = loads.amount, loads.direction, modes.v, drive.crank[step]
    copy(drive.loads[step], amount)
    for j in range(len(middle)):
        norm = 0.0
        for axis in range(2):
            row, rate = loads.rows[2 * j + axis], 0.0
            for k in range(len(v)):
                rate += row[k] * v[k]
            here = loads.anchor[j, axis] + loads.displacement[2 * j + axis]
            middle[j, axis] = 2 * here + dt * rate - loads.pin[j, axis] - crank[j, axis]
            norm += middle[j, axis] ** 2
        for axis in range(2):
            middle[j, axis] /= np.sqrt(norm)
            amount[2 * j + axis] = middle[j, axis] * loads.rod[j]


@inner
def force_without_contact(modes, points, loads, crank, dt):  # type: ignore[no-untyped-def]
    """Set each rod's correction [N] for g + ½ dt ġ = 0 at the end of the step with λ⁺ = λ, and its slopes over λ⁺."""
    q, v, last, force, memory = modes.q, modes.v, points.last, points.residual_force, points.memory
    slopes = loads.slopes
    for j in range(len(loads.lengths)):
        arm, speed = loads.arm[0], loads.arm[1]
        for axis in range(2):
            number = 2 * j + axis
            row, place, rate = loads.rows[number], loads.anchor[j, axis], 0.0
            for k in range(len(q)):
                place += row[k] * q[k]
                rate += row[k] * v[k]
            for i in range(len(loads.residual_force)):
                place += loads.residual[number, i] * loads.residual_force[i]
            per_row, to_gap = loads.joint_per_row[number], loads.to_gap[number]
            for i in range(len(last)):
                place += to_gap[i] * (memory[0, i] * force[i] + memory[1, i] * last[i]) + per_row[i] * last[i]
            arm[axis] = place - crank[j, axis]
            speed[axis] = rate - crank[j, 2 + axis]
        length = np.hypot(arm[0], arm[1])
        n0, n1 = arm[0] / length, arm[1] / length
        error = length - loads.lengths[j] + 0.5 * dt * (n0 * speed[0] + n1 * speed[1])
        T, m0, m1 = loads.joint_response[j], loads.direction[j, 0], loads.direction[j, 1]
        give = n0 * (T[0, 0] * m0 + T[0, 1] * m1) + n1 * (T[1, 0] * m0 + T[1, 1] * m1)
        loads.correction_before[j] = -error / give
        loads.correction[j] = loads.correction_before[j]
        along, up, slope = loads.joint_per_row[2 * j], loads.joint_per_row[2 * j + 1], slopes[j]
        n0, n1 = n0 / give, n1 / give
        for i in range(len(slope)):
            slope[i] = n0 * along[i] + n1 * up[i]


@inner
def follow_contact_forces(points, loads, iterate):  # type: ignore[no-untyped-def]
    """Correct the rods' forces [N] by the multipliers that were found; returns whether another pass is needed."""
    now, last, guess = points.multipliers, points.last, points.guess
    change, top = _change(now, guess)
    copy(now, guess)
    for j in range(len(loads.lengths)):
        total, slope = loads.correction_before[j], loads.slopes[j]
        for i in range(len(now)):
            total -= slope[i] * (now[i] - last[i])
        loads.correction[j] = total
    return iterate and change > SETTLED * top


@ordered
def _change(now, guess):  # type: ignore[no-untyped-def]
    """Return the largest difference and the largest multiplier."""
    change, top = 0.0, 0.0
    for i in range(len(now)):
        change = max(change, abs(now[i] - guess[i]))
        top = max(top, now[i])
    return change, top
