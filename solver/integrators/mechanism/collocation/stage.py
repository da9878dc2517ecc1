"""What steps with several stages have in common, in compiled functions: rates of a stage, and the energy balance."""

import numpy as np

from gudgeon.solver.compiled import inner
from gudgeon.solver.integrators.mechanism.arrays import LOST, PLACE, SPEED, SPIN, SUMS, WIDTH, WORK
from gudgeon.solver.integrators.mechanism.constraints.rows import set_blocks, set_poses_at
from gudgeon.solver.integrators.mechanism.motion import clear, set_pushes, set_rates, set_speed_lacks

ROUNDING = 1e-14
"""Error of the balance over the amounts that it is made of, below which it is round-off."""


@inner
def set_stage(model, work, y, given, amounts, out):  # type: ignore[no-untyped-def]
    """Set the rates of a state under given multipliers, and what rates of rows lack, in `right`."""
    sums = out[len(out) - SUMS :]
    clear(sums)
    set_poses_at(model, work, y, given)
    set_pushes(model, work, amounts, sums)
    if len(model.row_terms):
        set_blocks(model, work)
        set_speed_lacks(model, work, y, given)
    set_rates(model, work, y, given, out)


@inner
def balance(model, work, y):  # type: ignore[no-untyped-def]
    """Return kinetic energy, all of it with what was lost and less what was done on the bodies, and the sum of the
    amounts that it is made of, of a state whose points and bushings are set [J]."""
    kinetic, strain, other, size, sums = 0.0, 0.0, 0.0, 0.0, y[len(y) - SUMS :]
    for b in range(len(model.mass)):
        s = WIDTH * b
        for i in range(3):
            v, fall = y[s + SPEED + i], model.mass[b] * model.gravity[i] * y[s + PLACE + i]
            kinetic += 0.5 * (model.mass[b] * v * v + work.omega[b, i] * y[s + SPIN + i])
            other -= fall
            size += abs(fall)
        for k in range(model.elastic[b, 0]):
            q = y[model.elastic[b, 1] + k]
            kinetic += 0.5 * work.modal[b, 3 + k] * y[model.elastic[b, 2] + k]
            strain += 0.5 * model.modal_stiffness[b, k] * q * q
    first = 2 * len(model.owner)
    for k in range(len(model.spring)):
        a, b, square, reach = work.place[first + 2 * k], work.place[first + 2 * k + 1], 0.0, 0.0
        for i in range(3):
            square += (b[i] - a[i]) ** 2
            reach += abs(a[i]) + abs(b[i])
        longer = np.sqrt(square) - model.spring[k, 2]
        strain += 0.5 * model.spring[k, 0] * longer * longer
        size += model.spring[k, 0] * abs(longer) * reach
    for u in range(len(model.bush_rest)):
        x = work.bush[u]
        for k in range(6):
            for l in range(6):
                strain += 0.5 * x[k] * model.bush_stiffness[u, k, l] * x[l]
    for n in range(len(work.field)):
        other -= work.field[n, 0]
        size += abs(work.field[n, 0])
    size += kinetic + strain + abs(sums[LOST]) + abs(sums[WORK])
    return kinetic, kinetic + strain + other + sums[LOST] - sums[WORK], size


@inner
def imbalance(before, after, size):  # type: ignore[no-untyped-def]
    """Return by how much a balance changed beyond round-off of amounts of a size [J]."""
    return max(0.0, abs(after - before) - ROUNDING * size)
