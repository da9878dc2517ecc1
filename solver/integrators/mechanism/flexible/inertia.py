"""Inertia of bodies that deform, in compiled functions: angular velocity and modal rates from momenta, and back.

Along the axes of the body, ℓ = I ω + H q̇ and η = Hᵀ ω + M q̇, with I = tr J 1 − J and H_k the vector of B_k. Rates:

  ℓ̇ = moment of all forces,  η̇_k = ∂T/∂q_k − ω_k² q_k − d_k q̇_k + modal forces,
  ∂T/∂q_k = |ω|² tr B_k − ωᵀ B_k ω − ω · vector of Ḃ_k,  Ḃ_k = Σ_l q̇_l (G_lk − ½ K_lk).

Of B_k the symmetric part and the vector are used, nine numbers in the order of `arrays.MOMENTS`. M does not change, and
is 1 of shapes that have no momenta at rest. With M = L Lᵀ and W = H L⁻ᵀ the inertia is factored as

  M = L Lᵀ,  I − W Wᵀ = R Rᵀ, (3, 3),

so that it takes a number of products that grows with m, or with its square where L is no diagonal.
"""

import numpy as np

from gudgeon.solver.compiled import inner
from gudgeon.solver.integrators.mechanism.arrays import CURL, SPIN, WIDTH


@inner
def _add_pairs(model, b, values, at, part, target):  # type: ignore[no-untyped-def]
    """Add to parts of moments, from one on, Σ_l of those of k for l times values, which begin at a place.

    Four l at a time: the pairs stand in no nearer memory than the second one, and the sums are read as often as they.
    """
    m = model.elastic[b, 0]
    whole = m - m % 4
    for l in range(0, whole, 4):
        P, R, S, T = model.pair[b, l], model.pair[b, l + 1], model.pair[b, l + 2], model.pair[b, l + 3]
        p, r, s, t = values[at + l], values[at + l + 1], values[at + l + 2], values[at + l + 3]
        for c in range(len(target)):
            to, P0, R0, S0, T0 = target[c], P[part + c], R[part + c], S[part + c], T[part + c]
            for k in range(m):
                to[k] += p * P0[k] + r * R0[k] + s * S0[k] + t * T0[k]
    for l in range(whole, m):
        P, p = model.pair[b, l], values[at + l]
        for c in range(len(target)):
            to, P0 = target[c], P[part + c]
            for k in range(m):
                to[k] += p * P0[k]


@inner
def _set_moments(model, work, y, b):  # type: ignore[no-untyped-def]
    """Set B and the factor of the inertia of a body over its rotation and elastic coordinates, along its own axes."""
    m, at = model.elastic[b, 0], model.elastic[b, 1]
    B, S = work.moment[b], model.lever[b]
    for c in range(CURL + 3):
        for k in range(m):
            B[c, k] = S[c, k]
    _add_pairs(model, b, y, at, 0, B)
    J = work.second[b]
    for c in range(CURL):
        total = model.second[b, c]
        for k in range(m):
            total += y[at + k] * (S[c, k] + B[c, k])
        J[c] = total
    W = work.coupling[b]
    for c in range(3):
        for k in range(m):
            W[c, k] = B[CURL + c, k]
        _lower(model, b, W[c], 0)
    _factor(work, b, m)


@inner
def _factor(work, b, m):  # type: ignore[no-untyped-def]
    """Set R, the root of I − W Wᵀ."""
    J, W, R = work.second[b], work.coupling[b], work.root[b]
    R[0, 0], R[1, 1], R[2, 2] = J[1] + J[2], J[2] + J[0], J[0] + J[1]
    R[2, 1], R[2, 0], R[1, 0] = -0.5 * J[3], -0.5 * J[4], -0.5 * J[5]
    for i in range(3):
        for j in range(i + 1):
            total = R[i, j]
            for k in range(m):
                total -= W[i, k] * W[j, k]
            for k in range(j):
                total -= R[i, k] * R[j, k]
            # The root of a negative number is NaN, which ends the step.
            R[i, j] = total / R[j, j] if i > j else np.sqrt(total)


@inner
def _lower(model, b, values, first):  # type: ignore[no-untyped-def]
    """Replace modal forces, from the place `first` on, by L⁻¹ times them."""
    L, m = model.modal_root[b], model.elastic[b, 0]
    if model.orthogonal[b]:
        for k in range(m):
            values[first + k] /= L[k, k]
        return
    for i in range(m):
        total = values[first + i]
        for k in range(i):
            total -= L[i, k] * values[first + k]
        values[first + i] = total / L[i, i]


@inner
def _upper(model, b, values, first):  # type: ignore[no-untyped-def]
    """Replace numbers, from the place `first` on, by L⁻ᵀ times them."""
    L, m = model.modal_root[b], model.elastic[b, 0]
    if model.orthogonal[b]:
        for k in range(m):
            values[first + k] /= L[k, k]
        return
    for step in range(m):
        i = m - 1 - step
        values[first + i] /= L[i, i]
        for k in range(i):
            values[first + k] -= L[i, k] * values[first + i]


@inner
def solve_inertia(model, work, b, values):  # type: ignore[no-untyped-def]
    """Replace a moment along the scene's axes and modal forces by angular acceleration and modal ones, (3 + m,)."""
    Q, R, W, m = work.turn[b], work.root[b], work.coupling[b], model.elastic[b, 0]
    _lower(model, b, values, 3)
    x, y, z = values[0], values[1], values[2]
    u = Q[0, 0] * x + Q[1, 0] * y + Q[2, 0] * z
    v = Q[0, 1] * x + Q[1, 1] * y + Q[2, 1] * z
    w = Q[0, 2] * x + Q[1, 2] * y + Q[2, 2] * z
    for k in range(m):
        u -= W[0, k] * values[3 + k]
        v -= W[1, k] * values[3 + k]
        w -= W[2, k] * values[3 + k]
    u /= R[0, 0]
    v = (v - R[1, 0] * u) / R[1, 1]
    w = (w - R[2, 0] * u - R[2, 1] * v) / R[2, 2]
    w /= R[2, 2]
    v = (v - R[2, 1] * w) / R[1, 1]
    u = (u - R[2, 0] * w - R[1, 0] * v) / R[0, 0]
    for k in range(m):
        values[3 + k] -= W[0, k] * u + W[1, k] * v + W[2, k] * w
    _upper(model, b, values, 3)
    for i in range(3):
        values[i] = Q[i, 0] * u + Q[i, 1] * v + Q[i, 2] * w


@inner
def set_flexible(model, work, y, b):  # type: ignore[no-untyped-def]
    """Set angular velocity along the scene's axes, modal rates and modal forces of a body that deforms."""
    m, at, momentum = model.elastic[b, 0], model.elastic[b, 1], model.elastic[b, 2]
    _set_moments(model, work, y, b)
    rates = work.modal[b]
    for i in range(3):
        rates[i] = y[WIDTH * b + SPIN + i]
    for k in range(m):
        rates[3 + k] = y[momentum + k]
    solve_inertia(model, work, b, rates)
    for i in range(3):
        work.omega[b, i] = rates[i]
    Q, D, B = work.turn[b], work.moment_rate[b], work.moment[b]
    w0 = Q[0, 0] * rates[0] + Q[1, 0] * rates[1] + Q[2, 0] * rates[2]
    w1 = Q[0, 1] * rates[0] + Q[1, 1] * rates[1] + Q[2, 1] * rates[2]
    w2 = Q[0, 2] * rates[0] + Q[1, 2] * rates[1] + Q[2, 2] * rates[2]
    for c in range(3):
        for k in range(m):
            D[c, k] = 0.0
    _add_pairs(model, b, rates, 3, CURL, D)
    for k in range(m):
        bent = (w1 * w1 + w2 * w2) * B[0, k] + (w2 * w2 + w0 * w0) * B[1, k] + (w0 * w0 + w1 * w1) * B[2, k]
        bent -= w1 * w2 * B[3, k] + w2 * w0 * B[4, k] + w0 * w1 * B[5, k]
        across = w0 * D[0, k] + w1 * D[1, k] + w2 * D[2, k]
        work.across[b, k] = across
        elastic = model.modal_stiffness[b, k] * y[at + k] + model.modal_damping[b, k] * rates[3 + k]
        work.inner_force[b, k] = bent - across - elastic


@inner
def _along(rates, values, m):  # type: ignore[no-untyped-def]
    """Return Σ q̇_k times values, (m,)."""
    total = 0.0
    for k in range(m):
        total += rates[3 + k] * values[k]
    return total


@inner
def set_flexible_rates(model, work, y, b):  # type: ignore[no-untyped-def]
    """Set angular and modal accelerations of a body under what presses on it, in `rate`."""
    m, Q, out = model.elastic[b, 0], work.turn[b], work.rate[b]
    B, D, w = work.moment[b], work.moment_rate[b], work.omega[b]
    rates, s = work.modal[b], WIDTH * b + SPIN
    w0 = Q[0, 0] * w[0] + Q[1, 0] * w[1] + Q[2, 0] * w[2]
    w1 = Q[0, 1] * w[0] + Q[1, 1] * w[1] + Q[2, 1] * w[2]
    w2 = Q[0, 2] * w[0] + Q[1, 2] * w[1] + Q[2, 2] * w[2]
    # What the inertia's own change takes, along the axes of the body: I̊ ω + H̊ q̇.
    xx, yy, zz = _along(rates, B[0], m), _along(rates, B[1], m), _along(rates, B[2], m)
    yz, zx, xy = _along(rates, B[3], m), _along(rates, B[4], m), _along(rates, B[5], m)
    t0 = 2 * (yy + zz) * w0 - xy * w1 - zx * w2 + _along(rates, D[0], m)
    t1 = 2 * (zz + xx) * w1 - xy * w0 - yz * w2 + _along(rates, D[1], m)
    t2 = 2 * (xx + yy) * w2 - zx * w0 - yz * w1 + _along(rates, D[2], m)
    lx = w[1] * y[s + 2] - w[2] * y[s + 1]
    ly = w[2] * y[s] - w[0] * y[s + 2]
    lz = w[0] * y[s + 1] - w[1] * y[s]
    tail = out[3:]
    tail[0] = work.push[b, 3] - lx - (Q[0, 0] * t0 + Q[0, 1] * t1 + Q[0, 2] * t2)
    tail[1] = work.push[b, 4] - ly - (Q[1, 0] * t0 + Q[1, 1] * t1 + Q[1, 2] * t2)
    tail[2] = work.push[b, 5] - lz - (Q[2, 0] * t0 + Q[2, 1] * t1 + Q[2, 2] * t2)
    for k in range(m):
        tail[3 + k] = work.push[b, 6 + k] - work.across[b, k]
    solve_inertia(model, work, b, tail)
