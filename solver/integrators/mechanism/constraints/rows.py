"""Terms of joints between two markers, with their rates, and constraint rows, sums of one or two terms.

d = p_b − p_a is the vector between the markers, u_i an axis of a, w_k one of b. A rate is G (v_a, ω_a, v_b, ω_b), and
the second rate G (accelerations) plus what `bend` has.
"""

import numpy as np

from gudgeon.solver.compiled import copy, inner
from gudgeon.solver.integrators.mechanism.arrays import (
    ALONG,
    DISTANCE,
    NONE,
    SQUARE,
    TURN,
    WIDTH,
)
from gudgeon.solver.integrators.mechanism.flexible.inertia import set_flexible, solve_inertia
from gudgeon.solver.integrators.mechanism.flexible.points import cross, set_points, spread
from gudgeon.solver.integrators.mechanism.rotation import matrix_of


@inner
def _dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inner
def _less(a, b):  # type: ignore[no-untyped-def]
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inner
def _put(target, sign, first, second):  # type: ignore[no-untyped-def]
    for i in range(3):
        target[i] = sign * first[i]
        target[3 + i] = sign * second[i]


@inner
def _axis(work, p, i):  # type: ignore[no-untyped-def]
    return work.axes[p, 0, i], work.axes[p, 1, i], work.axes[p, 2, i]


@inner
def _translation(model, work, t):  # type: ignore[no-untyped-def]
    """Set a term that depends on d: along an axis of a, or its length."""
    kind, a, b = model.terms[t, 0], 2 * model.terms[t, 1], 2 * model.terms[t, 1] + 1
    d, rate = _less(work.place[b], work.place[a]), _less(work.speed[b], work.speed[a])
    bend, zero = _less(work.drift[b], work.drift[a]), (0.0, 0.0, 0.0)
    G = work.slope[t]
    if kind == ALONG:
        n, wa = _axis(work, a, model.terms[t, 2]), work.spin[a]
        turn, moment = cross(wa, n), cross(n, d)
        work.value[t] = _dot(n, d)
        work.bend[t] = (
            _dot(n, bend) + 2 * _dot(turn, rate) + _dot(cross(wa, turn), d) + _dot(work.spin_drift[a], moment)
        )
        _put(G[0], -1.0, n, (-moment[0], -moment[1], -moment[2]))
    else:
        size = np.sqrt(_dot(d, d))
        over = 1.0 / size if size > 0.0 else np.nan
        n = (d[0] * over, d[1] * over, d[2] * over)
        along = _dot(n, rate)
        work.value[t] = size
        work.bend[t] = _dot(n, bend) + (_dot(rate, rate) - along * along) * over
        _put(G[0], -1.0, n, zero)
    _put(G[1], 1.0, n, zero)


@inner
def _rotation(model, work, t):  # type: ignore[no-untyped-def]
    """Set a term of the axes of both markers: the scalar product of two, or the angle about the third axis of a."""
    kind, a, b = model.terms[t, 0], 2 * model.terms[t, 1], 2 * model.terms[t, 1] + 1
    wa, wb = work.spin[a], work.spin[b]
    apart = _less(work.spin_drift[b], work.spin_drift[a])
    G, zero = work.slope[t], (0.0, 0.0, 0.0)
    if kind == SQUARE:
        n, w = _axis(work, a, model.terms[t, 2]), _axis(work, b, model.terms[t, 3])
        nn, ww = cross(wa, n), cross(wb, w)
        across = cross(n, w)
        work.value[t] = _dot(n, w)
        work.bend[t] = _dot(cross(wa, nn), w) + 2 * _dot(nn, ww) + _dot(n, cross(wb, ww)) - _dot(apart, across)
        _put(G[0], 1.0, zero, across)
        _put(G[1], -1.0, zero, across)
        return
    n, first, second = _axis(work, a, 2), _axis(work, a, 0), _axis(work, a, 1)
    w = _axis(work, b, 0)
    angle = np.arctan2(_dot(w, second), _dot(w, first))
    work.value[t] = angle + 2 * np.pi * np.round((work.turned[t] - angle) / (2 * np.pi))
    work.bend[t] = _dot(cross(wa, n), _less(wb, wa)) + _dot(n, apart)
    _put(G[0], -1.0, zero, n)
    _put(G[1], 1.0, zero, n)


@inner
def set_poses_at(model, work, y, given):  # type: ignore[no-untyped-def]
    """Set all of `set_poses`, and driven points, with drives (d, 3) of a time."""
    for i in range(len(given)):
        copy(given[i], work.given[i])
    set_poses(model, work, y)


@inner
def set_poses(model, work, y):  # type: ignore[no-untyped-def]
    """Set rotation matrices, angular velocities, inverses of the inertia along the scene's axes, and all points; driven
    ones stand where they stood last."""
    for b in range(len(model.mass)):
        s = WIDTH * b
        matrix_of(y[s + TURN : s + TURN + 4], work.turn[b])
        Q, I = work.turn[b], model.inverse[b]
        for i in range(3):
            for j in range(i + 1):
                total = 0.0
                for k in range(3):
                    for l in range(3):
                        total += Q[i, k] * I[k, l] * Q[j, l]
                work.back[b, i, j] = total
                work.back[b, j, i] = total
        for i in range(3):
            w = 0.0
            for j in range(3):
                w += work.back[b, i, j] * y[s + 10 + j]
            work.omega[b, i] = w
        if model.elastic[b, 0]:
            set_flexible(model, work, y, b)
    set_points(model, work, y)


@inner
def set_blocks(model, work):  # type: ignore[no-untyped-def]
    """Set the values, slopes and bends of all terms, and the blocks of all rows; poses are set."""
    for t in range(len(model.terms)):
        if model.terms[t, 0] == ALONG or model.terms[t, 0] == DISTANCE:
            _translation(model, work, t)
        else:
            _rotation(model, work, t)
    for i in range(len(model.row_terms)):
        for part in range(2):
            t = model.row_terms[i, part]
            for side in range(2):
                block = work.block[i, 2 * part + side]
                if t == NONE or model.owner[model.terms[t, 1], side] == NONE:
                    work.block_owner[i, 2 * part + side] = NONE
                    continue
                b = model.owner[model.terms[t, 1], side]
                work.block_owner[i, 2 * part + side] = b
                for k in range(6 + model.elastic[b, 0]):
                    block[k] = 0.0
                slope, p = work.slope[t, side], 2 * model.terms[t, 1] + side
                spread(model, work, p, slope, model.factors[i, part], block)


@inner
def set_rows(model, work):  # type: ignore[no-untyped-def]
    """Set all of `set_blocks`, and the blocks times the inverse of the inertia; poses are set."""
    set_blocks(model, work)
    for i in range(len(model.row_terms)):
        for p in range(4):
            b, block, light = work.block_owner[i, p], work.block[i, p], work.light[i, p]
            if b == NONE:
                continue
            copy(block, light)
            for k in range(3):
                light[k] = block[k] / model.mass[b]
            if model.elastic[b, 0]:
                solve_inertia(model, work, b, light[3:])
                continue
            for k in range(3):
                light[3 + k] = (
                    work.back[b, k, 0] * block[3] + work.back[b, k, 1] * block[4] + work.back[b, k, 2] * block[5]
                )


@inner
def set_matrix(model, work):  # type: ignore[no-untyped-def]
    """Set S = G M⁻¹ Gᵀ; rows are set."""
    S = work.matrix
    for at in range(len(model.pairs)):  # All others are zero always.
        i, j = model.pairs[at, 0], model.pairs[at, 1]
        S[i, j], S[j, i] = 0.0, 0.0
    for at in range(len(model.pairs)):
        i, j, p, q = model.pairs[at, 0], model.pairs[at, 1], model.pairs[at, 2], model.pairs[at, 3]
        total = 0.0
        for k in range(6 + model.elastic[work.block_owner[i, p], 0]):
            total += work.block[i, p, k] * work.light[j, q, k]
        S[i, j] += total
        if i != j:
            S[j, i] += total


@inner
def violation(model, work, given, i):  # type: ignore[no-untyped-def]
    """Return what a row lacks: its value less its constant and the first of its drive in `given`, (d, 3)."""
    found = -model.constant[i]
    for part in range(2):
        if model.row_terms[i, part] != NONE:
            found += model.factors[i, part] * work.value[model.row_terms[i, part]]
    if model.drive_of[i] != NONE:
        found -= given[model.drive_of[i], 0]
    return found


@inner
def rate_asked(model, work, given, i):  # type: ignore[no-untyped-def]
    """Return the rate that bodies have to give a row: that of its drive, less what driven points give."""
    found = 0.0
    if model.drive_of[i] != NONE:
        found = given[model.drive_of[i], 1]
    for part in range(2):
        t = model.row_terms[i, part]
        if t == NONE:
            continue
        for side in range(2):
            p = 2 * model.terms[t, 1] + side
            if model.point_drive[p] != NONE:
                found -= model.factors[i, part] * _dot(work.slope[t, side], work.speed[p])
    return found
