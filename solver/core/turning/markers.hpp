/* Points with axes on bodies and the ground: where they are, how they move, what acts there.
 *
 * A point of a body that deforms is at A (c + Psi q - 1/2 q^T K q) from the centre. Its axes turn, relative to the
 * frame, by theta = Psi' q - 1/2 q^T K' q, in Cayley's formula 1 + 2 (g~ + g~^2)/(1 + g^2) with g = theta/2, whose
 * angular velocity is (theta' + g x theta')/(1 + g^2).
 */
#pragma once
#include "arrays.hpp"
#include "vectors.hpp"

namespace gudgeon::turning {

/* Force and moment about a point, along the scene's axes. */
struct Wrench {
    Vec3 force, moment;
};

inline Wrench wrench_of(CVec six) noexcept { return {three(six), three(six, 3)}; }

/* Set what the second order adds to row i of a point, `curved`, and its rate, `moving`. Four coordinates at a time. */
inline void set_curved(const Model& model, const Work& work, CVec y, Index p, Index i, Index b) noexcept {
    const Index m = model.elastic(b, 0), first = model.elastic(b, 1), blocked = m - m % 4;
    const Vec rates = work.modal[b], curved = work.curved, moving = work.moving;
    const CMat bend = model.point_bend[p][i];
    for (Index k = 0; k < m; ++k) curved[k] = moving[k] = 0.0;
    for (Index l = 0; l < blocked; l += 4) {
        const CVec P = bend[l], R = bend[l + 1], S = bend[l + 2], T = bend[l + 3];
        const double p0 = y[first + l], r0 = y[first + l + 1], s0 = y[first + l + 2], t0 = y[first + l + 3];
        const double p1 = rates[3 + l], r1 = rates[4 + l], s1 = rates[5 + l], t1 = rates[6 + l];
        SIMD
        for (Index k = 0; k < m; ++k) {
            curved[k] += p0 * P[k] + r0 * R[k] + s0 * S[k] + t0 * T[k];
            moving[k] += p1 * P[k] + r1 * R[k] + s1 * S[k] + t1 * T[k];
        }
    }
    for (Index l = blocked; l < m; ++l) {
        const double q = y[first + l], rate = rates[3 + l];
        const CVec row = bend[l];
        SIMD
        for (Index k = 0; k < m; ++k) {
            curved[k] += q * row[k];
            moving[k] += rate * row[k];
        }
    }
}

/* Set displacement, rotation and their first and second rates of a point in its body, (3, 6), and its rows. */
inline void set_deformed(const Model& model, const Work& work, CVec y, Index p, Index b) noexcept {
    const Index m = model.elastic(b, 0), first = model.elastic(b, 1);
    const Vec rates = work.modal[b], curved = work.curved, moving = work.moving;
    const Mat local = work.local[p];
    for (Index k = 0; k < m; ++k) curved[k] = moving[k] = 0.0;
    for (Index i = 0; i < 6; ++i) {
        if (model.bends[p]) set_curved(model, work, y, p, i, b);
        const Vec rows = work.point_rows[p][i];
        const CVec shape = model.point_rows[p][i];
        double value = 0.0, speed = 0.0, second = 0.0;
        SIMD_SUM(value, speed, second)
        for (Index k = 0; k < m; ++k) {
            const double row = shape[k], rate = rates[3 + k];
            rows[k] = row - curved[k];
            value += (row - 0.5 * curved[k]) * y[first + k];
            speed += (row - curved[k]) * rate;
            second -= moving[k] * rate;
        }
        local(0, i) = value, local(1, i) = speed, local(2, i) = second;
    }
}

/* Set a point of the ground, which stays or is driven. */
inline void set_ground(const Model& model, const Work& work, Index p) noexcept {
    const Index first = model.point_drive[p];
    const CVec c = model.point_arm[p];
    const CMat F = model.point_frame[p];
    for (Index i = 0; i < 3; ++i) {
        work.place(p, i) = c[i];
        work.arm(p, i) = work.speed(p, i) = work.drift(p, i) = work.spin(p, i) = work.spin_drift(p, i) = 0.0;
        if (first != NONE) {
            const Vec way = work.given[first + i];
            work.place(p, i) += way[0];
            work.speed(p, i) = way[1], work.drift(p, i) = way[2];
        }
        for (Index j = 0; j < 3; ++j) work.axes(p, i, j) = F(i, j);
    }
}

/* (theta' + g x theta')/(1 + g^2), g = theta/2. */
inline Vec3 by_cayley(Vec3 theta, Vec3 rate) noexcept {
    const Vec3 g = 0.5 * theta;
    return 1.0 / (1.0 + dot(g, g)) * (rate + cross(g, rate));
}

/* Set axes and angular velocity of a point of a body that deforms, and the latter's rate without accelerations. */
inline void set_axes(const Work& work, Index p, CMat Q, CMat F, Vec3 omega) noexcept {
    const Mat local = work.local[p];
    const Vec3 theta = three(local[0], 3), rate = three(local[1], 3), second = three(local[2], 3);
    const Vec3 g = 0.5 * theta;
    const double size = 1.0 + dot(g, g);
    const Vec3 bent = by_cayley(theta, rate);
    const double change = -dot(g, rate) / size;
    const Vec3 relative = rotated(Q, bent);
    const Vec3 drift = rotated(Q, by_cayley(theta, second) + change * bent);
    put(work.spin[p], omega + relative);
    put(work.spin_drift[p], cross(omega, relative) + drift);
    for (Index j = 0; j < 3; ++j) {
        const Vec3 v = column(F, j), once = cross(g, v), twice = cross(g, once);
        put_column(work.axes[p], j, rotated(Q, v + 2.0 / size * (once + twice)));
    }
}

/* Replace three rows of a point, from `first` on, by a matrix of these columns times them. */
inline void turn_rows(Mat rows, Index first, Vec3 a, Vec3 b, Vec3 c, Index m) noexcept {
    double *x = rows[first].data, *y = rows[first + 1].data, *z = rows[first + 2].data;
    SIMD
    for (Index k = 0; k < m; ++k) {
        const double u = x[k], v = y[k], w = z[k];
        x[k] = a.x * u + b.x * v + c.x * w;
        y[k] = a.y * u + b.y * v + c.y * w;
        z[k] = a.z * u + b.z * v + c.z * w;
    }
}

/* Set a point of a body that deforms; returns its arm. */
inline Vec3 set_flexible_point(const Model& model, const Work& work, CVec y, Index p, Index b, Vec3 omega,
                               Vec3& moved, Vec3& drift) noexcept {
    const Mat Q = work.turn[b], local = work.local[p], rows = work.point_rows[p];
    set_deformed(model, work, y, p, b);
    const Vec3 r = rotated(Q, three(model.point_arm[p]) + three(local[0]));
    const Vec3 relative = rotated(Q, three(local[1])), turned = cross(omega, r);
    moved = turned + relative;
    drift = cross(omega, turned) + 2 * cross(omega, relative) + rotated(Q, three(local[2]));
    set_axes(work, p, Q, model.point_frame[p], omega);
    const Vec3 theta = three(local[0], 3);
    const Vec3 c0 = rotated(Q, by_cayley(theta, {1, 0, 0})), c1 = rotated(Q, by_cayley(theta, {0, 1, 0}));
    const Vec3 c2 = rotated(Q, by_cayley(theta, {0, 0, 1}));
    turn_rows(rows, 0, column(Q, 0), column(Q, 1), column(Q, 2), model.elastic(b, 0));
    turn_rows(rows, 3, c0, c1, c2, model.elastic(b, 0));
    return r;
}

/* Set place, arm, velocity, axes and angular velocity of all points, and what of their second rates is without
 * accelerations; poses are set. */
inline void set_points(const Model& model, const Work& work, CVec y) noexcept {
    for (Index p = 0; p < model.point_owner.size(); ++p) {
        const Index b = model.point_owner[p];
        if (b == NONE) {
            set_ground(model, work, p);
            continue;
        }
        const Vec3 omega = three(work.omega[b]);
        Vec3 r, moved, drift;
        if (model.elastic(b, 0) == 0) {
            const Mat Q = work.turn[b];
            const CMat F = model.point_frame[p];
            r = rotated(Q, three(model.point_arm[p]));
            moved = cross(omega, r);
            drift = cross(omega, moved);
            for (Index j = 0; j < 3; ++j) put_column(work.axes[p], j, rotated(Q, column(F, j)));
            put(work.spin[p], omega);
            put(work.spin_drift[p], {});
        } else {
            r = set_flexible_point(model, work, y, p, b, omega, moved, drift);
        }
        put(work.arm[p], r);
        put(work.place[p], three(y, WIDTH * b + PLACE) + r);
        put(work.speed[p], three(y, WIDTH * b + SPEED) + moved);
        put(work.drift[p], drift);
    }
}

/* Add factor times force and moment at a point to force, moment about the centre and modal forces on its body,
 * (6 + m,). */
inline void spread(const Model& model, const Work& work, Index p, const Wrench& wrench, double factor,
                   Vec target) noexcept {
    const Index b = model.point_owner[p];
    if (b == NONE) return;
    const auto& [force, moment] = wrench;
    const Vec3 lever = cross(three(work.arm[p]), force);
    for (Index i = 0; i < 3; ++i) {
        target[i] += factor * force[i];
        target[3 + i] += factor * (lever[i] + moment[i]);
    }
    const Index m = model.elastic(b, 0);
    if (!m) return;
    const Mat rows = work.point_rows[p];
    const Vec r0 = rows[0], r1 = rows[1], r2 = rows[2], r3 = rows[3], r4 = rows[4], r5 = rows[5];
    SIMD
    for (Index k = 0; k < m; ++k)
        target[6 + k] += factor * (r0[k] * force.x + r3[k] * moment.x + r1[k] * force.y + r4[k] * moment.y +
                                   r2[k] * force.z + r5[k] * moment.z);
}

/* Add factor times force and moment at a point to what acts on its body. */
inline void press(const Model& model, const Work& work, Index p, const Wrench& wrench, double factor) noexcept {
    const Index b = model.point_owner[p];
    if (b != NONE) spread(model, work, p, wrench, factor, work.push[b]);
}

}  // namespace gudgeon::turning
