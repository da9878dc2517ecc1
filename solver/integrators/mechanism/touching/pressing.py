"""Points that press on surfaces of other bodies, or on the ground, in compiled functions; equations and arrays stand in
`surfaces`."""

import numpy as np

from gudgeon.solver.compiled import inner
from gudgeon.solver.integrators.mechanism.arrays import LOST, NONE, PLACE, SPEED, WIDTH, WORK
from gudgeon.solver.integrators.mechanism.flexible.points import cross, rotated
from gudgeon.solver.integrators.mechanism.touching.flexibility import forced_out, over, set_dents, set_forces
from gudgeon.solver.integrators.mechanism.touching.kernel import (
    ALONG,
    APART,
    DEFLECTING,
    DEPTH,
    DRAG,
    FORCE,
    GRIP,
    LAW,
    NORMAL,
    OVER,
    RATE,
    SLIDING,
    TWIST,
    belt_power,
    set_cone,
)
from gudgeon.solver.integrators.mechanism.touching.splines import cubic, cubic_rates, height_at, interval
from gudgeon.solver.laws.force import law_force

FACING = -0.3
"""Largest cosine between the outward normals of a point and of the surface that it can meet."""


@inner
def set_pressing(model, work, y):  # type: ignore[no-untyped-def]
    """Set what all points do in a state whose poses are set."""
    f, found = model.surfaces, work.pressing
    first = len(model.touch_pair) - len(f.arm)
    for s in range(len(f.owner)):
        apart = _apart(model, work, y, s)
        found.live[s] = apart <= 0.0
        for p in range(f.points[s, 0], f.points[s, 1]):
            own = work.touch[first + p]
            found.near[p], found.force[p] = 0, 0.0
            own[DEPTH] = -f.deep[s] - (apart if apart > 0.0 else 0.0)
            own[RATE], own[FORCE], own[SLIDING], own[OVER], own[LAW] = 0.0, 0.0, 0.0, 0.0, 0.0
            own[GRIP], own[ALONG], own[DEFLECTING], own[DEFLECTING + 1] = 0.0, 0.0, 0.0, 0.0
            for k in range(3):
                own[NORMAL + k], own[DRAG + k], own[APART + k], own[TWIST + k] = 0.0, 0.0, 0.0, 0.0
            if found.live[s]:
                _place(model, work, y, s, p)
    count = set_forces(model, work, first)
    set_dents(model, work, count)
    _settle(model, work, first, count)


@inner
def _apart(model, work, y, s):  # type: ignore[no-untyped-def]
    """Return the distance between the balls around the points and the surface of a pair [m]; 0 before the ground."""
    if model.surfaces.owner[s, 1] == NONE:
        return 0.0
    a, b, balls = model.surfaces.owner[s, 0], model.surfaces.owner[s, 1], model.surfaces.balls[s]
    one, other = rotated(work.turn[a], balls[0, :3]), rotated(work.turn[b], balls[1, :3])
    total, at, there = 0.0, WIDTH * a + PLACE, WIDTH * b + PLACE
    for k in range(3):
        total += (y[at + k] + one[k] - y[there + k] - other[k]) ** 2
    return np.sqrt(total) - balls[0, 3] - balls[1, 3]


@inner
def _carried(model, work, y, s, p):  # type: ignore[no-untyped-def]
    """Set the arms of a point; return its velocity relative to the surface as if that were rigid [m/s]."""
    f, a, b = model.surfaces, model.surfaces.owner[s, 0], model.surfaces.owner[s, 1]
    m, at = model.elastic[a, 0], model.elastic[a, 1]
    u0, u1, u2 = f.arm[p, 0], f.arm[p, 1], f.arm[p, 2]
    w0, w1, w2 = 0.0, 0.0, 0.0
    for k in range(m):
        q, rate = y[at + k], work.modal[a, 3 + k]
        u0, u1, u2 = u0 + f.rows[p, 0, k] * q, u1 + f.rows[p, 1, k] * q, u2 + f.rows[p, 2, k] * q
        w0, w1, w2 = w0 + f.rows[p, 0, k] * rate, w1 + f.rows[p, 1, k] * rate, w2 + f.rows[p, 2, k] * rate
    r, w = rotated(work.turn[a], (u0, u1, u2)), rotated(work.turn[a], (w0, w1, w2))
    here, there, arm = WIDTH * a, WIDTH * b, work.pressing.arm[p]
    for k in range(3):
        arm[0, k], arm[1, k] = r[k], y[here + PLACE + k] + r[k]
    own = cross(work.omega[a], arm[0])
    v0 = y[here + SPEED] + own[0] + w[0]
    v1 = y[here + SPEED + 1] + own[1] + w[1]
    v2 = y[here + SPEED + 2] + own[2] + w[2]
    if b == NONE:
        belt = model.touch_belt[len(model.touch_pair) - len(f.arm) + p]
        return v0 - belt[0], v1 - belt[1], v2 - belt[2]
    for k in range(3):
        arm[1, k] -= y[there + PLACE + k]
    other = cross(work.omega[b], arm[1])
    return v0 - y[there + SPEED] - other[0], v1 - y[there + SPEED + 1] - other[1], v2 - y[there + SPEED + 2] - other[2]


@inner
def _in_frame(model, work, s, v):  # type: ignore[no-untyped-def]
    """Return a vector of the scene along the axes of a surface."""
    b, C = model.surfaces.owner[s, 1], model.surfaces.axes[s]
    if b == NONE:
        return rotated(C, v)
    Q = work.turn[b]
    z0 = Q[0, 0] * v[0] + Q[1, 0] * v[1] + Q[2, 0] * v[2]
    z1 = Q[0, 1] * v[0] + Q[1, 1] * v[1] + Q[2, 1] * v[2]
    z2 = Q[0, 2] * v[0] + Q[1, 2] * v[1] + Q[2, 2] * v[2]
    return rotated(C, (z0, z1, z2))


@inner
def _from_frame(model, work, s, v):  # type: ignore[no-untyped-def]
    """Return a vector along the axes of a surface along those of the scene."""
    C = model.surfaces.axes[s]
    z0 = C[0, 0] * v[0] + C[1, 0] * v[1] + C[2, 0] * v[2]
    z1 = C[0, 1] * v[0] + C[1, 1] * v[1] + C[2, 1] * v[2]
    z2 = C[0, 2] * v[0] + C[1, 2] * v[1] + C[2, 2] * v[2]
    if model.surfaces.owner[s, 1] == NONE:
        return z0, z1, z2
    return rotated(work.turn[model.surfaces.owner[s, 1]], (z0, z1, z2))


@inner
def _place(model, work, y, s, p):  # type: ignore[no-untyped-def]
    """Set the gap of a point and its slope, without forces, and whether it may press."""
    f, found, b = model.surfaces, work.pressing, model.surfaces.owner[s, 1]
    v = _carried(model, work, y, s, p)
    r, o, C = _in_frame(model, work, s, found.arm[p, 1]), f.origin[s], f.axes[s]
    at, away, h = r[0], r[1], r[2]
    at -= C[0, 0] * o[0] + C[0, 1] * o[1] + C[0, 2] * o[2]
    away -= C[1, 0] * o[0] + C[1, 1] * o[1] + C[1, 2] * o[2]
    h -= C[2, 0] * o[0] + C[2, 1] * o[1] + C[2, 2] * o[2]
    if b == NONE:
        _place_on_ground(model, work, s, p, (at, away, h), v)
        return
    x = ((at - f.low[s, 0]) / f.step[s, 0], (away - f.low[s, 1]) / f.step[s, 1])
    cell = (interval(x[0], f.cells[s, 0]), interval(x[1], f.cells[s, 1]))
    if cell[0] < 0 or cell[1] < 0 or not f.cover[f.cells[s, 3] + cell[0] * f.cells[s, 1] + cell[1]]:
        return
    H, Hs, Ht, Hss, Hst, Htt = height_at(f, s, cell, x)
    c = 1.0 / np.sqrt(1.0 + Hs * Hs + Ht * Ht)
    lift = h - H
    own = _in_frame(model, work, s, rotated(work.turn[f.owner[s, 0]], f.normal[p]))
    if c * (own[2] - own[0] * Hs - own[1] * Ht) > FACING or not -f.deep[s] < c * lift < f.deep[s]:
        return
    cube = c * c * c
    e, es, et, rate = _outward(model, work, y, (s, p, b), at, away)
    slope = found.slope[p]
    slope[0] = -cube * (Hs * Hss + Ht * Hst) * lift - c * Hs - es
    slope[1] = -cube * (Hs * Hst + Ht * Htt) * lift - c * Ht - et
    slope[2] = c
    found.gap[p], found.near[p] = c * lift - e, 1
    own = work.touch[len(model.touch_pair) - len(f.arm) + p]
    w = _in_frame(model, work, s, v)
    own[OVER], own[DEPTH] = 1.0, -found.gap[p]
    own[RATE] = rate - slope[0] * w[0] - slope[1] * w[1] - slope[2] * w[2]
    for k in range(3):
        own[APART + k] = v[k]


@inner
def _place_on_ground(model, work, s, p, r, v):  # type: ignore[no-untyped-def]
    """Set the gap of a point before a plane or in a bore of the ground, and its slope.

    Args:
        r: Its place in the frame of the obstacle [m].
        v: Its velocity [m/s].
    """
    found, radius, slope = work.pressing, model.surfaces.radius[s], work.pressing.slope[p]
    found.near[p], found.gap[p] = 1, r[2]
    slope[0], slope[1], slope[2] = 0.0, 0.0, 1.0
    if radius > 0.0:
        far = np.sqrt(r[0] * r[0] + r[1] * r[1])
        less = -1.0 / far if far > 0.0 else 0.0
        found.gap[p] = radius - far
        slope[0], slope[1], slope[2] = less * r[0], less * r[1], 0.0
    n, Q = _from_frame(model, work, s, slope), work.turn[model.surfaces.owner[s, 0]]
    own = work.touch[len(model.touch_pair) - len(model.surfaces.arm) + p]
    own[OVER], own[DEPTH] = 1.0, -found.gap[p]
    own[RATE] = -n[0] * v[0] - n[1] * v[1] - n[2] * v[2]
    for k in range(3):
        own[APART + k] = v[k]
        found.inward[p, k] = Q[0, k] * n[0] + Q[1, k] * n[1] + Q[2, k] * n[2]


@inner
def _outward(model, work, y, of, at, away):  # type: ignore[no-untyped-def]
    """Set N and its slopes at a place; return N·e, its slopes and its rate by the modes.

    Args:
        of: Pair, point and body of the surface.
    """
    s, p, b = of
    f, found = model.surfaces, work.pressing
    u, v = (at - f.start[s, 0]) / f.spacing[s, 0], (away - f.start[s, 1]) / f.spacing[s, 1]
    i = min(max(int(np.floor(u)), 0), f.counts[s, 0] - 4)
    j = min(max(int(np.floor(v)), 0), f.counts[s, 1] - 4)
    first = f.functions[s, 0] + i * f.counts[s, 1] + j
    A, B, dA, dB = cubic(u - i), cubic(v - j), cubic_rates(u - i), cubic_rates(v - j)
    found.first[p] = first
    m, q = model.elastic[b, 0], model.elastic[b, 1]
    e, es, et, rate = 0.0, 0.0, 0.0, 0.0
    for k in range(4):
        for l in range(4):
            N, Ns, Nt = A[k] * B[l], dA[k] * B[l] / f.spacing[s, 0], A[k] * dB[l] / f.spacing[s, 1]
            weights, g = found.weights[p], 4 * k + l
            weights[0, g], weights[1, g], weights[2, g] = N, Ns, Nt
            moved, moving, row = 0.0, 0.0, f.outward[first + k * f.counts[s, 1] + l]
            for n in range(m):
                moved += row[n] * y[q + n]
                moving += row[n] * work.modal[b, 3 + n]
            e, es, et, rate = e + N * moved, es + Ns * moved, et + Nt * moved, rate + N * moving
    return e, es, et, rate


@inner
def _settle(model, work, first, count):  # type: ignore[no-untyped-def]
    """Set forces, their directions and friction; gaps of points that do not press include what the others press in."""
    f, found = model.surfaces, work.pressing
    a = 0
    for s in range(len(f.owner)):
        if not found.live[s]:
            continue
        for p in range(f.points[s, 0], f.points[s, 1]):
            if not found.near[p]:
                continue
            own, i = work.touch[first + p], first + p
            if f.by_law[s]:
                if work.touching[i]:
                    own[LAW], _, _ = law_force(
                        model.touch_law[i], own[DEPTH] + work.shift[i], own[RATE], work.approach[i]
                    )
                    found.force[p] = own[LAW]
            elif work.touching[i]:
                total = 0.0
                for k in range(a + 1):
                    total += found.matrix[a, k] * found.matrix[a, k]
                own[DEPTH], a = total * found.force[p], a + 1
            else:
                own[DEPTH] = -found.gap[p] - forced_out(model, work, s, p, count)
            if found.force[p] != 0.0 or (work.touching[i] and model.touch_friction[i, 2] > 0.0):
                _direct(model, work, s, p, i)


@inner
def _direct(model, work, s, p, i):  # type: ignore[no-untyped-def]
    """Set the direction of a point's force, and its friction."""
    f, found, own = model.surfaces, work.pressing, work.touch[i]
    s0, s1, s2 = found.slope[p, 0], found.slope[p, 1], found.slope[p, 2]
    if not f.by_law[s]:
        s0 += over(work, p, 1, f.counts[s, 1], found.dents)
        s1 += over(work, p, 2, f.counts[s, 1], found.dents)
    if f.radius[s] > 0.0:  # By R the point is beside its place, where a bore has another normal.
        u = _in_frame(model, work, s, rotated(work.turn[f.owner[s, 0]], found.moved[p]))
        less = (u[0] * s1 - u[1] * s0) / (f.radius[s] - found.gap[p])
        s0, s1 = s0 - less * s1, s1 + less * s0
    size = np.sqrt(s0 * s0 + s1 * s1 + s2 * s2)
    d = _from_frame(model, work, s, (s0, s1, s2))
    own[FORCE] = found.force[p] * size
    along = 0.0
    for k in range(3):
        found.direction[p, k], own[NORMAL + k] = d[k], -d[k] / size
        along += own[APART + k] * d[k] / size
    n, v = own[NORMAL : NORMAL + 3], own[APART : APART + 3]
    v0, v1, v2 = v[0] + along * n[0], v[1] + along * n[1], v[2] + along * n[2]
    if model.touch_friction[i, 2] > 0.0:
        t, w = _across(model, work, s, n)
        set_cone(model, work, i, (v0, v1, v2), t, w)
        return
    square = v0 * v0 + v1 * v1 + v2 * v2
    own[SLIDING] = np.sqrt(square)
    drag = -own[FORCE] * model.touch_friction[i, 0] / np.sqrt(square + model.touch_friction[i, 1] ** 2)
    own[DRAG], own[DRAG + 1], own[DRAG + 2] = drag * v0, drag * v1, drag * v2


@inner
def _across(model, work, s, n):  # type: ignore[no-untyped-def]
    """Return two axes of the plane of contact across a normal, the second one along the axis of a bore."""
    bore = model.surfaces.radius[s] > 0.0
    c = _from_frame(model, work, s, (0.0, 0.0, 1.0) if bore else (0.0, 1.0, 0.0))
    along = c[0] * n[0] + c[1] * n[1] + c[2] * n[2]
    w0, w1, w2 = c[0] - along * n[0], c[1] - along * n[1], c[2] - along * n[2]
    less = 1.0 / np.sqrt(w0 * w0 + w1 * w1 + w2 * w2)
    w = (less * w0, less * w1, less * w2)
    return cross(w, n), w


@inner
def press_surfaces(model, work, sums):  # type: ignore[no-untyped-def]
    """Add the forces of all points on both bodies, and the rates of what laws and friction dissipate."""
    f, found = model.surfaces, work.pressing
    first = len(model.touch_pair) - len(f.arm)
    for s in range(len(f.owner)):
        if not found.live[s]:
            continue
        for p in range(f.points[s, 0], f.points[s, 1]):
            own, force = work.touch[first + p], found.force[p]
            if force == 0.0:
                continue
            drag, d = own[DRAG : DRAG + 3], found.direction[p]
            total = (force * d[0] + drag[0], force * d[1] + drag[1], force * d[2] + drag[2])
            _push(model, work, s, p, total)
            sums[WORK] += belt_power(model, work, first + p)
            if f.by_law[s]:
                law = model.touch_law[first + p]
                depth = own[DEPTH] + work.shift[first + p]
                sums[LOST] += (own[LAW] - law[0] * depth ** law[1]) * own[RATE]
            if model.touch_friction[first + p, 2] > 0.0:  # With what the spring stores, which `energy` takes off again.
                sums[LOST] += model.touch_friction[first + p, 0] * own[FORCE] * own[SLIDING]
            elif model.touch_friction[first + p, 0] > 0.0:
                slow, square = model.touch_friction[first + p, 1], own[SLIDING] * own[SLIDING]
                sums[LOST] += own[FORCE] * model.touch_friction[first + p, 0] * square / np.sqrt(square + slow * slow)


@inner
def _push(model, work, s, p, total):  # type: ignore[no-untyped-def]
    """Add a force on a point, and its opposite on the other body, to modes of which its part across it acts."""
    f, found = model.surfaces, work.pressing
    ground = f.owner[s, 1] == NONE
    for side in range(1 if ground else 2):
        b, sign = f.owner[s, side], 1.0 - 2.0 * side
        moment = cross(found.arm[p, side], total)
        for k in range(3):
            work.push[b, k] += sign * total[k]
            work.push[b, 3 + k] += sign * moment[k]
    a, b = f.owner[s, 0], f.owner[s, 1]
    Q = work.turn[a]
    for k in range(model.elastic[a, 0]):
        moved = rotated(Q, f.rows[p, :, k])
        work.push[a, 6 + k] += moved[0] * total[0] + moved[1] * total[1] + moved[2] * total[2]
    if ground:
        twist = rotated(Q, cross(found.moved[p], found.inward[p]))
        for k in range(3):
            work.push[a, 3 + k] += found.force[p] * twist[k]
        return
    for k in range(model.elastic[b, 0]):
        work.push[b, 6 + k] -= found.force[p] * over(work, p, 0, f.counts[s, 1], f.outward[:, k])
