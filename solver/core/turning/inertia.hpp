/* Inertia of bodies that deform: angular velocity and modal rates from momenta, and back.
 *
 * Along the axes of the body, l = I w + H q' and eta = H^T w + M q', with I = tr J 1 - J and H_k the vector of B_k:
 *
 *   l' = moment of all forces,  eta'_k = dT/dq_k - stiffness q_k - damping q'_k + modal forces,
 *   dT/dq_k = |w|^2 tr B_k - w B_k w - w . vector of B'_k,  B'_k = sum_l q'_l (G_lk - K_lk / 2).
 *
 * Of B_k the symmetric part and the vector are used, nine numbers in the order of `MOMENTS`. M does not change, and is
 * 1 of shapes that have no momenta at rest. With M = L L^T and W = H L^-T the inertia is factored as
 *
 *   M = L L^T,  I - W W^T = R R^T, (3, 3),
 *
 * so that it takes a number of products that grows with m, or with its square where L is no diagonal.
 */
#pragma once
#include "arrays.hpp"
#include "vectors.hpp"

namespace gudgeon::turning {

/* Add to the first `rows` of parts of moments, from row `target` on, sum_l of those of k for l, from `part` on, times
 * values, which begin at `first`. Four l at a time: the sums are read as often as they. */
inline void add_pairs(const Model& model, Index b, CVec values, Index first, Index part, Mat target) noexcept {
    const Index m = model.elastic(b, 0), blocked = m - m % 4, rows = target.size();
    const CCube pair = model.pair[b];
    for (Index l = 0; l < blocked; l += 4) {
        const CMat P = pair[l], R = pair[l + 1], S = pair[l + 2], T = pair[l + 3];
        const double p = values[first + l], r = values[first + l + 1], s = values[first + l + 2];
        const double t = values[first + l + 3];
        for (Index c = 0; c < rows; ++c) {
            const Vec sum = target[c];
            const CVec Pc = P[part + c], Rc = R[part + c], Sc = S[part + c], Tc = T[part + c];
            SIMD
            for (Index k = 0; k < m; ++k) sum[k] += p * Pc[k] + r * Rc[k] + s * Sc[k] + t * Tc[k];
        }
    }
    for (Index l = blocked; l < m; ++l) {
        const CMat P = pair[l];
        const double p = values[first + l];
        for (Index c = 0; c < rows; ++c) {
            const Vec sum = target[c];
            const CVec Pc = P[part + c];
            SIMD
            for (Index k = 0; k < m; ++k) sum[k] += p * Pc[k];
        }
    }
}

/* Set R, the root of I - W W^T. */
inline void factor_inertia(const Work& work, Index b, Index m) noexcept {
    const Vec J = work.second[b];
    const Mat W = work.coupling[b], R = work.root[b];
    R(0, 0) = J[1] + J[2], R(1, 1) = J[2] + J[0], R(2, 2) = J[0] + J[1];
    R(2, 1) = -0.5 * J[3], R(2, 0) = -0.5 * J[4], R(1, 0) = -0.5 * J[5];
    for (Index i = 0; i < 3; ++i)
        for (Index j = 0; j <= i; ++j) {
            double total = R(i, j);
            const Vec Wi = W[i], Wj = W[j];
            SIMD_SUM(total)
            for (Index k = 0; k < m; ++k) total -= Wi[k] * Wj[k];
            for (Index k = 0; k < j; ++k) total -= R(i, k) * R(j, k);
            /* The root of a negative number is NaN, which ends the step. */
            R(i, j) = i > j ? total / R(j, j) : std::sqrt(total);
        }
}

/* Replace modal forces, from the place `first` on, by L^-1 times them. */
inline void solve_lower(const Model& model, Index b, Vec values, Index first) noexcept {
    const CMat L = model.modal_root[b];
    const Index m = model.elastic(b, 0);
    if (model.orthogonal[b]) {
        for (Index k = 0; k < m; ++k) values[first + k] /= L(k, k);
        return;
    }
    for (Index i = 0; i < m; ++i) {
        double total = values[first + i];
        SIMD_SUM(total)
        for (Index k = 0; k < i; ++k) total -= L(i, k) * values[first + k];
        values[first + i] = total / L(i, i);
    }
}

/* Replace numbers, from the place `first` on, by L^-T times them. */
inline void solve_upper(const Model& model, Index b, Vec values, Index first) noexcept {
    const CMat L = model.modal_root[b];
    const Index m = model.elastic(b, 0);
    if (model.orthogonal[b]) {
        for (Index k = 0; k < m; ++k) values[first + k] /= L(k, k);
        return;
    }
    for (Index i = m - 1; i >= 0; --i) {
        values[first + i] /= L(i, i);
        const double value = values[first + i];
        SIMD
        for (Index k = 0; k < i; ++k) values[first + k] -= L(i, k) * value;
    }
}

/* Set B and the factor of the inertia of a body over its rotation and elastic coordinates, along its own axes. */
inline void set_moments(const Model& model, const Work& work, CVec y, Index b) noexcept {
    const Index m = model.elastic(b, 0), first = model.elastic(b, 1);
    const Mat B = work.moment[b];
    const CMat S = model.lever[b];
    for (Index c = 0; c < CURL + 3; ++c) {
        const Vec Bc = B[c];
        const CVec Sc = S[c];
        for (Index k = 0; k < m; ++k) Bc[k] = Sc[k];
    }
    add_pairs(model, b, y, first, 0, B);
    const Vec J = work.second[b];
    for (Index c = 0; c < CURL; ++c) {
        double total = model.second(b, c);
        const Vec Bc = B[c];
        const CVec Sc = S[c];
        SIMD_SUM(total)
        for (Index k = 0; k < m; ++k) total += y[first + k] * (Sc[k] + Bc[k]);
        J[c] = total;
    }
    const Mat W = work.coupling[b];
    for (Index c = 0; c < 3; ++c) {
        const Vec Wc = W[c], Bc = B[CURL + c];
        for (Index k = 0; k < m; ++k) Wc[k] = Bc[k];
        solve_lower(model, b, Wc, 0);
    }
    factor_inertia(work, b, m);
}

/* Replace a moment along the scene's axes and modal forces, (3 + m,), by N^-1 times them, N the factor of the inertia:
 * products of two of these are those of one with the inverse of the inertia times the other. */
inline void solve_factor(const Model& model, const Work& work, Index b, Vec values) noexcept {
    const Mat Q = work.turn[b], R = work.root[b];
    const Vec W0 = work.coupling[b][0], W1 = work.coupling[b][1], W2 = work.coupling[b][2];
    const Index m = model.elastic(b, 0);
    solve_lower(model, b, values, 3);
    const Vec3 moment = rotated_back(Q, three(values));
    double u = moment.x, v = moment.y, w = moment.z;
    SIMD_SUM(u, v, w)
    for (Index k = 0; k < m; ++k) {
        u -= W0[k] * values[3 + k];
        v -= W1[k] * values[3 + k];
        w -= W2[k] * values[3 + k];
    }
    u /= R(0, 0);
    v = (v - R(1, 0) * u) / R(1, 1);
    w = (w - R(2, 0) * u - R(2, 1) * v) / R(2, 2);
    put(values, {u, v, w});
}

/* Replace a moment along the scene's axes and modal forces by angular acceleration and modal ones, (3 + m,). */
inline void solve_inertia(const Model& model, const Work& work, Index b, Vec values) noexcept {
    const Mat Q = work.turn[b], R = work.root[b];
    const Vec W0 = work.coupling[b][0], W1 = work.coupling[b][1], W2 = work.coupling[b][2];
    const Index m = model.elastic(b, 0);
    solve_factor(model, work, b, values);
    const double w = values[2] / R(2, 2), v = (values[1] - R(2, 1) * w) / R(1, 1);
    const double u = (values[0] - R(2, 0) * w - R(1, 0) * v) / R(0, 0);
    SIMD
    for (Index k = 0; k < m; ++k) values[3 + k] -= W0[k] * u + W1[k] * v + W2[k] * w;
    solve_upper(model, b, values, 3);
    put(values, rotated(Q, {u, v, w}));
}

/* Set angular velocity along the scene's axes, modal rates and modal forces of a body that deforms. */
inline void set_flexible(const Model& model, const Work& work, CVec y, Index b) noexcept {
    const Index m = model.elastic(b, 0), first = model.elastic(b, 1), momentum = model.elastic(b, 2);
    set_moments(model, work, y, b);
    const Vec rates = work.modal[b];
    for (Index i = 0; i < 3; ++i) rates[i] = y[WIDTH * b + SPIN + i];
    for (Index k = 0; k < m; ++k) rates[3 + k] = y[momentum + k];
    solve_inertia(model, work, b, rates);
    for (Index i = 0; i < 3; ++i) work.omega(b, i) = rates[i];
    const Mat D = work.moment_rate[b], B = work.moment[b];
    const auto [w0, w1, w2] = rotated_back(work.turn[b], three(rates));
    for (Index c = 0; c < 3; ++c)
        for (Index k = 0; k < m; ++k) D(c, k) = 0.0;
    add_pairs(model, b, rates, 3, CURL, D);
    const Vec xx = B[0], yy = B[1], zz = B[2], yz = B[3], zx = B[4], xy = B[5], D0 = D[0], D1 = D[1], D2 = D[2];
    const Vec across = work.across[b], inner = work.inner_force[b];
    const CVec stiffness = model.modal_stiffness[b], damping = model.modal_damping[b];
    for (Index k = 0; k < m; ++k) {
        double bent = (w1 * w1 + w2 * w2) * xx[k] + (w2 * w2 + w0 * w0) * yy[k] + (w0 * w0 + w1 * w1) * zz[k];
        bent -= w1 * w2 * yz[k] + w2 * w0 * zx[k] + w0 * w1 * xy[k];
        across[k] = w0 * D0[k] + w1 * D1[k] + w2 * D2[k];
        inner[k] = bent - across[k] - (stiffness[k] * y[first + k] + damping[k] * rates[3 + k]);
    }
}

/* Set angular and modal accelerations of a body under what presses on it, in `rate`. */
inline void set_flexible_rates(const Model& model, const Work& work, CVec y, Index b) noexcept {
    const Index m = model.elastic(b, 0);
    const Mat Q = work.turn[b], B = work.moment[b], D = work.moment_rate[b];
    const Vec3 omega = three(work.omega[b]);
    const Vec modal = work.modal[b];
    const auto along = [&](Vec values) noexcept { return dot(modal.slice(3, 3 + m), values.slice(0, m)); };
    const auto [w0, w1, w2] = rotated_back(Q, omega);
    /* What the inertia's own change takes, along the axes of the body. */
    const double xx = along(B[0]), yy = along(B[1]), zz = along(B[2]);
    const double yz = along(B[3]), zx = along(B[4]), xy = along(B[5]);
    const Vec3 change{2 * (yy + zz) * w0 - xy * w1 - zx * w2 + along(D[0]),
                      2 * (zz + xx) * w1 - xy * w0 - yz * w2 + along(D[1]),
                      2 * (xx + yy) * w2 - zx * w0 - yz * w1 + along(D[2])};
    const Vec3 lag = cross(omega, three(y, WIDTH * b + SPIN)), taken = rotated(Q, change);
    const Vec push = work.push[b], across = work.across[b], rate = work.rate[b].slice(3, 6 + m);
    for (Index i = 0; i < 3; ++i) rate[i] = push[3 + i] - lag[i] - taken[i];
    for (Index k = 0; k < m; ++k) rate[3 + k] = push[6 + k] - across[k];
    solve_inertia(model, work, b, rate);
}

}  // namespace gudgeon::turning
