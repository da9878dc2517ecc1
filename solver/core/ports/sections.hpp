/* Sections that touch: journals in their bearings, points on planes and in bores.
 *
 * With d from the bearing's point to the journal's section, u the bearing's axis and n the direction of d less its part
 * along u, the indentation is delta = |d - (d.u) u| - c. Its rate is n.v, with v the velocity of the section relative
 * to the bearing's material at the same place, and friction has that of the contact point, a journal's radius further
 * along n. A point in a bore is a journal without radius. Behind a plane across u it is delta = -d.u, and n = -u.
 *
 * Worn shapes of bearing and journal, and elastic bearings, lessen the indentation by H of `worn.hpp`,
 * delta = |e| - c - H(e), with e = d - (d.u) u. Its gradient N = n - grad H has not quite the length 1: the law's force
 * f(delta, delta') acts as f N, so that it has a potential.
 */
#pragma once
#include "../laws/power.hpp"
#include "../turning/markers.hpp"
#include "worn.hpp"

namespace gudgeon::turning {

/* Columns of `Work::touch`; those of `touching/columns.py`. */
struct Touch {
    enum : Index {
        DEPTH = 0,            /* Indentation [m] */
        RATE = 1,             /* and its rate [m/s], see `STRETCH`. */
        FORCE = 2,            /* [N] */
        SLIDING = 3,          /* Sliding speed [m/s]. */
        NORMAL = 4,           /* n; three numbers as of all whose next column is three further. */
        DRAG = 7,             /* Force of friction on the journal [N]. */
        APART = 10,           /* d [m]. */
        ARM = 13,             /* The section's place from the journal's point [m]. */
        LAW = 16,             /* Force of the law, which is `FORCE` on a round bearing [N]. */
        TWIST = 17,           /* Moment on a worn journal [N m]. */
        GRIP = 20,            /* Of a cone: limit of friction less the force of its spring [N], */
        ALONG = 21,           /* velocity along its deflection [m/s], */
        DEFLECTING = 22,      /* and rate of the deflection, two numbers [m/s]. */
        STRETCH = 24,         /* Rate of the indentation over that of the way along the normal: 1, but of elastic
                                 bearings, whose loss acts on the latter and so gives its restitution back. */
        OVER = 25,            /* Of a point before another body: whether it is over the surface of that. */
        COLUMNS = 26,
    };
};

/* Motion of a section relative to the material of its bearing. */
struct SectionMotion {
    Vec3 axis;                  /* u */
    Vec3 offset;                /* e [m] */
    Vec3 velocity;              /* [m/s] */
    Vec3 spin;                  /* Angular velocity of the journal relative to the bearing [rad/s]. */
};

/* Set friction of a section with sticking: a tangential spring whose force the cone bounds.
 *
 * The deflection s has components along two axes t and w of the plane of contact. Where the section sticks, s' = v and
 * the force is -k s; where it slips, -mu F s/|s|, and s turns with the velocity as that of a spring of deflection
 * mu F/k. The sliding speed is the power of friction over mu F: what the spring holds is given back.
 *
 * v: velocity of the contact point in the plane of contact [m/s]. */
inline void set_cone(const Model& model, const Work& work, Index i, Vec3 v, Vec3 t, Vec3 w) noexcept {
    const Vec touch = work.touch[i];
    const CVec friction = model.touch_friction[i];
    const double s0 = work.deflection(i, 0), s1 = work.deflection(i, 1), stiffness = friction[2];
    const double v0 = dot(v, t), v1 = dot(v, w);
    const double size = length_of(s0, s1), limit = friction[0] * touch[Touch::FORCE];
    const double over = size > 0.0 ? 1.0 / size : 0.0, along = (s0 * v0 + s1 * v1) * over;
    touch[Touch::GRIP] = limit - stiffness * size;
    touch[Touch::ALONG] = along;
    double pull = -stiffness, r0 = v0, r1 = v1, speed = 0.0;
    if (work.slipping[i]) {
        pull = -limit * over, speed = along;
        const double turning = size / (limit / stiffness + friction[3]);
        r0 = (v0 - along * s0 * over) * turning, r1 = (v1 - along * s1 * over) * turning;
    } else if (limit > 0.0) {
        speed = stiffness * size * along / limit;
    }
    if (!work.touching[i]) r0 = r1 = 0.0;
    touch[Touch::SLIDING] = speed;
    touch[Touch::DEFLECTING] = r0, touch[Touch::DEFLECTING + 1] = r1;
    put(touch, pull * (s0 * t + s1 * w), Touch::DRAG);
}

/* Set the tangential deflections of a state. */
inline void set_deflections(const Work& work, CVec y) noexcept {
    const Index first = y.size() - SUMS - PUSHES * work.touch.size();
    for (Index i = 0; i < work.touch.size(); ++i)
        for (Index k = 0; k < 2; ++k) work.deflection(i, k) = y[first + PUSHES * i + DEFLECTION + k];
}

/* Lessen the indentation of a section by its shapes; set its rate, normal and moment per force of the law.
 *
 * Returns the length of the gradient. */
inline double set_worn(const Model& model, const Work& work, Index i, const SectionMotion& motion) noexcept {
    const Vec touch = work.touch[i];
    const Vec3 u = motion.axis, e = motion.offset;
    const bool yields = model.yielding[i] >= 0;
    Vec3 gradient = three(touch, Touch::NORMAL);
    double turning = 0.0;
    for (Index side = 0; side < 2; ++side) {
        if (!model.worn_cells(i, side) && (side == 1 || !yields)) continue;
        const Mat axes = work.axes[2 * model.touch_pair[i] + side];
        const Vec3 x = column(axes, 0), y = column(axes, 1);
        const double ex = dot(e, x), ey = dot(e, y);
        const Depth shape = yields ? yielding_depth(model, i, ex, ey) : soft_depth(model, i, side, ex, ey);
        touch[Touch::DEPTH] -= shape.depth;
        const Vec3 g = shape.x * x + shape.y * y;
        gradient = gradient - g + dot(g, u) * u;
        if (side == 0) continue;
        const Vec3 twist = cross(g, e);  /* Its shape turns with the journal. */
        put(touch, twist, Touch::TWIST);
        turning = dot(twist, motion.spin);
    }
    const double size = length(gradient), over = size > 0.0 ? 1.0 / size : 0.0;
    touch[Touch::RATE] = dot(gradient, motion.velocity) - turning;
    put(touch, over * gradient, Touch::NORMAL);
    if (yields) {
        touch[Touch::RATE] *= over;
        touch[Touch::STRETCH] = size;
    }
    return size;
}

/* Set friction of a section with a cone, along axes about and along the bearing's axis, or along a plane. */
inline void set_section_cone(const Model& model, const Work& work, Index i, Vec3 v, Vec3 n, Vec3 u) noexcept {
    const Mat axes = work.axes[2 * model.touch_pair[i]];
    if (model.touch_shape[i] == PLANE)
        set_cone(model, work, i, v, column(axes, 0), column(axes, 1));
    else
        set_cone(model, work, i, v, cross(u, n), u);
}

/* Set friction of a section under its force, across the normal n. */
inline void set_friction(const Model& model, const Work& work, Index i, const SectionMotion& motion, Vec3 n) noexcept {
    const Vec touch = work.touch[i];
    const CVec friction = model.touch_friction[i];
    const double radius = model.touch_size(i, 1), rate = dot(n, motion.velocity);
    const Vec3 v = motion.velocity + cross(motion.spin, radius * n) - rate * n;
    if (friction[2] > 0.0) {
        set_section_cone(model, work, i, v, n, motion.axis);
        return;
    }
    const bool rubs = friction[0] > 0.0;
    /* Of points without friction it is not asked for: |v| has a kink where sliding turns back. */
    const double sliding = radius > 0.0 || rubs ? length(v) : 0.0;
    touch[Touch::SLIDING] = sliding;
    const double slow = friction[1];
    const double drag = rubs ? -touch[Touch::FORCE] * friction[0] / std::sqrt(sliding * sliding + slow * slow) : 0.0;
    put(touch, drag * v, Touch::DRAG);
}

/* Set what section i does; points are set. */
inline void set_touch(const Model& model, const Work& work, Index i) noexcept {
    const Index a = 2 * model.touch_pair[i], b = a + 1;
    const Vec touch = work.touch[i];
    const Vec3 u = column(work.axes[a], 2), arm = model.touch_size(i, 2) * column(work.axes[b], 2);
    const Vec3 sa = three(work.spin[a]), sb = three(work.spin[b]);
    const Vec3 d = three(work.place[b]) + arm - three(work.place[a]);
    const Vec3 bearing = three(work.speed[a]) + cross(sa, d) + three(model.touch_belt[i]);
    const Vec3 v = three(work.speed[b]) + cross(sb, arm) - bearing;
    const double along = dot(d, u);
    const SectionMotion motion{u, d - along * u, v, sb - sa};
    double size = -along;
    Vec3 n = -u;
    if (model.touch_shape[i] != PLANE) {
        size = length(motion.offset);
        n = (size > 0.0 ? 1.0 / size : 0.0) * motion.offset;
    }
    touch[Touch::DEPTH] = size - model.touch_size(i, 0), touch[Touch::RATE] = dot(n, v);
    put(touch, n, Touch::NORMAL);
    put(touch, d, Touch::APART);
    put(touch, arm, Touch::ARM);
    put(touch, Vec3{}, Touch::TWIST);
    touch[Touch::STRETCH] = 1.0;
    double steepness = 1.0;
    if (model.worn_cells(i, 0) || model.worn_cells(i, 1) || model.yielding[i] >= 0) {
        steepness = set_worn(model, work, i, motion);
        n = three(touch, Touch::NORMAL);
    }
    double force = 0.0;
    if (work.touching[i]) {
        const double depth = touch[Touch::DEPTH] + work.shift[i];
        force = law_force(model.touch_law[i], depth, touch[Touch::RATE], work.approach[i]).force;
    }
    put(touch, force * three(touch, Touch::TWIST), Touch::TWIST);
    touch[Touch::LAW] = force;
    touch[Touch::FORCE] = force * steepness;
    set_friction(model, work, i, motion, n);
}

/* Set what every section does; points are set. */
inline void set_touches(const Model& model, const Work& work) noexcept {
    for (Index i = 0; i < model.touch_pair.size(); ++i)
        if (model.touch_shape[i] != SURFACE) set_touch(model, work, i);
}

/* Force and moment on the journal about a point from which its section is at `arm`. */
inline Wrench wrench_on_journal(const Model& model, const Work& work, Index i, Vec3 arm) noexcept {
    const Vec touch = work.touch[i];
    const Vec3 n = three(touch, Touch::NORMAL), drag = three(touch, Touch::DRAG);
    const Vec3 force = drag - touch[Touch::FORCE] * n;
    return {force, cross(arm, force) + cross(model.touch_size(i, 1) * n, drag) + three(touch, Touch::TWIST)};
}

/* Power of an obstacle whose surface moves on a section that rubs on it [W]. */
inline double belt_power(const Model& model, const Work& work, Index i) noexcept {
    return dot(three(work.touch[i], Touch::DRAG), three(model.touch_belt[i]));
}

/* Rate of what a law dissipates [W]: its force less the elastic part, per unit of indentation, times its rate.
 *
 * A contact that ends by its dashpot at a depth above zero presses no more, and the surface recovers without it. What
 * approaches and does not touch yet is the end of a step that is tried. */
inline double law_loss(const Model& model, const Work& work, Index i) noexcept {
    const double depth = work.touch(i, Touch::DEPTH) + work.shift[i];
    if (depth <= 0.0 || (!work.touching[i] && work.touch(i, Touch::RATE) > 0.0)) return 0.0;
    const CVec law = model.touch_law[i];
    return (work.touch(i, Touch::LAW) - law[0] * power_of(depth, law[1])) * work.touch(i, Touch::RATE);
}

/* Rate of what friction dissipates, and of what the spring of a cone stores, which `energy` takes off again [W]. */
inline double friction_loss(const Model& model, const Work& work, Index i) noexcept {
    const CVec friction = model.touch_friction[i];
    const double force = work.touch(i, Touch::FORCE), sliding = work.touch(i, Touch::SLIDING), slow = friction[1];
    if (friction[2] > 0.0) return friction[0] * force * sliding;
    if (!(friction[0] > 0.0)) return 0.0;
    const double square = sliding * sliding;
    return force * friction[0] * square / std::sqrt(square + slow * slow);
}

/* Set every section and add its forces on both bodies, and the rates of what laws and friction dissipate. */
inline void press_touches(const Model& model, const Work& work, Vec sums) noexcept {
    set_touches(model, work);
    for (Index i = 0; i < model.touch_pair.size(); ++i) {
        const Vec touch = work.touch[i];
        if (model.touch_shape[i] == SURFACE) continue;
        sums[LOST] += law_loss(model, work, i) * touch[Touch::STRETCH];
        if (!work.touching[i] || touch[Touch::DEPTH] + work.shift[i] <= 0.0) continue;
        const Index a = 2 * model.touch_pair[i];
        press(model, work, a + 1, wrench_on_journal(model, work, i, three(touch, Touch::ARM)), 1.0);
        press(model, work, a, wrench_on_journal(model, work, i, three(touch, Touch::APART)), -1.0);
        sums[WORK] += belt_power(model, work, i);
        sums[LOST] += friction_loss(model, work, i);
    }
}

/* Set the rates of the integrals of each section, which stand before the other sums.
 *
 * Of points with friction it is the power of friction over the coefficient, which is smooth where sliding stops. */
inline void set_touch_sums(const Model& model, const Work& work, Vec out) noexcept {
    const Index first = out.size() - SUMS - PUSHES * work.touch.size();
    for (Index i = 0; i < work.touch.size(); ++i) {
        const Vec touch = work.touch[i], sums = out.slice(first + PUSHES * i, first + PUSHES * (i + 1));
        const CVec friction = model.touch_friction[i];
        const double force = touch[Touch::FORCE];
        double sliding = touch[Touch::SLIDING];
        if (sliding > 0.0 && model.touch_size(i, 1) == 0.0 && friction[2] == 0.0)
            sliding *= sliding / std::sqrt(sliding * sliding + friction[1] * friction[1]);
        sums[0] = force;
        sums[1] = force * sliding;
        put(sums, -force * three(touch, Touch::NORMAL), NORMAL_PUSH);
        put(sums, three(touch, Touch::DRAG), DRAG_PUSH);
        const bool sticks = friction[2] > 0.0;
        for (Index k = 0; k < 2; ++k) sums[DEFLECTION + k] = sticks ? touch[Touch::DEFLECTING + k] : 0.0;
    }
}

}  // namespace gudgeon::turning
