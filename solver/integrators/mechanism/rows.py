"""Terms of joints between two markers, with their rates, and constraint rows, sums of one or two terms.

d = p_b − p_a is the vector between the markers, u_i an axis of a, w_k one of b. A rate is G (v_a, ω_a, v_b, ω_b), and
the second rate G (accelerations) plus what `bend` has.
"""

import numpy as np

from gudgeon.solver.compiled import inner
from gudgeon.solver.integrators.mechanism.arrays import (
    ALONG,
    DISTANCE,
    NONE,
    PLACE,
    SPEED,
    SQUARE,
    TURN,
    WIDTH,
)
from gudgeon.solver.integrators.mechanism.rotation import matrix_of


@inner
def _arm(model, work, y, j, side):  # type: ignore[no-untyped-def]
    """Return arm, place, velocity and second rate without accelerations of a marker, and ω of its body."""
    b, c = model.owner[j, side], model.arm[j, side]
    if b == NONE:
        zero = (0.0, 0.0, 0.0)
        return zero, (c[0], c[1], c[2]), zero, zero, zero
    Q, w, s = work.turn[b], work.omega[b], WIDTH * b
    r = (
        Q[0, 0] * c[0] + Q[0, 1] * c[1] + Q[0, 2] * c[2],
        Q[1, 0] * c[0] + Q[1, 1] * c[1] + Q[1, 2] * c[2],
        Q[2, 0] * c[0] + Q[2, 1] * c[1] + Q[2, 2] * c[2],
    )
    o = (w[0], w[1], w[2])
    u = cross(o, r)
    place = (y[s + PLACE] + r[0], y[s + PLACE + 1] + r[1], y[s + PLACE + 2] + r[2])
    speed = (y[s + SPEED] + u[0], y[s + SPEED + 1] + u[1], y[s + SPEED + 2] + u[2])
    return r, place, speed, cross(o, u), o


@inner
def _axis(model, work, j, side, i):  # type: ignore[no-untyped-def]
    """Return an axis of a marker along the scene's axes."""
    b, F = model.owner[j, side], model.frame[j, side]
    if b == NONE:
        return F[0, i], F[1, i], F[2, i]
    Q = work.turn[b]
    return (
        Q[0, 0] * F[0, i] + Q[0, 1] * F[1, i] + Q[0, 2] * F[2, i],
        Q[1, 0] * F[0, i] + Q[1, 1] * F[1, i] + Q[1, 2] * F[2, i],
        Q[2, 0] * F[0, i] + Q[2, 1] * F[1, i] + Q[2, 2] * F[2, i],
    )


@inner
def cross(a, b):  # type: ignore[no-untyped-def]
    """Return the vector product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


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
def _translation(model, work, y, t):  # type: ignore[no-untyped-def]
    """Set a term that depends on d: along an axis of a, or its length."""
    kind, j = model.terms[t, 0], model.terms[t, 1]
    ra, pa, sa, ca, wa = _arm(model, work, y, j, 0)
    rb, pb, sb, cb, _ = _arm(model, work, y, j, 1)
    d, rate, bend = _less(pb, pa), _less(sb, sa), _less(cb, ca)
    G = work.slope[t]
    if kind == ALONG:
        n = _axis(model, work, j, 0, model.terms[t, 2])
        turn = cross(wa, n)
        work.value[t] = _dot(n, d)
        work.bend[t] = _dot(n, bend) + 2 * _dot(turn, rate) + _dot(cross(wa, turn), d)
        by_turn = _less(cross(n, d), cross(ra, n))
        _put(G[0], -1.0, n, (-by_turn[0], -by_turn[1], -by_turn[2]))
    else:
        size = np.sqrt(_dot(d, d))
        over = 1.0 / size if size > 0.0 else np.nan
        n = (d[0] * over, d[1] * over, d[2] * over)
        along = _dot(n, rate)
        work.value[t] = size
        work.bend[t] = _dot(n, bend) + (_dot(rate, rate) - along * along) * over
        _put(G[0], -1.0, n, cross(ra, n))
    _put(G[1], 1.0, n, cross(rb, n))


@inner
def _rotation(model, work, t):  # type: ignore[no-untyped-def]
    """Set a term of the axes of both markers: the scalar product of two, or the angle about the third axis of a."""
    kind, j = model.terms[t, 0], model.terms[t, 1]
    a, b = model.owner[j, 0], model.owner[j, 1]
    wa, wb = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if a != NONE:
        wa = (work.omega[a, 0], work.omega[a, 1], work.omega[a, 2])
    if b != NONE:
        wb = (work.omega[b, 0], work.omega[b, 1], work.omega[b, 2])
    G, zero = work.slope[t], (0.0, 0.0, 0.0)
    if kind == SQUARE:
        n, w = _axis(model, work, j, 0, model.terms[t, 2]), _axis(model, work, j, 1, model.terms[t, 3])
        nn, ww = cross(wa, n), cross(wb, w)
        work.value[t] = _dot(n, w)
        work.bend[t] = _dot(cross(wa, nn), w) + 2 * _dot(nn, ww) + _dot(n, cross(wb, ww))
        across = cross(n, w)
        _put(G[0], 1.0, zero, across)
        _put(G[1], -1.0, zero, across)
        return
    n, first, second = _axis(model, work, j, 0, 2), _axis(model, work, j, 0, 0), _axis(model, work, j, 0, 1)
    w = _axis(model, work, j, 1, 0)
    angle = np.arctan2(_dot(w, second), _dot(w, first))
    work.value[t] = angle + 2 * np.pi * np.round((work.turned[t] - angle) / (2 * np.pi))
    work.bend[t] = _dot(cross(wa, n), _less(wb, wa))
    _put(G[0], -1.0, zero, n)
    _put(G[1], 1.0, zero, n)


@inner
def set_poses(model, work, y):  # type: ignore[no-untyped-def]
    """Set rotation matrices, angular velocities and inverses of the inertia along the scene's axes."""
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


@inner
def set_rows(model, work, y):  # type: ignore[no-untyped-def]
    """Set the values, slopes and bends of all terms, and the blocks of all rows; poses are set."""
    for t in range(len(model.terms)):
        if model.terms[t, 0] == ALONG or model.terms[t, 0] == DISTANCE:
            _translation(model, work, y, t)
        else:
            _rotation(model, work, t)
    for i in range(len(model.row_terms)):
        for part in range(2):
            t = model.row_terms[i, part]
            for side in range(2):
                block, light = work.block[i, 2 * part + side], work.light[i, 2 * part + side]
                if t == NONE or model.owner[model.terms[t, 1], side] == NONE:
                    work.block_owner[i, 2 * part + side] = NONE
                    continue
                b = model.owner[model.terms[t, 1], side]
                work.block_owner[i, 2 * part + side] = b
                for k in range(6):
                    block[k] = model.factors[i, part] * work.slope[t, side, k]
                for k in range(3):
                    light[k] = block[k] / model.mass[b]
                    light[3 + k] = (
                        work.back[b, k, 0] * block[3] + work.back[b, k, 1] * block[4] + work.back[b, k, 2] * block[5]
                    )


@inner
def set_matrix(model, work):  # type: ignore[no-untyped-def]
    """Set S = G M⁻¹ Gᵀ; rows are set."""
    S, m = work.matrix, len(model.row_terms)
    for i in range(m):
        for j in range(m):
            S[i, j] = 0.0
    for at in range(len(model.pairs)):
        i, j, p, q = model.pairs[at, 0], model.pairs[at, 1], model.pairs[at, 2], model.pairs[at, 3]
        total = 0.0
        for k in range(6):
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
