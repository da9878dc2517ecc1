"""The time loop of `kick.kernel` for one contact point: a single pass over the coordinates in each step.

The kick of a step and the flight to the next are one loop, which also leaves behind what the next kick needs: the gap
and its rate. Same results as the general loop, to round-off, several times as fast.
"""

import numpy as np
from numba import njit

from gudgeon.solver.compiled import FAST
from gudgeon.solver.integrators.kick.kernel import CONTACT, DISSIPATED, KINETIC, STRAIN


@njit(cache=True, fastmath=FAST)
def march_one(law, state, rigid, first, forces, energies, stride):  # type: ignore[no-untyped-def]
    """Advance `len(forces)` samples of `stride` steps each; arguments as `kernel.march`, one row."""
    dt, energy, extreme, tally = law.dt, state.energy, state.extreme, state.tally
    row, q, v = law.rows[0], state.q, state.v
    spring, dashpot = 1.0 / law.compliance[0, 0], law.dashpot[0]
    mobility = _dot(row, row)
    gap, rate = law.gap[0] + _dot(row, q), _dot(row, v)
    number, clear = first, 0
    for sample in range(len(forces)):
        pressed = 0.0
        for step in range(stride):
            force = 0.0
            if clear > 0:
                clear -= 1
            elif gap < 0.0:
                elastic = -gap * spring
                force = elastic
                if dashpot > 0.0:
                    force = max(0.0, (elastic - dashpot * rate) / (1.0 + 0.5 * dt * dashpot * mobility))
                    energy[DISSIPATED] -= dt * (force - elastic) * (rate + 0.5 * dt * mobility * force)
                tally[0] = 1
                energy[CONTACT] = 0.5 * elastic * -gap
                extreme[3] = max(extreme[3], -gap)
                pressed += force
                gap, rate = _kick_and_fly(law, state, rigid, dt * force, rate, mobility)
                _book(state, (number + 0.5) * dt)
            else:
                tally[0] = 0
                energy[CONTACT] = 0.0
                clear = _clear_steps(law, q, v, gap)
            state.multipliers[0] = force
            if step == stride - 1 and tally[0] == 0:
                _measure(law, state)
            if step == stride - 1:
                energies[sample] = energy
            if tally[0] == 0:
                gap, rate = _fly(law.flight, q, v, row, clear == 0)
                gap += law.gap[0]
            number += 1
        for axis in range(3):
            forces[sample, 0, axis] = pressed / stride * law.normals[0, axis]
    return True


@njit(cache=True, fastmath=FAST)
def _dot(one, other):  # type: ignore[no-untyped-def]
    total = 0.0
    for k in range(len(one)):
        total += one[k] * other[k]
    return total


@njit(cache=True, fastmath=FAST)
def _kick_and_fly(law, state, rigid, impulse, rate, mobility):  # type: ignore[no-untyped-def]
    """Kick, measure energy in the middle of the kick, fly; returns gap and rate at the next kick."""
    row, stiffness, q, v = law.rows[0], law.stiffness, state.q, state.v
    qq, qv, vq, vv = law.flight[0], law.flight[1], law.flight[2], law.flight[3]
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
    return law.gap[0] + gap, speed


@njit(cache=True, fastmath=FAST)
def _fly(flight, q, v, row, near):  # type: ignore[no-untyped-def]
    """Fly without a kick; returns what the coordinates add to the gap, and its rate, where it is near."""
    qq, qv, vq, vv = flight[0], flight[1], flight[2], flight[3]
    gap, speed = 0.0, 0.0
    if near:
        for k in range(len(q)):
            place, fast = q[k], v[k]
            moved = qq[k] * place + qv[k] * fast
            after = vq[k] * place + vv[k] * fast
            q[k], v[k] = moved, after
            gap += row[k] * moved
            speed += row[k] * after
        return gap, speed
    for k in range(len(q)):
        place, fast = q[k], v[k]
        q[k] = qq[k] * place + qv[k] * fast
        v[k] = vq[k] * place + vv[k] * fast
    return gap, speed


@njit(cache=True, fastmath=FAST)
def _book(state, time):  # type: ignore[no-untyped-def]
    """Keep the balances of a kick."""
    work, energy, extreme = state.work, state.energy, state.extreme
    count = len(work) - 1
    swing, all_rigid = 0.0, 0.0
    for number in range(count):
        swing += abs(work[number])
        all_rigid += work[number]
    extreme[2] = max(extreme[2], 0.5 * (swing + abs(work[count] - all_rigid) + energy[CONTACT]))
    total = energy[KINETIC] + energy[STRAIN] + energy[CONTACT] + energy[DISSIPATED]
    extreme[1] = max(extreme[1], abs(total - extreme[0]))
    state.tally[1] += 1
    if extreme[4] < 0.0:
        extreme[4] = time
    extreme[5] = time


@njit(cache=True, fastmath=FAST)
def _measure(law, state):  # type: ignore[no-untyped-def]
    """Energies in flight."""
    kinetic, strain = 0.0, 0.0
    for k in range(len(state.q)):
        kinetic += state.v[k] ** 2
        strain += law.stiffness[k] * state.q[k] ** 2
    state.energy[KINETIC], state.energy[STRAIN] = 0.5 * kinetic, 0.5 * strain
    total = state.energy[KINETIC] + state.energy[STRAIN] + state.energy[DISSIPATED]
    state.extreme[1] = max(state.extreme[1], abs(total - state.extreme[0]))


@njit(cache=True, fastmath=FAST)
def _clear_steps(law, q, v, gap):  # type: ignore[no-untyped-def]
    """Steps for which the gap cannot close: in flight a coordinate's speed stays below (q̇² + ω²q²)^½."""
    speed = 0.0
    for k in range(len(q)):
        speed += law.reach[k] * np.sqrt(v[k] * v[k] + law.stiffness[k] * q[k] * q[k])
    if speed * law.dt * 1e9 <= gap:
        return 1_000_000_000
    return int(gap / (speed * law.dt))
