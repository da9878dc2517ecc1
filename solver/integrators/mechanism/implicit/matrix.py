"""The linear systems of Newton's method in an implicit step, in compiled functions.

The stiff part of the equations is linear: modal stiffness K and damping D, diagonal, and the rows G of the joints. For
each eigenvalue λ of A⁻¹ with g = h/λ changes of velocities w and of multipliers μ/g follow from

  (M + g D + g² K) w − Gᵀ μ = g r_p − g² K r_u,  G w = r_c,

r_u, r_p and r_c the residuals of places, momenta and rows; places change by g (r_u + w). Pose, M and G are those at the
start of the step. A body takes a diagonal and a 3 × 3 matrix for its rotation, the joints a factor of
G (M + g D + g² K)⁻¹ Gᵀ in the order, within the envelope, and by the rank that S has.
"""

import numpy as np

from gudgeon.solver.compiled import inner
from gudgeon.solver.integrators.mechanism.arrays import CURL, NONE, PLACE, SPEED, SPIN, TURN, WIDTH


@inner
def keep_start(model, work, newton):  # type: ignore[no-untyped-def]
    """Keep pose, inertia, rows and their order at the start of a step; its rates are set."""
    for b in range(len(model.mass)):
        J, I = work.second[b], newton.inertia[b]
        for i in range(3):
            for j in range(3):
                newton.turn[b, i, j] = work.turn[b, i, j]
        if model.elastic[b, 0]:
            I[0, 0], I[1, 1], I[2, 2] = J[1] + J[2], J[2] + J[0], J[0] + J[1]
            I[1, 2], I[2, 1] = -0.5 * J[3], -0.5 * J[3]
            I[0, 2], I[2, 0] = -0.5 * J[4], -0.5 * J[4]
            I[0, 1], I[1, 0] = -0.5 * J[5], -0.5 * J[5]
        else:
            for i in range(3):
                for j in range(3):
                    I[i, j] = model.inertia[b, i, j]
        for c in range(3):
            for k in range(model.elastic[b, 0]):
                newton.coupling[b, c, k] = work.moment[b, CURL + c, k]
    newton.rank[0] = work.rank[0] if len(model.row_terms) else 0
    newton.parts[0] = 0
    for i in range(len(model.row_terms)):
        newton.place[i] = NONE
    for i in range(newton.rank[0]):
        newton.rows[i], newton.first[i], newton.end[i] = work.order[i], work.begin[i], work.end[i]
        newton.place[work.order[i]] = i
    for i in range(len(model.row_terms)):
        for p in range(4):
            b = work.block_owner[i, p]
            newton.owner[i, p] = b
            if b != NONE:
                for k in range(6 + model.elastic[b, 0]):
                    newton.block[i, p, k] = work.block[i, p, k]
    for i in range(newton.rank[0]):
        for p in range(4):
            b = newton.owner[newton.rows[i], p]
            if b != NONE:
                part = newton.part[newton.parts[0]]
                part[0], part[1], part[2] = newton.rows[i], p, b
                newton.parts[0] += 1


@inner
def _set_core(model, newton, b, k, g):  # type: ignore[no-untyped-def]
    """Set the inverse of I − H (1 + g D + g² K)⁻¹ Hᵀ of a body, and the diagonal of the latter."""
    a, H, C = newton.back[k, b], newton.coupling[b], newton.core[k, b]
    for l in range(model.elastic[b, 0]):
        root = model.modal_root[b, l, l]
        a[l] = 1.0 / (root * root + g * (model.modal_damping[b, l] + g * model.modal_stiffness[b, l]))
    for i in range(3):
        for j in range(i + 1):
            total = newton.inertia[b, i, j] + 0.0 * g
            for l in range(model.elastic[b, 0]):
                total -= H[i, l] * a[l] * H[j, l]
            C[i, j] = total
            C[j, i] = total
    u, v, w, x, y, z = C[0, 0], C[1, 1], C[2, 2], C[1, 2], C[0, 2], C[0, 1]
    # Its cofactors.
    uu, vv, ww = v * w - x * x, u * w - y * y, u * v - z * z
    xx, yy, zz = y * z - u * x, x * z - v * y, x * y - w * z
    over = 1.0 / (u * uu + z * zz + y * yy)
    C[0, 0], C[1, 1], C[2, 2] = uu * over, vv * over, ww * over
    C[1, 2], C[2, 1] = xx * over, xx * over
    C[0, 2], C[2, 0] = yy * over, yy * over
    C[0, 1], C[1, 0] = zz * over, zz * over


@inner
def _solve_body(model, newton, b, k, push, out):  # type: ignore[no-untyped-def]
    """Set velocities (6 + m,) of force, moment and modal forces on a body, by M + g D + g² K."""
    Q, H, a, C = newton.turn[b], newton.coupling[b], newton.back[k, b], newton.core[k, b]
    m = model.elastic[b, 0]
    for i in range(3):
        out[i] = push[i] / model.mass[b]
    u = Q[0, 0] * push[3] + Q[1, 0] * push[4] + Q[2, 0] * push[5]
    v = Q[0, 1] * push[3] + Q[1, 1] * push[4] + Q[2, 1] * push[5]
    w = Q[0, 2] * push[3] + Q[1, 2] * push[4] + Q[2, 2] * push[5]
    for l in range(m):
        lag = a[l] * push[6 + l]
        out[6 + l] = lag
        u -= H[0, l] * lag
        v -= H[1, l] * lag
        w -= H[2, l] * lag
    x = C[0, 0] * u + C[0, 1] * v + C[0, 2] * w
    y = C[1, 0] * u + C[1, 1] * v + C[1, 2] * w
    z = C[2, 0] * u + C[2, 1] * v + C[2, 2] * w
    for l in range(m):
        out[6 + l] -= a[l] * (H[0, l] * x + H[1, l] * y + H[2, l] * z)
    for i in range(3):
        out[3 + i] = Q[i, 0] * x + Q[i, 1] * y + Q[i, 2] * z


@inner
def set_systems(model, newton, times):  # type: ignore[no-untyped-def]
    """Factor the systems of all eigenvalues, which are given over the step; the start is kept."""
    for k in range(len(times)):
        g = 1.0 / times[k]
        for b in range(len(model.mass)):
            _set_core(model, newton, b, k, g)
        if newton.rank[0]:
            for at in range(newton.parts[0]):
                row, p, b = newton.part[at, 0], newton.part[at, 1], newton.part[at, 2]
                _solve_body(model, newton, b, k, newton.block[row, p], newton.light[row, p])
            _set_schur(model, newton, newton.lower[k])
            _factor(newton, newton.lower[k])


@inner
def _set_schur(model, newton, L):  # type: ignore[no-untyped-def]
    """Set the lower half of G (M + g D + g² K)⁻¹ Gᵀ in the order of the rows."""
    for i in range(newton.rank[0]):
        for j in range(newton.first[i], i + 1):
            L[i, j] = 0.0
    for at in range(len(model.pairs)):
        i, j, p, q = model.pairs[at, 0], model.pairs[at, 1], model.pairs[at, 2], model.pairs[at, 3]
        one, other = newton.place[i], newton.place[j]
        if one == NONE or other == NONE:
            continue
        total = 0j
        for k in range(6 + model.elastic[newton.owner[i, p], 0]):
            total += newton.block[i, p, k] * newton.light[j, q, k]
        if one >= other:
            L[one, other] += total
        else:
            L[other, one] += total


@inner
def _factor(newton, L):  # type: ignore[no-untyped-def]
    """Replace a complex symmetric matrix by its lower factor, L Lᵀ."""
    first = newton.first
    for i in range(newton.rank[0]):
        for j in range(first[i], i + 1):
            total = L[i, j]
            for k in range(max(first[i], first[j]), j):
                total -= L[i, k] * L[j, k]
            L[i, j] = total / L[j, j] if j < i else np.sqrt(total)


@inner
def _solve_rows(newton, L):  # type: ignore[no-untyped-def]
    """Set multipliers whose forces take what `lack` has of the rows' rates."""
    y, rows, first, r = newton.spare, newton.rows, newton.first, newton.rank[0]
    for i in range(r):
        total = newton.lack[rows[i]]
        for k in range(first[i], i):
            total -= L[i, k] * y[k]
        y[i] = total / L[i, i]
    for i in range(len(newton.multiplier)):
        newton.multiplier[i] = 0.0
    for step in range(r):
        i = r - 1 - step
        total = y[i]
        for k in range(i + 1, min(newton.end[i], r)):
            if first[k] <= i:
                total -= L[k, i] * y[k]
        y[i] = total / L[i, i]
        newton.multiplier[rows[i]] = y[i]


@inner
def solve_system(model, newton, y, k, time):  # type: ignore[no-untyped-def]
    """Set `change`, `moved` and multipliers μ/g of an eigenvalue over the step by the residuals `right` and `lack`.

    Args:
        y: State at the start.
        time: Eigenvalue over the step [1/s].
    """
    g, r, push, moved, D = 1.0 / time, newton.right, newton.push, newton.moved, newton.change
    for i in range(len(r)):
        D[i] = g * r[i]
    for b in range(len(model.mass)):
        s, m, q, momentum = WIDTH * b, model.elastic[b, 0], model.elastic[b, 1], model.elastic[b, 2]
        for i in range(3):
            push[b, i] = g * model.mass[b] * r[s + SPEED + i]
            push[b, 3 + i] = g * r[s + SPIN + i]
        for l in range(m):
            push[b, 6 + l] = g * (r[momentum + l] - g * model.modal_stiffness[b, l] * r[q + l])
        _solve_body(model, newton, b, k, push[b], moved[b])
    if newton.rank[0]:
        _hold(model, newton, k)
    for i in range(len(newton.multiplier)):
        newton.multiplier[i] *= time
    for b in range(len(model.mass)):
        s, m, q, momentum = WIDTH * b, model.elastic[b, 0], model.elastic[b, 1], model.elastic[b, 2]
        v = moved[b]
        for i in range(3):
            D[s + PLACE + i] += g * v[i]
            D[s + SPEED + i] = v[i]
            D[s + SPIN + i] = push[b, 3 + i]
        a, c, d = 0.5 * g * v[3], 0.5 * g * v[4], 0.5 * g * v[5]
        e = y[s + TURN : s + TURN + 4]
        D[s + TURN] += -a * e[1] - c * e[2] - d * e[3]
        D[s + TURN + 1] += a * e[0] + c * e[3] - d * e[2]
        D[s + TURN + 2] += c * e[0] + d * e[1] - a * e[3]
        D[s + TURN + 3] += d * e[0] + a * e[2] - c * e[1]
        for l in range(m):
            D[q + l] += g * v[6 + l]
            lost = model.modal_damping[b, l] * v[6 + l] + model.modal_stiffness[b, l] * D[q + l]
            D[momentum + l] = push[b, 6 + l] + g * (g * model.modal_stiffness[b, l] * r[q + l] - lost)


@inner
def _hold(model, newton, k):  # type: ignore[no-untyped-def]
    """Add the forces of the joints to what acts on the bodies, and change their velocities."""
    for at in range(newton.parts[0]):
        row, p, b = newton.part[at, 0], newton.part[at, 1], newton.part[at, 2]
        for l in range(6 + model.elastic[b, 0]):
            newton.lack[row] -= newton.block[row, p, l] * newton.moved[b, l]
    _solve_rows(newton, newton.lower[k])
    for at in range(newton.parts[0]):
        row, p, b = newton.part[at, 0], newton.part[at, 1], newton.part[at, 2]
        for l in range(6 + model.elastic[b, 0]):
            newton.push[b, l] += newton.multiplier[row] * newton.block[row, p, l]
    for b in range(len(model.mass)):
        _solve_body(model, newton, b, k, newton.push[b], newton.moved[b])
