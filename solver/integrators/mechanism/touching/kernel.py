"""Sections that touch: journals in their bearings, points on planes and in bores, in compiled functions.

With d from the bearing's point to the journal's section, u the bearing's axis and n the direction of d less its part
along u, the indentation is δ = |d − (d·u) u| − c. Its rate is n · v, with v the velocity of the section relative to the
bearing's material at the same place, and friction has that of the contact point, a journal's radius further along n. A
point in a bore is a journal without radius. Behind a plane across u it is δ = −d · u, and n = −u.

Worn shapes of bearing and journal lessen the indentation by what `soft` defines, δ = |e| − c − H(e), with
e = d − (d·u) u, and elastic bearings by what `yielding` does. Its gradient N = n − ∇H has not quite the length 1: the
law's force f(δ, δ̇) acts as f N, so that it has a potential.
"""

import numpy as np

from gudgeon.solver.compiled import inner
from gudgeon.solver.integrators.mechanism.arrays import (
    DEFLECTION,
    DRAG_PUSH,
    LOST,
    NORMAL_PUSH,
    PLANE,
    PUSHES,
    SUMS,
    SURFACE,
    WORK,
)
from gudgeon.solver.integrators.mechanism.flexible.points import cross, press
from gudgeon.solver.integrators.mechanism.touching.soft import soft_depth
from gudgeon.solver.integrators.mechanism.touching.yielding import yielding_depth
from gudgeon.solver.laws.force import law_force

DEPTH, RATE, FORCE, SLIDING = range(4)
"""Columns of `Work.touch`: indentation [m] and its rate [m/s], see `STRETCH`, force [N], sliding speed [m/s]."""
NORMAL, DRAG, APART, ARM = 4, 7, 10, 13
"""Where vectors begin: n, force of friction on the journal [N], d, and the section's place from the journal's point."""
LAW, TWIST = 16, 17
"""Force of the law, which is `FORCE` on a round bearing [N], and where the moment on a worn journal begins [N m]."""
GRIP, ALONG, DEFLECTING = 20, 21, 22
"""Of a cone: limit of friction less the force of its spring [N], velocity along its deflection [m/s], and where the
rate of the deflection begins [m/s]."""
STRETCH = 24
"""Rate of the indentation over that of the way along the normal: 1, but of elastic bearings, whose loss acts on the
latter and so gives its restitution back, whatever the potential."""
OVER = 25
"""Of a point before another body: whether it is over the surface of that."""
COLUMNS = 26


@inner
def set_touches(model, work):  # type: ignore[no-untyped-def]
    """Set what every section does; points are set."""
    for i in range(len(model.touch_pair)):
        if model.touch_shape[i] == SURFACE:
            continue
        a, b, found = 2 * model.touch_pair[i], 2 * model.touch_pair[i] + 1, work.touch[i]
        clearance, radius, offset = model.touch_size[i, 0], model.touch_size[i, 1], model.touch_size[i, 2]
        u = (work.axes[a, 0, 2], work.axes[a, 1, 2], work.axes[a, 2, 2])
        arm = (offset * work.axes[b, 0, 2], offset * work.axes[b, 1, 2], offset * work.axes[b, 2, 2])
        sa, sb, belt = work.spin[a], work.spin[b], model.touch_belt[i]
        d = (
            work.place[b, 0] + arm[0] - work.place[a, 0],
            work.place[b, 1] + arm[1] - work.place[a, 1],
            work.place[b, 2] + arm[2] - work.place[a, 2],
        )
        own, carried = cross(sb, arm), cross(sa, d)
        along = d[0] * u[0] + d[1] * u[1] + d[2] * u[2]
        if model.touch_shape[i] == PLANE:
            size = -along
            n = (-u[0], -u[1], -u[2])
        else:
            e0, e1, e2 = d[0] - along * u[0], d[1] - along * u[1], d[2] - along * u[2]
            size = np.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
            over = 1.0 / size if size > 0.0 else 0.0
            n = (e0 * over, e1 * over, e2 * over)
        v0 = work.speed[b, 0] + own[0] - work.speed[a, 0] - carried[0] - belt[0]
        v1 = work.speed[b, 1] + own[1] - work.speed[a, 1] - carried[1] - belt[1]
        v2 = work.speed[b, 2] + own[2] - work.speed[a, 2] - carried[2] - belt[2]
        rate = n[0] * v0 + n[1] * v1 + n[2] * v2
        found[DEPTH], found[RATE] = size - clearance, rate
        for k in range(3):
            found[NORMAL + k], found[APART + k], found[ARM + k], found[TWIST + k] = n[k], d[k], arm[k], 0.0
        apart = (sb[0] - sa[0], sb[1] - sa[1], sb[2] - sa[2])
        length, found[STRETCH] = 1.0, 1.0
        if model.worn_cells[i, 0] or model.worn_cells[i, 1] or model.yielding[i] >= 0:
            length = _set_worn(model, work, i, (v0, v1, v2), apart)
            n = (found[NORMAL], found[NORMAL + 1], found[NORMAL + 2])
            rate = n[0] * v0 + n[1] * v1 + n[2] * v2
        force = 0.0
        if work.touching[i]:
            force, _, _ = law_force(model.touch_law[i], found[DEPTH] + work.shift[i], found[RATE], work.approach[i])
        for k in range(3):
            found[TWIST + k] *= force
        found[LAW], force = force, force * length
        found[FORCE] = force
        turned = cross(apart, (radius * n[0], radius * n[1], radius * n[2]))
        v0, v1, v2 = v0 + turned[0] - rate * n[0], v1 + turned[1] - rate * n[1], v2 + turned[2] - rate * n[2]
        if model.touch_friction[i, 2] > 0.0:
            t, w = _across(model, work, i, n, u)
            set_cone(model, work, i, (v0, v1, v2), t, w)
            continue
        slow, drag, sliding = model.touch_friction[i, 1], 0.0, 0.0
        rubs = model.touch_friction[i, 0] > 0.0
        # Of points without friction it is not asked for: |v| has a kink where sliding turns back.
        if radius > 0.0 or rubs:
            sliding = np.sqrt(v0 * v0 + v1 * v1 + v2 * v2)
        found[SLIDING] = sliding
        if rubs:
            drag = -force * model.touch_friction[i, 0] / np.sqrt(sliding * sliding + slow * slow)
        found[DRAG], found[DRAG + 1], found[DRAG + 2] = drag * v0, drag * v1, drag * v2


@inner
def _across(model, work, i, n, u):  # type: ignore[no-untyped-def]
    """Return two axes of the plane of contact of a section: about and along the bearing's axis, or along a plane."""
    a = 2 * model.touch_pair[i]
    if model.touch_shape[i] == PLANE:
        t = (work.axes[a, 0, 0], work.axes[a, 1, 0], work.axes[a, 2, 0])
        return t, (work.axes[a, 0, 1], work.axes[a, 1, 1], work.axes[a, 2, 1])
    return cross(u, n), u


@inner
def set_cone(model, work, i, v, t, w):  # type: ignore[no-untyped-def]
    """Set friction of a section with sticking: a tangential spring whose force the cone bounds.

    The deflection s has components along two axes of the plane of contact. Where the section sticks, ṡ = v and the
    force is −k s; where it slips, −μ F s/|s|, and s turns with the velocity as that of a spring of deflection μ F/k.
    The sliding speed is the power of friction over μ F: what the spring holds is given back.

    Args:
        v: Velocity of the contact point in the plane of contact [m/s].
        t: First axis.
        w: Second one.
    """
    found = work.touch[i]
    s0, s1, stiffness = work.deflection[i, 0], work.deflection[i, 1], model.touch_friction[i, 2]
    v0, v1 = v[0] * t[0] + v[1] * t[1] + v[2] * t[2], v[0] * w[0] + v[1] * w[1] + v[2] * w[2]
    size, limit = np.sqrt(s0 * s0 + s1 * s1), model.touch_friction[i, 0] * found[FORCE]
    over = 1.0 / size if size > 0.0 else 0.0
    along = (s0 * v0 + s1 * v1) * over
    found[GRIP], found[ALONG] = limit - stiffness * size, along
    pull = -stiffness
    r0, r1, speed = v0, v1, 0.0
    if work.slipping[i]:
        pull, speed = -limit * over, along
        turning = size / (limit / stiffness + model.touch_friction[i, 3])
        r0, r1 = (v0 - along * s0 * over) * turning, (v1 - along * s1 * over) * turning
    elif limit > 0.0:
        speed = stiffness * size * along / limit
    if not work.touching[i]:
        r0, r1 = 0.0, 0.0
    found[SLIDING], found[DEFLECTING], found[DEFLECTING + 1] = speed, r0, r1
    for k in range(3):
        found[DRAG + k] = pull * (s0 * t[k] + s1 * w[k])


@inner
def set_deflections(work, y):  # type: ignore[no-untyped-def]
    """Set the tangential deflections of a state."""
    first = len(y) - SUMS - PUSHES * len(work.touch)
    for i in range(len(work.touch)):
        work.deflection[i, 0] = y[first + PUSHES * i + DEFLECTION]
        work.deflection[i, 1] = y[first + PUSHES * i + DEFLECTION + 1]


@inner
def _set_worn(model, work, i, v, apart):  # type: ignore[no-untyped-def]
    """Lessen the indentation of a section by its worn shapes; set its rate, normal and moment per force of the law.

    Args:
        v: Velocity of the section relative to the bearing's material [m/s].
        apart: Angular velocity of the journal relative to the bearing [rad/s].

    Returns:
        Length of the gradient.
    """
    a, found = 2 * model.touch_pair[i], work.touch[i]
    u = work.axes[a, :, 2]
    d = found[APART : APART + 3]
    along = d[0] * u[0] + d[1] * u[1] + d[2] * u[2]
    e = (d[0] - along * u[0], d[1] - along * u[1], d[2] - along * u[2])
    g0, g1, g2, turning = found[NORMAL], found[NORMAL + 1], found[NORMAL + 2], 0.0
    for side in range(2):
        if not model.worn_cells[i, side] and (side == 1 or model.yielding[i] < 0):
            continue
        x, y = work.axes[a + side, :, 0], work.axes[a + side, :, 1]
        ex, ey = e[0] * x[0] + e[1] * x[1] + e[2] * x[2], e[0] * y[0] + e[1] * y[1] + e[2] * y[2]
        if model.yielding[i] >= 0:
            depth, gx, gy = yielding_depth(model, i, ex, ey)
        else:
            depth, gx, gy = soft_depth(model, i, side, ex, ey)
        found[DEPTH] -= depth
        g = (gx * x[0] + gy * y[0], gx * x[1] + gy * y[1], gx * x[2] + gy * y[2])
        over = g[0] * u[0] + g[1] * u[1] + g[2] * u[2]
        g0, g1, g2 = g0 - g[0] + over * u[0], g1 - g[1] + over * u[1], g2 - g[2] + over * u[2]
        if side == 1:  # Its shape turns with the journal.
            twist = cross(g, e)
            found[TWIST], found[TWIST + 1], found[TWIST + 2] = twist
            turning = twist[0] * apart[0] + twist[1] * apart[1] + twist[2] * apart[2]
    found[RATE] = g0 * v[0] + g1 * v[1] + g2 * v[2] - turning
    length = np.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
    over = 1.0 / length if length > 0.0 else 0.0
    found[NORMAL], found[NORMAL + 1], found[NORMAL + 2] = g0 * over, g1 * over, g2 * over
    if model.yielding[i] >= 0:
        found[RATE], found[STRETCH] = found[RATE] * over, length
    return length


@inner
def wrench_on_journal(model, work, i, arm):  # type: ignore[no-untyped-def]
    """Return force and moment on the journal about a point from which its section is at `arm`."""
    found = work.touch[i]
    n, force, radius = found[NORMAL : NORMAL + 3], found[FORCE], model.touch_size[i, 1]
    drag = (found[DRAG], found[DRAG + 1], found[DRAG + 2])
    f = (drag[0] - force * n[0], drag[1] - force * n[1], drag[2] - force * n[2])
    moment = cross(arm, f)
    rubbed = cross((radius * n[0], radius * n[1], radius * n[2]), drag)
    twist = found[TWIST : TWIST + 3]
    return (
        f[0], f[1], f[2], moment[0] + rubbed[0] + twist[0], moment[1] + rubbed[1] + twist[1],
        moment[2] + rubbed[2] + twist[2],
    )  # fmt: skip


@inner
def press_touches(model, work, sums):  # type: ignore[no-untyped-def]
    """Set every section and add its forces on both bodies, and the rates of what laws and friction dissipate."""
    set_touches(model, work)
    for i in range(len(model.touch_pair)):
        found, depth = work.touch[i], work.touch[i, DEPTH] + work.shift[i]
        if not work.touching[i] or depth <= 0.0 or model.touch_shape[i] == SURFACE:
            continue
        a, b = 2 * model.touch_pair[i], 2 * model.touch_pair[i] + 1
        press(model, work, b, wrench_on_journal(model, work, i, found[ARM : ARM + 3]), 1.0)
        press(model, work, a, wrench_on_journal(model, work, i, found[APART : APART + 3]), -1.0)
        law = model.touch_law[i]
        elastic = law[0] * depth ** law[1]
        sums[LOST] += (found[LAW] - elastic) * found[RATE] * found[STRETCH]
        sums[WORK] += belt_power(model, work, i)
        slow = model.touch_friction[i, 1]
        if model.touch_friction[i, 2] > 0.0:  # With what the spring stores, which `energy` takes off again.
            sums[LOST] += model.touch_friction[i, 0] * found[FORCE] * found[SLIDING]
        elif model.touch_friction[i, 0] > 0.0:
            square = found[SLIDING] * found[SLIDING]
            sums[LOST] += found[FORCE] * model.touch_friction[i, 0] * square / np.sqrt(square + slow * slow)


@inner
def belt_power(model, work, i):  # type: ignore[no-untyped-def]
    """Return the power of an obstacle whose surface moves on a section that rubs on it [W]."""
    drag, belt = work.touch[i, DRAG : DRAG + 3], model.touch_belt[i]
    return drag[0] * belt[0] + drag[1] * belt[1] + drag[2] * belt[2]


@inner
def set_touch_sums(model, work, out):  # type: ignore[no-untyped-def]
    """Set the rates of the integrals of each section, which stand before the other sums.

    Of points with friction it is the power of friction over the coefficient, which is smooth where sliding stops.
    """
    for i in range(len(work.touch)):
        first = len(out) - SUMS - PUSHES * (len(work.touch) - i)
        force = work.touch[i, FORCE]
        out[first] = force
        sliding = work.touch[i, SLIDING]
        if sliding > 0.0 and model.touch_size[i, 1] == 0.0 and model.touch_friction[i, 2] == 0.0:
            sliding *= sliding / np.sqrt(sliding * sliding + model.touch_friction[i, 1] ** 2)
        out[first + 1] = force * sliding
        for k in range(3):
            out[first + NORMAL_PUSH + k] = -force * work.touch[i, NORMAL + k]
            out[first + DRAG_PUSH + k] = work.touch[i, DRAG + k]
        out[first + DEFLECTION], out[first + DEFLECTION + 1] = 0.0, 0.0
        if model.touch_friction[i, 2] > 0.0:
            out[first + DEFLECTION] = work.touch[i, DEFLECTING]
            out[first + DEFLECTION + 1] = work.touch[i, DEFLECTING + 1]
