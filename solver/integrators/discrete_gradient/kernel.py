"""Steps of the discrete gradient, compiled: the force of each contact is constant over a step.

Coordinates move exactly under a constant force λ, which changes their energy by −λ (d₁ − d₀). With λ the difference
quotient (V(d₁) − V(d₀)) / (d₁ − d₀) of the contact's potential, energy is constant to round-off at any step.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.compiled import allocating, copy, inner
from gudgeon.solver.integrators.balance import LOST, update_balance
from gudgeon.solver.integrators.impact_log import GOING, ROW, ImpactLog, changes, log_step, note_change, pressed
from gudgeon.solver.laws.force import law_energy, law_force

CLOSE = 1e-3
"""Relative difference of d₀ and d₁ below which the quotient is a Gauss integral, whose error is below 1e-20."""
GAUSS_POINTS = np.array([0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263])
GAUSS_WEIGHTS = np.array([0.17392742256872693, 0.32607257743127307, 0.32607257743127307, 0.17392742256872693])
SWEEPS, HALVINGS = 500, 200
IN_CONTACT, ITERATIONS = range(2)
"""Entries of `State.counts`."""


class Step(NamedTuple):
    """Constants of a run. Shapes: n coordinates, c contacts."""

    dt: float
    free: np.ndarray
    """y←y, y←ẏ, ẏ←y, ẏ←ẏ, (4, n)."""
    push: np.ndarray
    """y and ẏ per unit constant force, (2, n)."""
    constant: np.ndarray
    """Constant forces, (n,)."""
    rows: np.ndarray
    """∂g/∂y, (c, n)."""
    gap: np.ndarray
    """g at y = 0 [m], (c,)."""
    reach: np.ndarray
    """Change of each gap per force [m/N], (c, c)."""
    law: np.ndarray
    """As in `law_force`, (c, 4)."""
    floor: float
    """Least approach speed, relative to the largest."""
    stiffness: np.ndarray
    """ω² [rad²/s²], (n,)."""
    start: np.ndarray
    """y at the start of the run, (n,)."""
    contact: np.ndarray
    """Contact number of each row, (c,)."""
    directions: np.ndarray
    """Of each row's force on its body, (c, 3)."""


class State(NamedTuple):
    """Variables of a run, updated in place."""

    y: np.ndarray
    v: np.ndarray
    depth: np.ndarray
    """−g at the end of the last step [m], (c,)."""
    force: np.ndarray
    """[N], (c,)."""
    approach: np.ndarray
    """v⁻ of each contact [m/s], 0 where it is open, (c,)."""
    fastest: np.ndarray
    """Largest v⁻ so far [m/s], (1,)."""
    balance: np.ndarray
    """As in `update_balance`, (4,)."""
    counts: np.ndarray
    """Steps in contact, iterations, (2,)."""
    impulses: np.ndarray
    """[N s], (c,)."""
    log: ImpactLog


class Samples(NamedTuple):
    """Histories, one row per sample."""

    forces: np.ndarray
    """Mean force of each row [N], (samples, c)."""
    energies: np.ndarray
    """[J], (samples, 5)"""
    y: np.ndarray
    v: np.ndarray
    """At the ends of the samples, (samples, n)."""


@allocating
def march(step, state, first, stride, out):  # type: ignore[no-untyped-def]
    """Advance `len(out.forces)` samples of `stride` steps from step number `first`; False where no force is found."""
    c, n = step.rows.shape
    forces, loose, depth, next_y, next_v = out.forces, np.empty(c), np.empty(c), np.empty(n), np.empty(n)
    for sample in range(len(forces)):
        forces[sample] = 0.0
        for part in range(stride):
            time = (first + sample * stride + part) * step.dt
            for k in range(n):
                place = step.free[0, k] * state.y[k] + step.free[1, k] * state.v[k]
                next_y[k] = place + step.push[0, k] * step.constant[k]
                speed = step.free[2, k] * state.y[k] + step.free[3, k] * state.v[k]
                next_v[k] = speed + step.push[1, k] * step.constant[k]
            for i in range(c):
                total = step.gap[i]
                for k in range(n):
                    total += step.rows[i, k] * next_y[k]
                loose[i] = total
            if not find_forces(step, state, loose, depth):
                return False
            for i in range(c):
                amount = state.force[i]
                if amount > 0.0:
                    forces[sample, i] += amount / stride
                    for k in range(n):
                        next_y[k] += step.push[0, k] * step.rows[i, k] * amount
                        next_v[k] += step.push[1, k] * step.rows[i, k] * amount
            copy(next_y, state.y)
            copy(next_v, state.v)
            _balance(step, state, depth, time, out.energies[sample])
        copy(state.y, out.y[sample])
        copy(state.v, out.v[sample])
    return True


@inner
def find_forces(step, state, loose, depth):  # type: ignore[no-untyped-def]
    """Compute all forces [N] of a step, contact by contact until none changes; False where one is not found.

    Args:
        loose: Gaps at the end of the step without contact forces [m], (c,).
        depth: Out: indentations at its end [m], (c,).
    """
    c, least = len(loose), 0.0
    for i in range(c):
        if loose[i] < 0.0 or state.depth[i] > 0.0:
            least += _least(step.law[i], state.depth[i], loose[i])
        depth[i] = -loose[i]
        for j in range(c):
            depth[i] -= step.reach[i, j] * state.force[j]
        rate = (-loose[i] - state.depth[i]) / step.dt
        if state.depth[i] <= 0.0 and -loose[i] > 0.0 and state.approach[i] <= 0.0:
            state.fastest[0] = max(state.fastest[0], rate)
            state.approach[i] = max(rate, step.floor * state.fastest[0])
    for _sweep in range(SWEEPS):
        change, largest = 0.0, 0.0
        for i in range(c):
            others = loose[i]
            for j in range(c):
                if j != i:
                    others += step.reach[i, j] * state.force[j]
            force = _one(step, state, i, -others)
            if force < 0.0:
                return False
            change = max(change, abs(force - state.force[i]))
            largest = max(largest, force)
            state.force[i] = force
            depth[i] = -others - step.reach[i, i] * force
        if c == 1 or change <= max(1e-15 * largest, 2.0 * least):
            return True
    return False


@inner
def _least(law, before, loose):  # type: ignore[no-untyped-def]
    """Return the round-off [N] of the elastic force at the depths of a step, below which a force error is accepted."""
    return 1e-15 * law_force(law, max(abs(before), abs(loose)), 0.0, 1.0)[0]


@inner
def _one(step, state, i, loose):  # type: ignore[no-untyped-def]
    """Compute the force [N] of a contact that is `loose` deep [m] without it; −1 where the iteration fails."""
    before, reach, law = state.depth[i], step.reach[i, i], step.law[i]
    if loose <= 0.0 and before <= 0.0:
        return 0.0
    low, high = 0.0, _mean(law, before, loose, state.approach[i], step.dt)
    if high <= 0.0:
        return 0.0
    force = min(state.force[i], high)
    least, wrong = _least(law, before, loose), 0.0
    for _iteration in range(HALVINGS):
        state.counts[ITERATIONS] += 1
        found = _mean(law, before, loose - reach * force, state.approach[i], step.dt)
        wrong = force - found
        if wrong > 0.0:
            high = force
        else:
            low = force
        nudge = 1e-7 * max(abs(force), 1e-7 * high)
        slope = 1.0 - (_mean(law, before, loose - reach * (force + nudge), state.approach[i], step.dt) - found) / nudge
        new = force - wrong / slope
        # Tested before the bracket, since a step of the size of round-off ends on the bracket's border.
        if abs(new - force) <= 4e-16 * max(new, force) or abs(wrong) <= least:
            return force
        if not (low < new < high):
            new = 0.5 * (low + high)
        force = new
        if high - low <= 4e-16 * high:
            return force
    # With little indentation, round-off of the depths limits how far the force converges.
    return force if high - low <= 1e-6 * high or abs(wrong) <= 1e-6 * high else -1.0


@inner
def _mean(law, before, after, approach, dt):  # type: ignore[no-untyped-def]
    """Return the mean force [N] between two depths [m], with the losses of the law."""
    elastic = quotient(law, before, after)
    rate = (after - before) / dt
    per_rate = law[2] / approach if approach > 0.0 else 0.0
    damped = law[3] * rate if before > 0.0 or after > 0.0 else 0.0
    return max(0.0, elastic * (1.0 + per_rate * rate) + damped)


@inner
def quotient(law, before, after):  # type: ignore[no-untyped-def]
    """Return the mean elastic force [N] between two depths [m], the difference quotient of the potential."""
    width = after - before
    if before <= 0.0 and after <= 0.0:
        return 0.0
    if before > 0.0 and after > 0.0 and abs(width) < CLOSE * max(before, after):
        total = 0.0
        for point in range(4):
            force, _, _ = law_force(law, before + GAUSS_POINTS[point] * width, 0.0, 1.0)
            total += GAUSS_WEIGHTS[point] * force
        return total
    return (law_energy(law, after) - law_energy(law, before)) / width


@inner
def _balance(step, state, depth, time, energies):  # type: ignore[no-untyped-def]
    """Set the energies [J] at the end of the step, and update the largest error of their balance."""
    stored, touching = 0.0, False
    for i in range(len(depth)):
        force = state.force[i]
        state.impulses[i] += force * step.dt
        elastic = quotient(step.law[i], state.depth[i], depth[i])
        lost = (force - elastic) * (depth[i] - state.depth[i])
        if lost > 0.0:  # No law creates energy: that of a wrong force shall appear as drift.
            state.balance[LOST] += lost
        stored += law_energy(step.law[i], depth[i])
        touching = touching or force > 0.0
    if touching or state.log.counts[GOING] > 0:
        _locate(step, state, depth, time)
    for i in range(len(depth)):
        state.depth[i] = depth[i]
        if depth[i] <= 0.0:
            state.approach[i] = 0.0
    if touching:
        state.counts[IN_CONTACT] += 1
    energies[0], energies[1], energies[4] = update_balance(step, state.y, state.v, stored, state.balance)
    energies[2], energies[3] = stored, state.balance[LOST]


@inner
def _locate(step, state, depth, time):  # type: ignore[no-untyped-def]
    """Set the resultants [N] and log the impacts, which begin and end where a depth, linear in the step, is zero."""
    log, end = state.log, time + step.dt
    for i in range(len(depth)):
        k = step.contact[i]
        for axis in range(3):
            log.force[k, axis] += state.force[i] * step.directions[i, axis]
        if state.force[i] > state.force[log.steps[k, ROW]]:
            log.steps[k, ROW] = i
    for k in range(len(log.force)):
        i, acts = log.steps[k, ROW], pressed(log, k)
        rate = (state.depth[i] - depth[i]) / step.dt
        if changes(log, k, acts):
            note_change(log, k, acts, end if acts else time, -depth[i] if acts else -state.depth[i], rate)
        if acts and depth[i] <= 0.0:
            stays = False
            for j in range(len(depth)):
                stays |= step.contact[j] == k and depth[j] > 0.0
            note_change(log, k, stays, end, -depth[i], rate)
    log_step(log, int(np.rint(time / step.dt)))
