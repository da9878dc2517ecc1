/* Bushings between bodies that turn.
 *
 * A bushing stands along the axes A of its point a on the other side, which turn with it. With d the way from a to its
 * point b, R = A^T B the rotation of b's axes from a's and theta its rotation vector, the motions are
 *
 *   x = (A^T d - rest, theta),  x' = (A^T (v_b - v_a - w_a x d), J^-1 A^T (w_b - w_a)),
 *
 * J^-1 = 1 - theta~/2 + c theta~^2, c = (1 - theta/2 cot theta/2)/theta^2. Of w = K x + C x' the body b gets the force
 * -A w_1 at its point and the moment -A J^-T w_2, and a what balances them: their power is -w . x', so that x^T K x / 2
 * is the energy at any rotation below a half turn. A field of charged conductors acts as a bushing does, with
 * w = -dG/dx of its co-energy G.
 */
#pragma once
#include "../fields/co_energy.hpp"
#include "markers.hpp"

namespace gudgeon::turning {

/* Rotation of a bushing below which c is its limit, 1/12, to round-off [rad]. */
inline constexpr double SMALL_ROTATION = 1e-4;

/* Set the rotation vector of b's axes from a's, x[3:]; returns the angle. */
inline double rotation_vector(const Work& work, Index a, Index b, Vec x) noexcept {
    const Mat A = work.axes[a], B = work.axes[b];
    double trace = 0.0;
    for (Index k = 0; k < 3; ++k)
        for (Index i = 0; i < 3; ++i) trace += A(i, k) * B(i, k);
    /* The vector of the antisymmetric part of R_ij = sum_k A_ki B_kj, 2 sin theta times the axis. */
    for (Index i = 0; i < 3; ++i) {
        const Index j = (i + 1) % 3, k = (i + 2) % 3;
        x[3 + i] = 0.5 * (dot(column(A, k), column(B, j)) - dot(column(A, j), column(B, k)));
    }
    const double sine = length(three(x, 3)), angle = std::atan2(sine, 0.5 * (trace - 1.0));
    const double factor = sine > SMALL_ROTATION ? angle / sine : 1.0 + sine * sine / 6.0;
    for (Index i = 0; i < 3; ++i) x[3 + i] *= factor;
    return angle;
}

/* J^-1 v, or J^-T v with a sign of -1. */
inline Vec3 turned_rate(Vec3 theta, double angle, Vec3 v, double sign) noexcept {
    const double half = 0.5 * angle;
    const double c = angle > SMALL_ROTATION ? (1.0 - half / std::tan(half)) / (angle * angle) : 1.0 / 12.0;
    const Vec3 once = cross(theta, v);
    return v - (sign * 0.5) * once + c * cross(theta, once);
}

/* Set motions and rates of all bushings, `Work.bush`, and force and moment on their bodies b, `Work.bush_push`; points
 * are set. */
inline void set_bushings(const Model& model, const Work& work) noexcept {
    const Index count = model.bush_rest.size(), first = model.point_owner.size() - 2 * count;
    for (Index i = 0; i < count; ++i) {
        const Index a = first + 2 * i, b = a + 1;
        const Vec x = work.bush[i], w = work.bush_push[i];
        const Mat A = work.axes[a];
        const Vec3 wa = three(work.spin[a]), wb = three(work.spin[b]);
        const Vec3 d = three(work.place[b]) - three(work.place[a]);
        const Vec3 v = three(work.speed[b]) - three(work.speed[a]) - cross(wa, d);
        const double angle = rotation_vector(work, a, b, x);
        const Vec3 theta = three(x, 3);
        put(x, rotated_back(A, d) - three(model.bush_rest[i]));
        put(x, rotated_back(A, v), 6);
        put(x, turned_rate(theta, angle, rotated_back(A, wb - wa), 1.0), 9);
        for (Index k = 0; k < 6; ++k) {
            double total = 0.0;
            for (Index l = 0; l < 6; ++l)
                total += model.bush_stiffness(i, k, l) * x[l] + model.bush_damping(i, k, l) * x[6 + l];
            w[k] = -total;
        }
        const Index n = model.bush_field[i];
        if (n != NONE) {
            evaluate(model.fields, n, x.slice(0, 6), work.field_basis, work.field[n]);
            for (Index k = 0; k < 6; ++k) w[k] = work.field(n, 1 + k);
        }
        put(w, rotated(A, three(w)));
        put(w, rotated(A, turned_rate(theta, angle, three(w, 3), -1.0)), 3);
    }
}

/* Set all bushings and add their forces on both bodies, and the rate of what they dissipate. */
inline void press_bushings(const Model& model, const Work& work, Vec sums) noexcept {
    set_bushings(model, work);
    const Index count = model.bush_rest.size(), first = model.point_owner.size() - 2 * count;
    for (Index i = 0; i < count; ++i) {
        const Index a = first + 2 * i, b = a + 1;
        const Wrench wrench = wrench_of(work.bush_push[i]);
        press(model, work, b, wrench, 1.0);
        const Vec3 d = three(work.place[b]) - three(work.place[a]);
        press(model, work, a, {wrench.force, wrench.moment + cross(d, wrench.force)}, -1.0);
        for (Index k = 0; k < 6; ++k)
            for (Index l = 0; l < 6; ++l)
                sums[LOST] += work.bush(i, 6 + k) * model.bush_damping(i, k, l) * work.bush(i, 6 + l);
    }
}

}  // namespace gudgeon::turning
