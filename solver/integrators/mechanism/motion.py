"""Accelerations of a mechanism, and projections on its constraints, in compiled functions."""

import numpy as np

from gudgeon.solver.compiled import inner, larger
from gudgeon.solver.integrators.mechanism.arrays import (
    IMPULSE,
    LOST,
    MOMENT,
    NONE,
    PLACE,
    SPEED,
    SPIN,
    SUMS,
    TURN,
    WIDTH,
    WORK,
)
from gudgeon.solver.integrators.mechanism.constraints.rows import (
    rate_asked,
    set_matrix,
    set_poses_at,
    set_rows,
    violation,
)
from gudgeon.solver.integrators.mechanism.constraints.solve import factor, solve
from gudgeon.solver.integrators.mechanism.flexible.inertia import set_flexible_rates
from gudgeon.solver.integrators.mechanism.flexible.points import cross, press
from gudgeon.solver.integrators.mechanism.forces.bushings import press_bushings
from gudgeon.solver.integrators.mechanism.rotation import rate_of, turn_by
from gudgeon.solver.integrators.mechanism.touching.kernel import press_touches, set_deflections, set_touch_sums
from gudgeon.solver.integrators.mechanism.touching.pressing import press_surfaces, set_pressing

CLOSED = 1e-9
"""Motion of a step of Newton's method over the size of the scene, or rotation [rad], after which it ends: it converges
with the square."""
FARTHEST = 1.0
"""The same motion beyond which it ends, too: it diverges."""
NEWTON = 12
"""Steps of Newton's method at most."""


@inner
def set_pushes(model, work, amounts, sums):  # type: ignore[no-untyped-def]
    """Set what acts on each body but by joints, and rates of work and loss."""
    for b in range(len(model.mass)):
        for i in range(3):
            work.push[b, i] = model.mass[b] * model.gravity[i]
            work.push[b, 3 + i] = 0.0
        for k in range(model.elastic[b, 0]):
            work.push[b, 6 + k] = work.inner_force[b, k]
            sums[LOST] += model.modal_damping[b, k] * work.modal[b, 3 + k] * work.modal[b, 3 + k]
    first = 2 * len(model.owner)
    for k in range(len(model.spring)):
        pa, pb = first + 2 * k, first + 2 * k + 1
        d0 = work.place[pb, 0] - work.place[pa, 0]
        d1 = work.place[pb, 1] - work.place[pa, 1]
        d2 = work.place[pb, 2] - work.place[pa, 2]
        size = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
        if size == 0.0:
            continue
        d0, d1, d2 = d0 / size, d1 / size, d2 / size
        sa, sb = work.speed[pa], work.speed[pb]
        rate = d0 * (sb[0] - sa[0]) + d1 * (sb[1] - sa[1]) + d2 * (sb[2] - sa[2])
        pull = model.spring[k, 0] * (size - model.spring[k, 2]) + model.spring[k, 1] * rate
        sums[LOST] += model.spring[k, 1] * rate * rate
        press(model, work, pa, (d0, d1, d2, 0.0, 0.0, 0.0), pull)
        press(model, work, pb, (d0, d1, d2, 0.0, 0.0, 0.0), -pull)
    first += 2 * len(model.spring)
    for k in range(len(model.load)):
        u, v, w = model.load[k], work.speed[first + k], work.spin[first + k]
        press(model, work, first + k, u, amounts[k])
        for i in range(3):
            sums[WORK] += amounts[k] * (u[i] * v[i] + u[3 + i] * w[i])
    press_bushings(model, work, sums)
    press_touches(model, work, sums)
    press_surfaces(model, work, sums)


@inner
def _row_rate(model, work, i):  # type: ignore[no-untyped-def]
    """Return what a row makes of the rates of the bodies, in `rate`."""
    total = 0.0
    for p in range(4):
        b = work.block_owner[i, p]
        if b != NONE:
            for k in range(6 + model.elastic[b, 0]):
                total += work.block[i, p, k] * work.rate[b, k]
    return total


@inner
def _set_right(model, work, given):  # type: ignore[no-untyped-def]
    """Set the right side of S λ: what the rows' second rates lack without multipliers."""
    for i in range(len(model.row_terms)):
        total = 0.0
        if model.drive_of[i] != NONE:
            total = given[model.drive_of[i], 2]
        for part in range(2):
            if model.row_terms[i, part] != NONE:
                total -= model.factors[i, part] * work.bend[model.row_terms[i, part]]
        work.right[i] = total - _row_rate(model, work, i)


@inner
def set_free_rates(model, work, y):  # type: ignore[no-untyped-def]
    """Set the accelerations of unconstrained bodies, ω̇ = I⁻¹ (moment − ω × ℓ)."""
    for b in range(len(model.mass)):
        w, s = work.omega[b], WIDTH * b + SPIN
        lag = cross(w, y[s : s + 3])
        for i in range(3):
            work.rate[b, i] = work.push[b, i] / model.mass[b]
        if model.elastic[b, 0]:
            set_flexible_rates(model, work, y, b)
            continue
        for i in range(3):
            total = 0.0
            for j in range(3):
                total += work.back[b, i, j] * (work.push[b, 3 + j] - lag[j])
            work.rate[b, 3 + i] = total


@inner
def prepare(model, work, y, given, amounts, sums):  # type: ignore[no-untyped-def]
    """Set all that the multipliers at a state follow from, and factor S."""
    set_poses_at(model, work, y, given)
    set_deflections(work, y)
    set_pressing(model, work, y)
    set_pushes(model, work, amounts, sums)
    set_free_rates(model, work, y)
    if len(model.row_terms):
        set_rows(model, work)
        set_matrix(model, work)
        factor(model, work)
        _set_right(model, work, given)


@inner
def _add_multipliers(model, work):  # type: ignore[no-untyped-def]
    """Add Gᵀ λ to what acts on the bodies."""
    for i in range(len(work.multiplier)):
        amount = work.multiplier[i]
        if amount != 0.0:
            for p in range(4):
                b = work.block_owner[i, p]
                if b != NONE:
                    for k in range(6 + model.elastic[b, 0]):
                        work.push[b, k] += amount * work.block[i, p, k]


@inner
def rates(model, work, y, given, amounts, out):  # type: ignore[no-untyped-def]
    """Set the rates of a state at a time with drives (d, 3) and loads (l,) of that time."""
    sums = out[len(out) - SUMS :]
    clear(sums)
    prepare(model, work, y, given, amounts, sums)
    set_touch_sums(model, work, out)
    if len(model.row_terms):
        solve(work)
    set_rates(model, work, y, given, out)


@inner
def clear(values):  # type: ignore[no-untyped-def]
    """Set numbers to zero."""
    for i in range(len(values)):
        values[i] = 0.0


@inner
def set_rates(model, work, y, given, out):  # type: ignore[no-untyped-def]
    """Set the rates of a state whose pushes and multipliers are set, and add to those of the sums."""
    sums = out[len(out) - SUMS :]
    if len(model.row_terms):
        _add_multipliers(model, work)
        for i in range(len(model.row_terms)):
            sums[WORK] += work.multiplier[i] * rate_asked(model, work, given, i)
    for b in range(len(model.mass)):
        s = WIDTH * b
        for i in range(3):
            out[s + PLACE + i] = y[s + SPEED + i]
            out[s + SPEED + i] = work.push[b, i] / model.mass[b]
            out[s + SPIN + i] = work.push[b, 3 + i]
            sums[IMPULSE + i] += work.push[b, i]
        about = cross(y[s + PLACE : s + PLACE + 3], work.push[b])
        for i in range(3):
            sums[MOMENT + i] += about[i] + work.push[b, 3 + i]
        for k in range(model.elastic[b, 0]):
            out[model.elastic[b, 1] + k] = work.modal[b, 3 + k]
            out[model.elastic[b, 2] + k] = work.push[b, 6 + k]
        rate_of(y[s + TURN : s + TURN + 4], work.omega[b], out[s + TURN : s + TURN + 4])


@inner
def worst_violation(model, work, given):  # type: ignore[no-untyped-def]
    """Return the largest violation of a row over its reach, and leave all in `right`, negative."""
    worst = 0.0
    for i in range(len(model.row_terms)):
        found = violation(model, work, given, i)
        work.right[i] = -found
        worst = larger(worst, abs(found) / model.reach[i])
    return worst


@inner
def _gather(model, work, rows):  # type: ignore[no-untyped-def]
    """Set `rate` to the sum of rows of the bodies, of the shape of `block`, times their multipliers."""
    for b in range(len(model.mass)):
        for k in range(6 + model.elastic[b, 0]):
            work.rate[b, k] = 0.0
    for i in range(len(model.row_terms)):
        for p in range(4):
            b = work.block_owner[i, p]
            if b != NONE:
                for k in range(6 + model.elastic[b, 0]):
                    work.rate[b, k] += work.multiplier[i] * rows[i, p, k]


@inner
def _move(model, work, y):  # type: ignore[no-untyped-def]
    """Move the bodies by M⁻¹ Gᵀ λ; return the largest motion over the size of the scene, or rotation [rad]."""
    _gather(model, work, work.light)
    largest = 0.0
    for b in range(len(model.mass)):
        s, move = WIDTH * b, work.rate[b]
        for k in range(3):
            y[s + PLACE + k] += move[k]
            largest = larger(largest, abs(move[k]) / model.size)
            largest = larger(largest, abs(move[3 + k]))
        for k in range(model.elastic[b, 0]):
            y[model.elastic[b, 1] + k] += move[6 + k]
        turn_by(y[s + TURN : s + TURN + 4], move[3], move[4], move[5])
    return largest


@inner
def project_places(model, work, y, given):  # type: ignore[no-untyped-def]
    """Move the bodies onto their constraints by Newton's method, by least kinetic energy.

    It ends with the first motion whose square is round-off; near positions in which rows depend on each other, what
    remains of the violation says less than the motion. Returns this motion, over the size of the scene.
    """
    moved = np.inf
    for step in range(NEWTON):
        set_poses_at(model, work, y, given)
        set_rows(model, work)
        worst_violation(model, work, given)
        set_matrix(model, work)
        factor(model, work)
        solve(work)
        before, moved = moved, _move(model, work, y)
        if moved <= CLOSED or not moved < FARTHEST or (step > 3 and moved > 0.5 * before):
            break
    return moved


@inner
def set_speed_lacks(model, work, y, given):  # type: ignore[no-untyped-def]
    """Set what the rate of each row lacks, in `right`; rows are set."""
    for b in range(len(model.mass)):
        s = WIDTH * b + SPEED
        for k in range(3):
            work.rate[b, k] = y[s + k]
            work.rate[b, 3 + k] = work.omega[b, k]
        for k in range(model.elastic[b, 0]):
            work.rate[b, 6 + k] = work.modal[b, 3 + k]
    for i in range(len(model.row_terms)):
        work.right[i] = rate_asked(model, work, given, i) - _row_rate(model, work, i)


@inner
def _add_rates(model, work, y):  # type: ignore[no-untyped-def]
    """Add `rate` to the velocities, spins and modal momenta of a state."""
    for b in range(len(model.mass)):
        s = WIDTH * b
        for k in range(3):
            y[s + SPEED + k] += work.rate[b, k]
            y[s + SPIN + k] += work.rate[b, 3 + k]
        for k in range(model.elastic[b, 0]):
            y[model.elastic[b, 2] + k] += work.rate[b, 6 + k]


@inner
def project_speeds(model, work, y, given):  # type: ignore[no-untyped-def]
    """Change velocities so that no row's rate is violated, by least kinetic energy."""
    set_poses_at(model, work, y, given)
    set_rows(model, work)
    set_matrix(model, work)
    factor(model, work)
    set_speed_lacks(model, work, y, given)
    solve(work)
    _gather(model, work, work.block)
    for b in range(len(model.mass)):
        for k in range(3):
            work.rate[b, k] /= model.mass[b]
    _add_rates(model, work, y)


@inner
def remove_speed_lacks(model, work, apart):  # type: ignore[no-untyped-def]
    """Take from a difference of velocities, angular velocities and modal rates what violates the rows' rates, by least
    kinetic energy; S is factored."""
    for b in range(len(model.mass)):
        s = WIDTH * b
        for k in range(3):
            work.rate[b, k] = apart[s + SPEED + k]
            work.rate[b, 3 + k] = apart[s + SPIN + k]
        for k in range(model.elastic[b, 0]):
            work.rate[b, 6 + k] = apart[model.elastic[b, 2] + k]
    for i in range(len(model.row_terms)):
        work.right[i] = -_row_rate(model, work, i)
    solve(work)
    _gather(model, work, work.light)
    _add_rates(model, work, apart)
