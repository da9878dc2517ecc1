/* Terms of joints between two markers, with their rates, and constraint rows, sums of one or two terms.
 *
 * d = p_b - p_a is the vector between the markers, u_i an axis of a, w_k one of b. A rate is G (v_a, w_a, v_b, w_b),
 * and the second rate G (accelerations) plus what `bend` has.
 */
#pragma once
#include <numbers>

#include "inertia.hpp"
#include "markers.hpp"
#include "rotation.hpp"

namespace gudgeon::turning {

/* Set force and moment per unit of a term on one of its markers. */
inline void put_wrench(Vec target, Vec3 force, Vec3 moment) noexcept {
    put(target, force);
    put(target, moment, 3);
}

/* Set a term that depends on d: along an axis of a, or its length. */
inline void set_translation(const Model& model, const Work& work, Index t) noexcept {
    const Index a = 2 * model.terms(t, 1), b = a + 1;
    const Vec3 d = three(work.place[b]) - three(work.place[a]);
    const Vec3 rate = three(work.speed[b]) - three(work.speed[a]);
    const Vec3 bend = three(work.drift[b]) - three(work.drift[a]);
    const Mat G = work.slope[t];
    if (model.terms(t, 0) == ALONG) {
        const Vec3 n = column(work.axes[a], model.terms(t, 2)), wa = three(work.spin[a]);
        const Vec3 turning = cross(wa, n), moment = cross(n, d);
        work.value[t] = dot(n, d);
        work.bend[t] = dot(n, bend) + 2 * dot(turning, rate) + dot(cross(wa, turning), d) +
                       dot(three(work.spin_drift[a]), moment);
        put_wrench(G[0], -n, moment);
        put_wrench(G[1], n, {});
        return;
    }
    const double size = length(d), over = size > 0.0 ? 1.0 / size : NOT_A_NUMBER;
    const Vec3 n = over * d;
    const double along = dot(n, rate);
    work.value[t] = size;
    work.bend[t] = dot(n, bend) + (dot(rate, rate) - along * along) * over;
    put_wrench(G[0], -n, {});
    put_wrench(G[1], n, {});
}

/* Set a term of the axes of both markers: the scalar product of two, or the angle about the third axis of a. */
inline void set_rotation(const Model& model, const Work& work, Index t) noexcept {
    const Index a = 2 * model.terms(t, 1), b = a + 1;
    const Vec3 wa = three(work.spin[a]), wb = three(work.spin[b]);
    const Vec3 apart = three(work.spin_drift[b]) - three(work.spin_drift[a]);
    const Mat G = work.slope[t];
    if (model.terms(t, 0) == SQUARE) {
        const Vec3 n = column(work.axes[a], model.terms(t, 2)), w = column(work.axes[b], model.terms(t, 3));
        const Vec3 nn = cross(wa, n), ww = cross(wb, w), across = cross(n, w);
        work.value[t] = dot(n, w);
        work.bend[t] = dot(cross(wa, nn), w) + 2 * dot(nn, ww) + dot(n, cross(wb, ww)) - dot(apart, across);
        put_wrench(G[0], {}, across);
        put_wrench(G[1], {}, -across);
        return;
    }
    const Vec3 n = column(work.axes[a], 2), w = column(work.axes[b], 0);
    const double angle = std::atan2(dot(w, column(work.axes[a], 1)), dot(w, column(work.axes[a], 0)));
    constexpr double full = 2 * std::numbers::pi;
    work.value[t] = angle + full * std::nearbyint((work.turned[t] - angle) / full);
    work.bend[t] = dot(cross(wa, n), wb - wa) + dot(n, apart);
    put_wrench(G[0], {}, -n);
    put_wrench(G[1], {}, n);
}

/* Set the inverse of the inertia of a body along the scene's axes, Q I^-1 Q^T. */
inline void set_back(const Model& model, const Work& work, Index b) noexcept {
    const Mat Q = work.turn[b], back = work.back[b];
    const CMat I = model.inverse[b];
    for (Index i = 0; i < 3; ++i) {
        const Vec3 row = rotated_back(I, three(Q[i]));
        for (Index j = 0; j <= i; ++j) back(i, j) = back(j, i) = dot(row, three(Q[j]));
    }
}

/* Set rotation matrices, angular velocities, inverses of the inertia along the scene's axes, and all points; driven
 * ones stand where they stood last. */
inline void set_poses(const Model& model, const Work& work, CVec y) noexcept {
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Index s = WIDTH * b;
        matrix_of(y.slice(s + TURN, s + TURN + 4), work.turn[b]);
        set_back(model, work, b);
        put(work.omega[b], rotated(work.back[b], three(y, s + SPIN)));
        if (model.elastic(b, 0)) set_flexible(model, work, y, b);
    }
    set_points(model, work, y);
}

/* Set all of `set_poses`, and driven points, with drives (d, 3) of a time. */
inline void set_poses_at(const Model& model, const Work& work, CVec y, CMat given) noexcept {
    for (Index i = 0; i < given.size(); ++i) copy(given[i], work.given[i]);
    set_poses(model, work, y);
}

/* Set the values, slopes and bends of all terms, and the blocks of all rows; poses are set. */
inline void set_blocks(const Model& model, const Work& work) noexcept {
    for (Index t = 0; t < model.terms.size(); ++t) {
        if (model.terms(t, 0) == ALONG || model.terms(t, 0) == DISTANCE)
            set_translation(model, work, t);
        else
            set_rotation(model, work, t);
    }
    for (Index i = 0; i < model.row_terms.size(); ++i)
        for (Index part = 0; part < 2; ++part) {
            const Index t = model.row_terms(i, part);
            for (Index side = 0; side < 2; ++side) {
                const Index b = t == NONE ? NONE : model.owner(model.terms(t, 1), side);
                work.block_owner(i, 2 * part + side) = b;
                if (b == NONE) continue;
                const Vec block = work.block[i][2 * part + side];
                for (Index k = 0; k < 6 + model.elastic(b, 0); ++k) block[k] = 0.0;
                const Wrench slope = wrench_of(work.slope[t][side]);
                spread(model, work, 2 * model.terms(t, 1) + side, slope, model.factors(i, part), block);
            }
        }
}

/* Set all of `set_blocks`, and what `set_matrix` multiplies blocks with: they times the inverse of the inertia, or, of
 * bodies that deform, of its factor; poses are set. */
inline void set_rows(const Model& model, const Work& work) noexcept {
    set_blocks(model, work);
    for (Index i = 0; i < model.row_terms.size(); ++i)
        for (Index p = 0; p < 4; ++p) {
            const Index b = work.block_owner(i, p);
            if (b == NONE) continue;
            const Vec block = work.block[i][p], light = work.light[i][p];
            const Index m = model.elastic(b, 0);
            const double over = m ? 1.0 / std::sqrt(model.mass[b]) : 1.0 / model.mass[b];
            for (Index k = 0; k < 3; ++k) light[k] = over * block[k];
            if (!m) {
                put(light, rotated(work.back[b], three(block, 3)), 3);
                continue;
            }
            for (Index k = 3; k < 6 + m; ++k) light[k] = block[k];
            solve_factor(model, work, b, light.slice(3, 6 + m));
        }
}

/* Set S = G M^-1 G^T; rows are set. */
inline void set_matrix(const Model& model, const Work& work) noexcept {
    const Mat S = work.matrix;
    const CIntMat pairs = model.pairs;
    for (Index pair = 0; pair < pairs.size(); ++pair) { /* All others are zero always. */
        const Index i = pairs(pair, 0), j = pairs(pair, 1);
        S(i, j) = S(j, i) = 0.0;
    }
    for (Index pair = 0; pair < pairs.size(); ++pair) {
        const Index i = pairs(pair, 0), j = pairs(pair, 1), p = pairs(pair, 2), q = pairs(pair, 3);
        const Index width = 6 + model.elastic(work.block_owner(i, p), 0);
        const double total = row_product(width > 6 ? work.light[i][p] : work.block[i][p], work.light[j][q], width);
        S(i, j) += total;
        if (i != j) S(j, i) += total;
    }
}

/* What a row lacks: its value less its constant and the first of its drive in `given`, (d, 3). */
inline double violation(const Model& model, const Work& work, CMat given, Index i) noexcept {
    double lack = -model.constant[i];
    for (Index part = 0; part < 2; ++part)
        if (model.row_terms(i, part) != NONE) lack += model.factors(i, part) * work.value[model.row_terms(i, part)];
    if (model.drive_of[i] != NONE) lack -= given(model.drive_of[i], 0);
    return lack;
}

/* The rate that bodies have to give a row: that of its drive, less what driven points give. */
inline double rate_asked(const Model& model, const Work& work, CMat given, Index i) noexcept {
    double rate = model.drive_of[i] != NONE ? given(model.drive_of[i], 1) : 0.0;
    for (Index part = 0; part < 2; ++part) {
        const Index t = model.row_terms(i, part);
        if (t == NONE) continue;
        for (Index side = 0; side < 2; ++side) {
            const Index p = 2 * model.terms(t, 1) + side;
            if (model.point_drive[p] != NONE)
                rate -= model.factors(i, part) * dot(three(work.slope[t][side]), three(work.speed[p]));
        }
    }
    return rate;
}

}  // namespace gudgeon::turning
