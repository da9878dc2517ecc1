"""Bushings between bodies that turn, in compiled functions.

A bushing stands along the axes A of its point a on the other side, which turn with it. With d the way from a to its own
point b, R = Aᵀ B the rotation of b's axes from a's and θ its rotation vector, the motions are

  x = (Aᵀ d − rest, θ),  ẋ = (Aᵀ (v_b − v_a − ω_a × d), J⁻¹ Aᵀ (ω_b − ω_a)),

J⁻¹ = 1 − ½ θ̃ + c θ̃², c = (1 − ½ θ cot ½ θ)/θ². Of w = K x + C ẋ the body b gets the force −A w₁ at its point and the
moment −A J⁻ᵀ w₂, and a what balances them: their power is −w · ẋ, so that ½ xᵀ K x is the energy at any rotation below
a half turn. A field of charged conductors acts as a bushing does, with w = −∂G/∂x of its co-energy G.
"""

import numpy as np

from gudgeon.solver.compiled import inner
from gudgeon.solver.forces.fields.co_energy import evaluate
from gudgeon.solver.integrators.mechanism.arrays import LOST, NONE
from gudgeon.solver.integrators.mechanism.flexible.points import cross, press, rotated

WIDEST = 3.0
"""Rotation of a bushing above which it is not defined: near a half turn [rad]."""
SMALL = 1e-4
"""Rotation below which c is its limit, 1/12, to round-off [rad]."""


@inner
def _rotation(work, a, b, x):  # type: ignore[no-untyped-def]
    """Set the rotation vector of b's axes from a's, x[3:]; return the angle."""
    A, B = work.axes[a], work.axes[b]
    trace = 0.0
    for k in range(3):
        for i in range(3):
            trace += A[i, k] * B[i, k]
    # The vector of the antisymmetric part of R_ij = Σ_k A_ki B_kj, 2 sin θ times the axis.
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        one, other = 0.0, 0.0
        for n in range(3):
            one += A[n, k] * B[n, j]
            other += A[n, j] * B[n, k]
        x[3 + i] = 0.5 * (one - other)
    sine = np.sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5])
    angle = np.arctan2(sine, 0.5 * (trace - 1.0))
    factor = angle / sine if sine > SMALL else 1.0 + sine * sine / 6.0
    for i in range(3):
        x[3 + i] *= factor
    return angle


@inner
def _turned_rate(theta, angle, v, sign):  # type: ignore[no-untyped-def]
    """Return J⁻¹ v, or J⁻ᵀ v with a sign of −1."""
    half = 0.5 * angle
    c = (1.0 - half / np.tan(half)) / (angle * angle) if angle > SMALL else 1.0 / 12.0
    once = cross(theta, v)
    twice = cross(theta, once)
    return (
        v[0] - sign * 0.5 * once[0] + c * twice[0],
        v[1] - sign * 0.5 * once[1] + c * twice[1],
        v[2] - sign * 0.5 * once[2] + c * twice[2],
    )


@inner
def _along(A, v):  # type: ignore[no-untyped-def]
    """Return Aᵀ v."""
    return (
        A[0, 0] * v[0] + A[1, 0] * v[1] + A[2, 0] * v[2],
        A[0, 1] * v[0] + A[1, 1] * v[1] + A[2, 1] * v[2],
        A[0, 2] * v[0] + A[1, 2] * v[1] + A[2, 2] * v[2],
    )


@inner
def set_bushings(model, work):  # type: ignore[no-untyped-def]
    """Set motions and rates of all bushings, `Work.bush`, and force and moment on their own bodies, `Work.bush_push`;
    points are set."""
    first = len(model.point_owner) - 2 * len(model.bush_rest)
    for i in range(len(model.bush_rest)):
        a, b, x = first + 2 * i, first + 2 * i + 1, work.bush[i]
        A, wa, wb = work.axes[a], work.spin[a], work.spin[b]
        d = (
            work.place[b, 0] - work.place[a, 0], work.place[b, 1] - work.place[a, 1],
            work.place[b, 2] - work.place[a, 2],
        )  # fmt: skip
        carried = cross(wa, d)
        v = (
            work.speed[b, 0] - work.speed[a, 0] - carried[0], work.speed[b, 1] - work.speed[a, 1] - carried[1],
            work.speed[b, 2] - work.speed[a, 2] - carried[2],
        )  # fmt: skip
        angle = _rotation(work, a, b, x)
        theta = (x[3], x[4], x[5])
        local, moved = _along(A, d), _along(A, v)
        turning = _turned_rate(theta, angle, _along(A, (wb[0] - wa[0], wb[1] - wa[1], wb[2] - wa[2])), 1.0)
        for k in range(3):
            x[k] = local[k] - model.bush_rest[i, k]
            x[6 + k], x[9 + k] = moved[k], turning[k]
        w = work.bush_push[i]
        for k in range(6):
            total = 0.0
            for l in range(6):
                total += model.bush_stiffness[i, k, l] * x[l] + model.bush_damping[i, k, l] * x[6 + l]
            w[k] = -total
        n = model.bush_field[i]
        if n != NONE:
            evaluate(model.fields, n, x, work.field_basis, work.field[n])
            for k in range(6):
                w[k] = work.field[n, 1 + k]
        force = rotated(A, (w[0], w[1], w[2]))
        moment = rotated(A, _turned_rate(theta, angle, (w[3], w[4], w[5]), -1.0))
        for k in range(3):
            w[k], w[3 + k] = force[k], moment[k]


@inner
def press_bushings(model, work, sums):  # type: ignore[no-untyped-def]
    """Set all bushings and add their forces on both bodies, and the rate of what they dissipate."""
    set_bushings(model, work)
    first = len(model.point_owner) - 2 * len(model.bush_rest)
    for i in range(len(model.bush_rest)):
        a, b, w = first + 2 * i, first + 2 * i + 1, work.bush_push[i]
        press(model, work, b, w, 1.0)
        d = (
            work.place[b, 0] - work.place[a, 0], work.place[b, 1] - work.place[a, 1],
            work.place[b, 2] - work.place[a, 2],
        )  # fmt: skip
        lever = cross(d, (w[0], w[1], w[2]))
        press(model, work, a, (w[0], w[1], w[2], w[3] + lever[0], w[4] + lever[1], w[5] + lever[2]), -1.0)
        for k in range(6):
            for l in range(6):
                sums[LOST] += work.bush[i, 6 + k] * model.bush_damping[i, k, l] * work.bush[i, 6 + l]
