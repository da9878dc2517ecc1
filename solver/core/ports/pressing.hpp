/* Points that press on surfaces of other bodies, or on the ground; equations and arrays stand in
 * `turning/touching_arrays.hpp`.
 */
#pragma once
#include "flexibility.hpp"
#include "sections.hpp"
#include "splines.hpp"

namespace gudgeon::turning {

/* Largest cosine between the outward normals of a point and of the surface that it can meet. */
constexpr double FACING = -0.3;

/* Section of the first point: they stand last. */
inline Index first_section(const Model& model) noexcept { return model.touch_pair.size() - model.surfaces.arm.size(); }

/* Distance between the balls around the points and the surface of a pair [m]; 0 before the ground. */
inline double apart_of(const Model& model, const Work& work, CVec y, Index s) noexcept {
    const Index a = model.surfaces.owner(s, 0), b = model.surfaces.owner(s, 1);
    if (b == NONE) return 0.0;
    const CMat balls = model.surfaces.balls[s];
    const Vec3 from = three(y, WIDTH * b + PLACE) + rotated(work.turn[b], three(balls[1]));
    const Vec3 way = three(y, WIDTH * a + PLACE) + rotated(work.turn[a], three(balls[0])) - from;
    return length(way) - balls(0, 3) - balls(1, 3);
}

/* Set the arms of a point; return its velocity relative to the surface as if that were rigid [m/s]. */
inline Vec3 set_carried(const Model& model, const Work& work, CVec y, Index s, Index p) noexcept {
    const Surfaces& f = model.surfaces;
    const Index a = f.owner(s, 0), b = f.owner(s, 1), m = model.elastic(a, 0);
    const CMat rows = f.rows[p];
    const CVec q = y.slice(model.elastic(a, 1), model.elastic(a, 1) + m), rates = work.modal[a].slice(3, 3 + m);
    Vec3 u = three(f.arm[p]), w;
    for (Index k = 0; k < m; ++k) {
        const Vec3 row = column(rows, k);
        u = u + q[k] * row;
        w = w + rates[k] * row;
    }
    const Vec3 r = rotated(work.turn[a], u), place = three(y, WIDTH * a + PLACE) + r;
    const Mat arm = work.pressing.arm[p];
    put(arm[0], r);
    put(arm[1], place);
    const Vec3 v = three(y, WIDTH * a + SPEED) + cross(three(work.omega[a]), r) + rotated(work.turn[a], w);
    if (b == NONE) return v - three(model.touch_belt[first_section(model) + p]);
    const Vec3 other = place - three(y, WIDTH * b + PLACE);
    put(arm[1], other);
    return v - three(y, WIDTH * b + SPEED) - cross(three(work.omega[b]), other);
}

/* A vector of the scene along the axes of a surface. */
inline Vec3 in_frame(const Model& model, const Work& work, Index s, Vec3 v) noexcept {
    const Index b = model.surfaces.owner(s, 1);
    return rotated(model.surfaces.axes[s], b == NONE ? v : rotated_back(work.turn[b], v));
}

/* A vector along the axes of a surface along those of the scene. */
inline Vec3 from_frame(const Model& model, const Work& work, Index s, Vec3 v) noexcept {
    const Index b = model.surfaces.owner(s, 1);
    const Vec3 z = rotated_back(model.surfaces.axes[s], v);
    return b == NONE ? z : rotated(work.turn[b], z);
}

/* Set the gap of a point before a plane or in a bore of the ground, and its slope.
 *
 * r: its place in the frame of the obstacle [m].  v: its velocity [m/s]. */
inline void place_on_ground(const Model& model, const Work& work, Index s, Index p, Vec3 r, Vec3 v) noexcept {
    const Pressing& found = work.pressing;
    const double radius = model.surfaces.radius[s];
    Vec3 slope{0.0, 0.0, 1.0};
    found.near[p] = 1;
    found.gap[p] = r.z;
    if (radius > 0.0) {
        const double far = length_of(r.x, r.y), less = far > 0.0 ? -1.0 / far : 0.0;
        found.gap[p] = radius - far;
        slope = {less * r.x, less * r.y, 0.0};
    }
    put(found.slope[p], slope);
    const Vec3 n = from_frame(model, work, s, slope);
    const Vec touch = work.touch[first_section(model) + p];
    touch[Touch::OVER] = 1.0, touch[Touch::DEPTH] = -found.gap[p];
    touch[Touch::RATE] = -dot(n, v);
    put(touch, v, Touch::APART);
    put(found.inward[p], rotated_back(work.turn[model.surfaces.owner(s, 0)], n));
}

/* N.e of a surface at a place [m], its slopes, and its rate by the modes [m/s]. */
struct Outward {
    double value, s, t, rate;
};

/* Set N and its slopes at a place (s, t) in the frame of surface s [m]; return N.e. */
inline Outward set_outward(const Model& model, const Work& work, CVec y, Index s, Index p, double along,
                           double away) noexcept {
    const Surfaces& f = model.surfaces;
    const Pressing& found = work.pressing;
    const double ds = f.spacing(s, 0), dt = f.spacing(s, 1);
    const double u = (along - f.start(s, 0)) / ds, v = (away - f.start(s, 1)) / dt;
    const Index i = lesser(larger(Index(std::floor(u)), Index(0)), f.counts(s, 0) - 4);
    const Index j = lesser(larger(Index(std::floor(v)), Index(0)), f.counts(s, 1) - 4);
    const Index first = f.functions(s, 0) + i * f.counts(s, 1) + j, b = f.owner(s, 1);
    const FourValues A = cubic(u - double(i)), B = cubic(v - double(j));
    const FourValues dA = cubic_rates(u - double(i)), dB = cubic_rates(v - double(j));
    const Index m = model.elastic(b, 0);
    const CVec q = y.slice(model.elastic(b, 1), model.elastic(b, 1) + m), rates = work.modal[b].slice(3, 3 + m);
    const Mat weights = found.weights[p];
    found.first[p] = first;
    Outward e{0.0, 0.0, 0.0, 0.0};
    for (Index k = 0; k < 4; ++k)
        for (Index l = 0; l < 4; ++l) {
            const double N = A[k] * B[l], Ns = dA[k] * B[l] / ds, Nt = A[k] * dB[l] / dt;
            weights(0, 4 * k + l) = N, weights(1, 4 * k + l) = Ns, weights(2, 4 * k + l) = Nt;
            const CVec row = f.outward[first + k * f.counts(s, 1) + l].slice(0, m);
            const double moved = dot(row, q);
            e.value += N * moved, e.s += Ns * moved, e.t += Nt * moved, e.rate += N * dot(row, rates);
        }
    return e;
}

/* Set the gap of a point and its slope, without forces, and whether it may press. */
inline void place_point(const Model& model, const Work& work, CVec y, Index s, Index p) noexcept {
    const Surfaces& f = model.surfaces;
    const Pressing& found = work.pressing;
    const Vec3 v = set_carried(model, work, y, s, p);
    const Vec3 r = in_frame(model, work, s, three(found.arm[p][1])) - rotated(f.axes[s], three(f.origin[s]));
    if (f.owner(s, 1) == NONE) {
        place_on_ground(model, work, s, p, r, v);
        return;
    }
    const double x0 = (r.x - f.low(s, 0)) / f.step(s, 0), x1 = (r.y - f.low(s, 1)) / f.step(s, 1);
    const Index cell0 = interval(x0, f.cells(s, 0)), cell1 = interval(x1, f.cells(s, 1));
    if (cell0 < 0 || cell1 < 0 || !f.cover[f.cells(s, 3) + cell0 * f.cells(s, 1) + cell1]) return;
    const Height H = height_at(f, s, cell0, cell1, x0, x1);
    const double c = 1.0 / std::sqrt(1.0 + H.s * H.s + H.t * H.t), lift = r.z - H.value, deep = f.deep[s];
    const Vec3 normal = in_frame(model, work, s, rotated(work.turn[f.owner(s, 0)], three(f.normal[p])));
    if (c * (normal.z - normal.x * H.s - normal.y * H.t) > FACING || !(-deep < c * lift && c * lift < deep)) return;
    const double cube = c * c * c;
    const Outward e = set_outward(model, work, y, s, p, r.x, r.y);
    const Vec3 slope{-cube * (H.s * H.ss + H.t * H.st) * lift - c * H.s - e.s,
                     -cube * (H.s * H.st + H.t * H.tt) * lift - c * H.t - e.t, c};
    put(found.slope[p], slope);
    found.gap[p] = c * lift - e.value;
    found.near[p] = 1;
    const Vec touch = work.touch[first_section(model) + p];
    touch[Touch::OVER] = 1.0, touch[Touch::DEPTH] = -found.gap[p];
    touch[Touch::RATE] = e.rate - dot(slope, in_frame(model, work, s, v));
    put(touch, v, Touch::APART);
}

/* Set friction of a point with a cone across a normal, the second axis along the axis of a bore. */
inline void set_surface_cone(const Model& model, const Work& work, Index s, Index i, Vec3 v, Vec3 n) noexcept {
    const bool bore = model.surfaces.radius[s] > 0.0;
    const Vec3 c = from_frame(model, work, s, bore ? Vec3{0.0, 0.0, 1.0} : Vec3{0.0, 1.0, 0.0});
    const Vec3 across = c - dot(c, n) * n, w = 1.0 / length(across) * across;
    set_cone(model, work, i, v, cross(w, n), w);
}

/* The slope dg/d(s, t, h) of a point, with what forces add to it. */
inline Vec3 slope_of(const Model& model, const Work& work, Index s, Index p) noexcept {
    const Surfaces& f = model.surfaces;
    const Pressing& found = work.pressing;
    Vec3 slope = three(found.slope[p]);
    if (!f.by_law[s]) {
        slope.x += over(work, p, 1, f.counts(s, 1), found.dents);
        slope.y += over(work, p, 2, f.counts(s, 1), found.dents);
    }
    if (f.radius[s] > 0.0) {  /* By R the point is beside its place, where a bore has another normal. */
        const Vec3 u = in_frame(model, work, s, rotated(work.turn[f.owner(s, 0)], three(found.moved[p])));
        const double less = (u.x * slope.y - u.y * slope.x) / (f.radius[s] - found.gap[p]);
        slope = {slope.x - less * slope.y, slope.y + less * slope.x, slope.z};
    }
    return slope;
}

/* Set the direction of a point's force, and its friction. */
inline void direct_force(const Model& model, const Work& work, Index s, Index p, Index i) noexcept {
    const Pressing& found = work.pressing;
    const Vec touch = work.touch[i];
    const CVec friction = model.touch_friction[i];
    const Vec3 slope = slope_of(model, work, s, p), d = from_frame(model, work, s, slope);
    const double size = length(slope);
    touch[Touch::FORCE] = found.force[p] * size;
    const Vec3 n = -1.0 / size * d, velocity = three(touch, Touch::APART), v = velocity - dot(velocity, n) * n;
    put(found.direction[p], d);
    put(touch, n, Touch::NORMAL);
    if (friction[2] > 0.0) {
        set_surface_cone(model, work, s, i, v, n);
        return;
    }
    const double square = dot(v, v);
    touch[Touch::SLIDING] = std::sqrt(square);
    const double drag = -touch[Touch::FORCE] * friction[0] / std::sqrt(square + friction[1] * friction[1]);
    put(touch, drag * v, Touch::DRAG);
}

/* Set forces, their directions and friction; gaps of points that do not press include what the others press in. */
inline void settle(const Model& model, const Work& work, Index first, Index count) noexcept {
    const Surfaces& f = model.surfaces;
    const Pressing& found = work.pressing;
    Index a = 0;
    for (Index s = 0; s < f.owner.size(); ++s) {
        if (!found.live[s]) continue;
        for (Index p = f.points(s, 0); p < f.points(s, 1); ++p) {
            if (!found.near[p]) continue;
            const Index i = first + p;
            const Vec touch = work.touch[i];
            if (f.by_law[s]) {
                if (work.touching[i]) {
                    const double depth = touch[Touch::DEPTH] + work.shift[i];
                    const Force law = law_force(model.touch_law[i], depth, touch[Touch::RATE], work.approach[i]);
                    found.force[p] = touch[Touch::LAW] = law.force;
                }
            } else if (work.touching[i]) {
                const Vec row = found.matrix[a].slice(0, a + 1);
                touch[Touch::DEPTH] = dot(row, row) * found.force[p];
                ++a;
            } else {
                touch[Touch::DEPTH] = -found.gap[p] - forced_out(model, work, s, p, count);
            }
            if (found.force[p] != 0.0 || (work.touching[i] && model.touch_friction(i, 2) > 0.0))
                direct_force(model, work, s, p, i);
        }
    }
}

/* Set what all points do in a state whose poses are set. */
inline void set_pressing(const Model& model, const Work& work, CVec y) noexcept {
    const Surfaces& f = model.surfaces;
    const Pressing& found = work.pressing;
    const Index first = first_section(model);
    for (Index s = 0; s < f.owner.size(); ++s) {
        const double apart = apart_of(model, work, y, s);
        found.live[s] = apart <= 0.0;
        for (Index p = f.points(s, 0); p < f.points(s, 1); ++p) {
            const Vec touch = work.touch[first + p];
            found.near[p] = 0;
            found.force[p] = 0.0;
            touch[Touch::DEPTH] = -f.deep[s] - (apart > 0.0 ? apart : 0.0);
            fill(touch.slice(Touch::RATE, Touch::ARM), 0.0);
            fill(touch.slice(Touch::LAW, Touch::STRETCH), 0.0);
            touch[Touch::OVER] = 0.0;
            if (found.live[s]) place_point(model, work, y, s, p);
        }
    }
    if (!f.owner.size()) return;
    const Index count = set_forces(model, work, first);
    set_dents(model, work, count);
    settle(model, work, first, count);
}

/* Add a force on a point, and its opposite on the other body, to modes of which its part across it acts. */
inline void push_point(const Model& model, const Work& work, Index s, Index p, Vec3 total) noexcept {
    const Surfaces& f = model.surfaces;
    const Pressing& found = work.pressing;
    const Index a = f.owner(s, 0), b = f.owner(s, 1);
    for (Index side = 0; side < (b == NONE ? 1 : 2); ++side) {
        const Vec push = work.push[f.owner(s, side)];
        const double sign = side ? -1.0 : 1.0;
        const Vec3 moment = cross(three(found.arm[p][side]), total);
        for (Index k = 0; k < 3; ++k) push[k] += sign * total[k], push[3 + k] += sign * moment[k];
    }
    const CMat rows = f.rows[p];
    const Vec3 inner = rotated_back(work.turn[a], total);
    const Vec push = work.push[a];
    for (Index k = 0; k < model.elastic(a, 0); ++k)
        push[6 + k] += rows(0, k) * inner.x + rows(1, k) * inner.y + rows(2, k) * inner.z;
    if (b == NONE) {
        const Vec3 twist = rotated(work.turn[a], cross(three(found.moved[p]), three(found.inward[p])));
        for (Index k = 0; k < 3; ++k) push[3 + k] += found.force[p] * twist[k];
        return;
    }
    const Vec onto = work.push[b];
    for (Index k = 0; k < model.elastic(b, 0); ++k)
        onto[6 + k] -= found.force[p] * over(work, p, 0, f.counts(s, 1), [&](Index i) { return f.outward(i, k); });
}

/* Add the forces of all points on both bodies, and the rates of what laws and friction dissipate. */
inline void press_surfaces(const Model& model, const Work& work, Vec sums) noexcept {
    const Surfaces& f = model.surfaces;
    const Pressing& found = work.pressing;
    const Index first = first_section(model);
    for (Index s = 0; s < f.owner.size(); ++s) {
        if (!found.live[s]) continue;
        for (Index p = f.points(s, 0); p < f.points(s, 1); ++p) {
            const Index i = first + p;
            const Vec touch = work.touch[i];
            const double force = found.force[p];
            if (f.by_law[s]) sums[LOST] += law_loss(model, work, i);
            if (force == 0.0) continue;
            push_point(model, work, s, p, force * three(found.direction[p]) + three(touch, Touch::DRAG));
            sums[WORK] += belt_power(model, work, i);
            sums[LOST] += friction_loss(model, work, i);
        }
    }
}

}  // namespace gudgeon::turning
