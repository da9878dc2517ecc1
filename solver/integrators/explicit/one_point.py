"""The time loop of `explicit.kernel` for one contact point, with a single pass over the coordinates in each step.

The impulse of a step, the motion to the next and the gap and its rate there are one loop: the results of the general
loop to round-off, several times as fast.
"""

from gudgeon.solver.compiled import copy, entry, inner
from gudgeon.solver.integrators.explicit.kernel import (
    CONTACT,
    DISSIPATED,
    KINETIC,
    STRAIN,
    clear_steps,
    damped_force,
    flight_energies,
    fly,
    keep_balance,
    keep_ends,
)
from gudgeon.solver.integrators.impact_log import GOING, log_step, note_change
from gudgeon.solver.integrators.outcome import ACTIVE, DEEPEST


@entry
def march_one(constants, state, first, stride, out):  # type: ignore[no-untyped-def]
    """Advance `len(out.forces)` samples of `stride` steps each; arguments as `kernel.march`, one row."""
    dt, energy, extreme, counts = constants.dt, state.energy, state.extreme, state.counts
    row, q, v, log = constants.rows[0], state.q, state.v, state.log
    normal, going = constants.normals[0], log.counts
    spring, dashpot = 1.0 / constants.compliance[0, 0], constants.dashpot[0]
    mobility = _dot(row, row)
    gap, rate = constants.gap[0] + _dot(row, q), _dot(row, v)
    number, clear, forces, energies = first, 0, out.forces, out.energies
    for sample in range(len(forces)):
        pressed = 0.0
        for step in range(stride):
            force = 0.0
            if clear > 0:
                clear -= 1
                if going[GOING] > 0:
                    log_step(log, number)
            elif gap < 0.0:
                force = elastic = -gap * spring
                if dashpot > 0.0:
                    force, lost = damped_force(elastic, dashpot, rate, mobility, dt)
                    energy[DISSIPATED] += lost
                counts[ACTIVE] = 1
                energy[CONTACT] = 0.5 * elastic * -gap
                extreme[DEEPEST] = max(extreme[DEEPEST], -gap)
                pressed += force
                if force > 0.0 or going[GOING] > 0:
                    for axis in range(3):
                        log.force[0, axis] = force * normal[axis]
                    note_change(log, 0, force > 0.0, (number + 0.5) * dt, gap, rate)
                    log_step(log, number)
                gap, rate = _push_and_fly(constants, state, dt * force, rate, mobility)
                keep_balance(state)
            else:
                counts[ACTIVE] = 0
                energy[CONTACT] = 0.0
                clear = clear_steps(constants, state, gap)
                if going[GOING] > 0:
                    note_change(log, 0, force > 0.0, (number + 0.5) * dt, gap, rate)
                    log_step(log, number)
            state.multipliers[0] = force
            if step == stride - 1:
                if counts[ACTIVE] == 0:
                    flight_energies(constants, state)
                copy(energy, energies[sample])
            if counts[ACTIVE] == 0:
                fly(constants.flight, q, v)
                if clear == 0:
                    gap, rate = constants.gap[0] + _dot(row, q), _dot(row, v)
            number += 1
        for axis in range(3):
            forces[sample, 0, axis] = pressed / stride * normal[axis]
        keep_ends(constants, state, out, sample, number // stride)
    return True


@inner
def _dot(one, other):  # type: ignore[no-untyped-def]
    """Return the inner product of two vectors."""
    total = 0.0
    for k in range(len(one)):
        total += one[k] * other[k]
    return total


@inner
def _push_and_fly(constants, state, impulse, rate, mobility):  # type: ignore[no-untyped-def]
    """Apply an impulse [N s] and move to the next one; returns gap [m] and gap rate [m/s] there.

    Energies [J] are those in the middle of the impulse.
    """
    row, stiffness, q, v, rigid = constants.rows[0], constants.stiffness, state.q, state.v, constants.rigid
    qq, qv, vq, vv = constants.flight[0], constants.flight[1], constants.flight[2], constants.flight[3]
    for number in range(len(rigid)):
        push = row[rigid[number]] * impulse
        state.work[number] += push * (v[rigid[number]] + 0.5 * push)
    state.work[len(rigid)] += impulse * (rate + 0.5 * mobility * impulse)
    state.impulses[0] += impulse
    kinetic, strain, gap, speed = 0.0, 0.0, 0.0, 0.0
    half = 0.5 * impulse
    for k in range(len(q)):
        place, middle = q[k], v[k] + half * row[k]
        kinetic += middle * middle
        strain += stiffness[k] * place * place
        after = middle + half * row[k]
        moved = qq[k] * place + qv[k] * after
        fast = vq[k] * place + vv[k] * after
        q[k], v[k] = moved, fast
        gap += row[k] * moved
        speed += row[k] * fast
    state.energy[KINETIC], state.energy[STRAIN] = 0.5 * kinetic, 0.5 * strain
    return constants.gap[0] + gap, speed
