"""Inertia of bodies that deform, in compiled functions: angular velocity and modal rates from momenta, and back.

Along the axes of the body, ℓ = I ω + H q̇ and η = Hᵀ ω + M q̇, with I = tr J 1 − J and H_k the vector of B_k. Rates:

  ℓ̇ = moment of all forces,  η̇_k = ∂T/∂q_k − ω_k² q_k − d_k q̇_k + modal forces,
  ∂T/∂q_k = |ω|² tr B_k − ωᵀ B_k ω − ω · vector of Ḃ_k,  Ḃ_k = Σ_l q̇_l (G_lk − ½ K_lk).
"""

import numpy as np

from gudgeon.solver.compiled import inner
from gudgeon.solver.integrators.mechanism.arrays import SPIN, WIDTH


@inner
def _set_moments(model, work, y, b):  # type: ignore[no-untyped-def]
    """Set B and the factor of the inertia of a body over its rotation and elastic coordinates, along its own axes."""
    m, at = model.elastic[b, 0], model.elastic[b, 1]
    B, X, J = work.moment[b], work.inertia[b], work.spare_moment
    for i in range(3):
        for j in range(3):
            J[i, j] = model.second[b, i, j]
    for k in range(m):
        for i in range(3):
            for j in range(3):
                B[k, i, j] = model.lever[b, k, i, j]
    for l in range(m):
        q = y[at + l]
        if q != 0.0:
            for k in range(m):
                for i in range(3):
                    for j in range(3):
                        B[k, i, j] += q * model.pair[b, l, k, i, j]
    for k in range(m):
        q = y[at + k]
        for i in range(3):
            for j in range(3):
                J[i, j] += q * (model.lever[b, k, j, i] + B[k, i, j])
        X[3 + k, 0] = B[k, 1, 2] - B[k, 2, 1]
        X[3 + k, 1] = B[k, 2, 0] - B[k, 0, 2]
        X[3 + k, 2] = B[k, 0, 1] - B[k, 1, 0]
        for l in range(k + 1):
            X[3 + k, 3 + l] = model.modal_mass[b, k, l]
    trace = J[0, 0] + J[1, 1] + J[2, 2]
    for i in range(3):
        for j in range(i + 1):
            X[i, j] = -0.5 * (J[i, j] + J[j, i])
        X[i, i] += trace
    for i in range(3 + m):
        for j in range(i + 1):
            total = X[i, j]
            for k in range(j):
                total -= X[i, k] * X[j, k]
            # The root of a negative number is NaN, which ends the step.
            X[i, j] = total / X[j, j] if i > j else np.sqrt(total)


@inner
def solve_inertia(model, work, b, values):  # type: ignore[no-untyped-def]
    """Replace a moment along the scene's axes and modal forces by angular acceleration and modal ones, (3 + m,)."""
    Q, X, m = work.turn[b], work.inertia[b], model.elastic[b, 0]
    x, y, z = values[0], values[1], values[2]
    for i in range(3):
        values[i] = Q[0, i] * x + Q[1, i] * y + Q[2, i] * z
    for i in range(3 + m):
        total = values[i]
        for k in range(i):
            total -= X[i, k] * values[k]
        values[i] = total / X[i, i]
    for step in range(3 + m):
        i = 2 + m - step
        total = values[i]
        for k in range(i + 1, 3 + m):
            total -= X[k, i] * values[k]
        values[i] = total / X[i, i]
    x, y, z = values[0], values[1], values[2]
    for i in range(3):
        values[i] = Q[i, 0] * x + Q[i, 1] * y + Q[i, 2] * z


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
    Q, D = work.turn[b], work.moment_rate[b]
    w0 = Q[0, 0] * rates[0] + Q[1, 0] * rates[1] + Q[2, 0] * rates[2]
    w1 = Q[0, 1] * rates[0] + Q[1, 1] * rates[1] + Q[2, 1] * rates[2]
    w2 = Q[0, 2] * rates[0] + Q[1, 2] * rates[1] + Q[2, 2] * rates[2]
    for k in range(m):
        for i in range(3):
            for j in range(3):
                D[k, i, j] = 0.0
    for l in range(m):
        rate = rates[3 + l]
        if rate != 0.0:
            for k in range(m):
                for i in range(3):
                    for j in range(3):
                        D[k, i, j] += rate * model.pair[b, l, k, i, j]
    square = w0 * w0 + w1 * w1 + w2 * w2
    for k in range(m):
        B, own = work.moment[b, k], D[k]
        trace = B[0, 0] + B[1, 1] + B[2, 2]
        bent = w0 * (B[0, 0] * w0 + B[0, 1] * w1 + B[0, 2] * w2)
        bent += w1 * (B[1, 0] * w0 + B[1, 1] * w1 + B[1, 2] * w2)
        bent += w2 * (B[2, 0] * w0 + B[2, 1] * w1 + B[2, 2] * w2)
        across = w0 * (own[1, 2] - own[2, 1]) + w1 * (own[2, 0] - own[0, 2]) + w2 * (own[0, 1] - own[1, 0])
        work.across[b, k] = across
        elastic = model.modal_stiffness[b, k] * y[at + k] + model.modal_damping[b, k] * rates[3 + k]
        work.inner_force[b, k] = square * trace - bent - across - elastic


@inner
def set_flexible_rates(model, work, y, b):  # type: ignore[no-untyped-def]
    """Set angular and modal accelerations of a body under what presses on it, in `rate`."""
    m, Q, out = model.elastic[b, 0], work.turn[b], work.rate[b]
    w = work.omega[b]
    rates, s = work.modal[b], WIDTH * b + SPIN
    w0 = Q[0, 0] * w[0] + Q[1, 0] * w[1] + Q[2, 0] * w[2]
    w1 = Q[0, 1] * w[0] + Q[1, 1] * w[1] + Q[2, 1] * w[2]
    w2 = Q[0, 2] * w[0] + Q[1, 2] * w[1] + Q[2, 2] * w[2]
    # What the inertia's own change takes, along the axes of the body: I̊ ω + H̊ q̇.
    t0, t1, t2 = 0.0, 0.0, 0.0
    for k in range(m):
        B, D, rate = work.moment[b, k], work.moment_rate[b, k], rates[3 + k]
        trace = 2.0 * (B[0, 0] + B[1, 1] + B[2, 2])
        t0 += rate * (trace * w0 - 2 * B[0, 0] * w0 - (B[0, 1] + B[1, 0]) * w1 - (B[0, 2] + B[2, 0]) * w2)
        t1 += rate * (trace * w1 - (B[1, 0] + B[0, 1]) * w0 - 2 * B[1, 1] * w1 - (B[1, 2] + B[2, 1]) * w2)
        t2 += rate * (trace * w2 - (B[2, 0] + B[0, 2]) * w0 - (B[2, 1] + B[1, 2]) * w1 - 2 * B[2, 2] * w2)
        t0 += rate * (D[1, 2] - D[2, 1])
        t1 += rate * (D[2, 0] - D[0, 2])
        t2 += rate * (D[0, 1] - D[1, 0])
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
