"""Points with axes on bodies and the ground, in compiled functions: where they are, how they move, what acts there.

A point of a body that deforms is at A (c + Ψ q − ½ qᵀ K q) from the centre. Its axes turn, relative to the frame, by
θ = Ψ′ q − ½ qᵀ K′ q, in Cayley's formula 1 + 2 (g̃ + g̃²)/(1 + g²) with g = ½ θ, whose angular velocity is
(θ̇ + g × θ̇)/(1 + g²).
"""

from gudgeon.solver.compiled import inner
from gudgeon.solver.integrators.mechanism.arrays import NONE, PLACE, SPEED, WIDTH


@inner
def cross(a, b):  # type: ignore[no-untyped-def]
    """Return the vector product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inner
def rotated(Q, v):  # type: ignore[no-untyped-def]
    """Return Q v, of a matrix and a vector of three."""
    return (
        Q[0, 0] * v[0] + Q[0, 1] * v[1] + Q[0, 2] * v[2],
        Q[1, 0] * v[0] + Q[1, 1] * v[1] + Q[1, 2] * v[2],
        Q[2, 0] * v[0] + Q[2, 1] * v[1] + Q[2, 2] * v[2],
    )


@inner
def _put(target, first):  # type: ignore[no-untyped-def]
    target[0], target[1], target[2] = first[0], first[1], first[2]


@inner
def _set_curved(model, work, y, p, i, b):  # type: ignore[no-untyped-def]
    """Set what the second order adds to a row of a point, `curved`, and its rate, `moving`.

    Four coordinates at a time: the sums are read as often as the matrix.
    """
    m, at, rates, bend = model.elastic[b, 0], model.elastic[b, 1], work.modal[b], model.point_bend[p, i]
    curved, moving = work.curved, work.moving
    for k in range(m):
        curved[k], moving[k] = 0.0, 0.0
    whole = m - m % 4
    for l in range(0, whole, 4):
        P, R, S, T = bend[l], bend[l + 1], bend[l + 2], bend[l + 3]
        p0, r0, s0, t0 = y[at + l], y[at + l + 1], y[at + l + 2], y[at + l + 3]
        p1, r1, s1, t1 = rates[3 + l], rates[4 + l], rates[5 + l], rates[6 + l]
        for k in range(m):
            curved[k] += p0 * P[k] + r0 * R[k] + s0 * S[k] + t0 * T[k]
            moving[k] += p1 * P[k] + r1 * R[k] + s1 * S[k] + t1 * T[k]
    for l in range(whole, m):
        q, rate, row = y[at + l], rates[3 + l], bend[l]
        for k in range(m):
            curved[k] += q * row[k]
            moving[k] += rate * row[k]


@inner
def _deformed(model, work, y, p, b):  # type: ignore[no-untyped-def]
    """Set displacement, rotation and their first and second rates of a point in its body, (3, 6), and its rows."""
    m, at, rates = model.elastic[b, 0], model.elastic[b, 1], work.modal[b]
    local, rows, curved, moving = work.local[p], work.point_rows[p], work.curved, work.moving
    for k in range(m):
        curved[k], moving[k] = 0.0, 0.0
    for i in range(6):
        if model.bends[p]:
            _set_curved(model, work, y, p, i, b)
        value, speed, second = 0.0, 0.0, 0.0
        for k in range(m):
            row, rate = model.point_rows[p, i, k], rates[3 + k]
            rows[i, k] = row - curved[k]
            value += (row - 0.5 * curved[k]) * y[at + k]
            speed += (row - curved[k]) * rate
            second -= moving[k] * rate
        local[0, i], local[1, i], local[2, i] = value, speed, second


@inner
def _set_ground(model, work, p):  # type: ignore[no-untyped-def]
    """Set a point of the ground, which stays or is driven."""
    first, c, F = model.point_drive[p], model.point_arm[p], model.point_frame[p]
    for i in range(3):
        work.place[p, i], work.arm[p, i], work.speed[p, i] = c[i], 0.0, 0.0
        work.drift[p, i], work.spin[p, i], work.spin_drift[p, i] = 0.0, 0.0, 0.0
        if first != NONE:
            way = work.given[first + i]
            work.place[p, i] += way[0]
            work.speed[p, i], work.drift[p, i] = way[1], way[2]
        for j in range(3):
            work.axes[p, i, j] = F[i, j]


@inner
def set_points(model, work, y):  # type: ignore[no-untyped-def]
    """Set place, arm, velocity, axes and angular velocity of all points, and what of their second rates is without
    accelerations; poses are set."""
    for p in range(len(model.point_owner)):
        b, c, F = model.point_owner[p], model.point_arm[p], model.point_frame[p]
        if b == NONE:
            _set_ground(model, work, p)
            continue
        Q, w, s, m = work.turn[b], work.omega[b], WIDTH * b, model.elastic[b, 0]
        omega = (w[0], w[1], w[2])
        if m == 0:
            r = rotated(Q, c)
            u = cross(omega, r)
            drift = cross(omega, u)
            for j in range(3):
                _put(work.axes[p, :, j], rotated(Q, F[:, j]))
            for i in range(3):
                work.spin[p, i], work.spin_drift[p, i] = omega[i], 0.0
        else:
            _deformed(model, work, y, p, b)
            local, rows = work.local[p], work.point_rows[p]
            r = rotated(Q, (c[0] + local[0, 0], c[1] + local[0, 1], c[2] + local[0, 2]))
            moved = rotated(Q, local[1, :3])
            second = rotated(Q, local[2, :3])
            turned = cross(omega, r)
            u = (turned[0] + moved[0], turned[1] + moved[1], turned[2] + moved[2])
            first, coriolis = cross(omega, turned), cross(omega, moved)
            drift = (
                first[0] + 2 * coriolis[0] + second[0],
                first[1] + 2 * coriolis[1] + second[1],
                first[2] + 2 * coriolis[2] + second[2],
            )
            _set_axes(work, p, Q, F, omega)
            for k in range(m):
                column = rotated(Q, rows[:3, k])
                turning = rotated(Q, _by_cayley(local[0, 3:], rows[3:, k]))
                _put(rows[:3, k], column)
                _put(rows[3:, k], turning)
        for i in range(3):
            work.arm[p, i] = r[i]
            work.place[p, i] = y[s + PLACE + i] + r[i]
            work.speed[p, i] = y[s + SPEED + i] + u[i]
            work.drift[p, i] = drift[i]


@inner
def _by_cayley(theta, rate):  # type: ignore[no-untyped-def]
    """Return (θ̇ + g × θ̇)/(1 + g²), g = ½ θ."""
    g = (0.5 * theta[0], 0.5 * theta[1], 0.5 * theta[2])
    over = 1.0 / (1.0 + g[0] * g[0] + g[1] * g[1] + g[2] * g[2])
    c = cross(g, rate)
    return over * (rate[0] + c[0]), over * (rate[1] + c[1]), over * (rate[2] + c[2])


@inner
def _set_axes(work, p, Q, F, omega):  # type: ignore[no-untyped-def]
    """Set axes and angular velocity of a point, and the latter's rate without accelerations."""
    local = work.local[p]
    theta, rate, second = local[0, 3:], local[1, 3:], local[2, 3:]
    g = (0.5 * theta[0], 0.5 * theta[1], 0.5 * theta[2])
    size = 1.0 + g[0] * g[0] + g[1] * g[1] + g[2] * g[2]
    own = _by_cayley(theta, rate)
    change = -(g[0] * rate[0] + g[1] * rate[1] + g[2] * rate[2]) / size
    bend = _by_cayley(theta, second)
    relative = rotated(Q, own)
    own_drift = rotated(Q, (bend[0] + change * own[0], bend[1] + change * own[1], bend[2] + change * own[2]))
    carried = cross(omega, relative)
    for i in range(3):
        work.spin[p, i] = omega[i] + relative[i]
        work.spin_drift[p, i] = carried[i] + own_drift[i]
    for j in range(3):
        v = (F[0, j], F[1, j], F[2, j])
        once = cross(g, v)
        twice = cross(g, once)
        turned = (
            v[0] + 2 * (once[0] + twice[0]) / size,
            v[1] + 2 * (once[1] + twice[1]) / size,
            v[2] + 2 * (once[2] + twice[2]) / size,
        )
        _put(work.axes[p, :, j], rotated(Q, turned))


@inner
def spread(model, work, p, wrench, factor, target):  # type: ignore[no-untyped-def]
    """Add factor times force and moment at a point, (6,), to force, moment about the centre and modal forces on its
    body, (6 + m,)."""
    b = model.point_owner[p]
    if b == NONE:
        return
    force, moment = (wrench[0], wrench[1], wrench[2]), (wrench[3], wrench[4], wrench[5])
    lever = cross(work.arm[p], force)
    for i in range(3):
        target[i] += factor * force[i]
        target[3 + i] += factor * (lever[i] + moment[i])
    rows = work.point_rows[p]
    for k in range(model.elastic[b, 0]):
        total = 0.0
        for i in range(3):
            total += rows[i, k] * force[i] + rows[3 + i, k] * moment[i]
        target[6 + k] += factor * total


@inner
def press(model, work, p, wrench, factor):  # type: ignore[no-untyped-def]
    """Add factor times force and moment at a point, (6,), to what acts on its body."""
    if model.point_owner[p] != NONE:
        spread(model, work, p, wrench, factor, work.push[model.point_owner[p]])
