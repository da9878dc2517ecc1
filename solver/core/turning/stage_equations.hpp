/* The linear systems of Newton's method in an implicit step.
 *
 * The stiff part of the equations is linear: modal stiffness K and damping D, diagonal, and the rows G of the joints.
 * For each eigenvalue lambda of A^-1 with g = h/lambda changes of velocities w and of multipliers mu/g follow from
 *
 *   (M + g D + g^2 K) w - G^T mu = g r_p - g^2 K r_u,  G w = r_c,
 *
 * r_u, r_p and r_c the residuals of places, momenta and rows; places change by g (r_u + w). Pose, M and G are those at
 * the start of the step. A body takes a diagonal and a 3 x 3 matrix for its rotation, the joints a factor of
 * G (M + g D + g^2 K)^-1 G^T in the order, within the envelope, and by the rank that S has.
 */
#pragma once
#include "step_arrays.hpp"

namespace gudgeon::turning {

/* Keep pose, inertia, rows and their order at the start of a step; its rates are set. */
inline void keep_start(const Model& model, const Work& work, const Newton& newton) noexcept {
    for (Index b = 0; b < model.mass.size(); ++b) {
        const CVec J = work.second[b];
        const Mat I = newton.inertia[b];
        for (Index i = 0; i < 3; ++i) copy(work.turn[b][i], newton.turn[b][i]);
        if (model.elastic(b, 0)) {
            I(0, 0) = J[1] + J[2], I(1, 1) = J[2] + J[0], I(2, 2) = J[0] + J[1];
            I(1, 2) = I(2, 1) = -0.5 * J[3];
            I(0, 2) = I(2, 0) = -0.5 * J[4];
            I(0, 1) = I(1, 0) = -0.5 * J[5];
        } else {
            for (Index i = 0; i < 3; ++i) copy(model.inertia[b][i], I[i]);
        }
        for (Index c = 0; c < 3; ++c)
            for (Index k = 0; k < model.elastic(b, 0); ++k) newton.coupling(b, c, k) = work.moment(b, CURL + c, k);
    }
    const Index rows = model.row_terms.size();
    newton.rank[0] = rows ? work.rank[0] : 0;
    newton.parts[0] = 0;
    fill(newton.place, NONE);
    for (Index i = 0; i < newton.rank[0]; ++i) {
        newton.rows[i] = work.order[i], newton.first[i] = work.begin[i], newton.end[i] = work.end[i];
        newton.place[work.order[i]] = i;
    }
    for (Index i = 0; i < rows; ++i)
        for (Index p = 0; p < 4; ++p) {
            const Index b = newton.owner(i, p) = work.block_owner(i, p);
            if (b == NONE) continue;
            for (Index k = 0; k < 6 + model.elastic(b, 0); ++k) newton.block(i, p, k) = work.block(i, p, k);
        }
    for (Index i = 0; i < newton.rank[0]; ++i)
        for (Index p = 0; p < 4; ++p) {
            const Index row = newton.rows[i], b = newton.owner(row, p);
            if (b == NONE) continue;
            const Ints part = newton.part[newton.parts[0]++];
            part[0] = row, part[1] = p, part[2] = b;
        }
}

/* Replace a symmetric 3 x 3 matrix by its inverse, by cofactors. */
inline void invert_symmetric(Complexes<2> C) noexcept {
    const Complex u = C(0, 0), v = C(1, 1), w = C(2, 2), x = C(1, 2), y = C(0, 2), z = C(0, 1);
    const Complex uu = v * w - x * x, vv = u * w - y * y, ww = u * v - z * z;
    const Complex xx = y * z - u * x, yy = x * z - v * y, zz = x * y - w * z;
    const Complex over = 1.0 / (u * uu + z * zz + y * yy);
    C(0, 0) = uu * over, C(1, 1) = vv * over, C(2, 2) = ww * over;
    C(1, 2) = C(2, 1) = xx * over;
    C(0, 2) = C(2, 0) = yy * over;
    C(0, 1) = C(1, 0) = zz * over;
}

/* Set the inverse of I - H (1 + g D + g^2 K)^-1 H^T of a body, and the diagonal of the latter. */
inline void set_core(const Model& model, const Newton& newton, Index b, Index k, Complex g) noexcept {
    const Complexes<1> a = newton.back[k][b];
    const Complexes<2> C = newton.core[k][b];
    const Mat H = newton.coupling[b];
    const Index m = model.elastic(b, 0);
    for (Index l = 0; l < m; ++l) {
        const double root = model.modal_root(b, l, l);
        a[l] = 1.0 / (root * root + g * (model.modal_damping(b, l) + g * model.modal_stiffness(b, l)));
    }
    for (Index i = 0; i < 3; ++i)
        for (Index j = 0; j <= i; ++j) {
            Complex total = newton.inertia(b, i, j);
            for (Index l = 0; l < m; ++l) total -= H(i, l) * a[l] * H(j, l);
            C(i, j) = C(j, i) = total;
        }
    invert_symmetric(C);
}

/* Set velocities (6 + m,) of force, moment and modal forces on a body, by M + g D + g^2 K. `push`: real or complex. */
template <class Push>
inline void solve_body(const Model& model, const Newton& newton, Index b, Index k, Push push,
                       Complexes<1> out) noexcept {
    const Mat Q = newton.turn[b], H = newton.coupling[b];
    const Complexes<1> a = newton.back[k][b];
    const Complexes<2> C = newton.core[k][b];
    const Index m = model.elastic(b, 0);
    for (Index i = 0; i < 3; ++i) out[i] = push[i] / model.mass[b];
    Complex u = Q(0, 0) * push[3] + Q(1, 0) * push[4] + Q(2, 0) * push[5];
    Complex v = Q(0, 1) * push[3] + Q(1, 1) * push[4] + Q(2, 1) * push[5];
    Complex w = Q(0, 2) * push[3] + Q(1, 2) * push[4] + Q(2, 2) * push[5];
    for (Index l = 0; l < m; ++l) {
        const Complex lag = a[l] * push[6 + l];
        out[6 + l] = lag;
        u -= H(0, l) * lag;
        v -= H(1, l) * lag;
        w -= H(2, l) * lag;
    }
    const Complex x = C(0, 0) * u + C(0, 1) * v + C(0, 2) * w;
    const Complex y = C(1, 0) * u + C(1, 1) * v + C(1, 2) * w;
    const Complex z = C(2, 0) * u + C(2, 1) * v + C(2, 2) * w;
    for (Index l = 0; l < m; ++l) out[6 + l] -= a[l] * (H(0, l) * x + H(1, l) * y + H(2, l) * z);
    for (Index i = 0; i < 3; ++i) out[3 + i] = Q(i, 0) * x + Q(i, 1) * y + Q(i, 2) * z;
}

/* Set the lower half of G (M + g D + g^2 K)^-1 G^T in the order of the rows. */
inline void set_schur(const Model& model, const Newton& newton, Complexes<2> L) noexcept {
    for (Index i = 0; i < newton.rank[0]; ++i)
        for (Index j = newton.first[i]; j <= i; ++j) L(i, j) = 0.0;
    for (Index pair = 0; pair < model.pairs.size(); ++pair) {
        const Index i = model.pairs(pair, 0), j = model.pairs(pair, 1);
        const Index p = model.pairs(pair, 2), q = model.pairs(pair, 3);
        const Index row = newton.place[i], column = newton.place[j];
        if (row == NONE || column == NONE) continue;
        const Vec block = newton.block[i][p];
        const Complexes<1> light = newton.light[j][q];
        Complex total = 0.0;
        for (Index k = 0; k < 6 + model.elastic(newton.owner(i, p), 0); ++k) total += block[k] * light[k];
        if (row >= column)
            L(row, column) += total;
        else
            L(column, row) += total;
    }
}

/* Replace a complex symmetric matrix by its lower factor, L L^T. */
inline void factor_rows(const Newton& newton, Complexes<2> L) noexcept {
    const Ints first = newton.first;
    for (Index i = 0; i < newton.rank[0]; ++i)
        for (Index j = first[i]; j <= i; ++j) {
            Complex total = L(i, j);
            for (Index k = larger(first[i], first[j]); k < j; ++k) total -= L(i, k) * L(j, k);
            L(i, j) = j < i ? total / L(j, j) : std::sqrt(total);
        }
}

/* Factor the systems of all eigenvalues, which are given over the step [1/s]; the start is kept. */
inline void set_systems(const Model& model, const Newton& newton, CComplexes<1> times) noexcept {
    for (Index k = 0; k < times.size(); ++k) {
        const Complex g = 1.0 / times[k];
        for (Index b = 0; b < model.mass.size(); ++b) set_core(model, newton, b, k, g);
        if (!newton.rank[0]) continue;
        for (Index n = 0; n < newton.parts[0]; ++n) {
            const Index row = newton.part(n, 0), p = newton.part(n, 1);
            solve_body(model, newton, newton.part(n, 2), k, newton.block[row][p], newton.light[row][p]);
        }
        set_schur(model, newton, newton.lower[k]);
        factor_rows(newton, newton.lower[k]);
    }
}

/* Set multipliers whose forces take what `lack` has of the rows' rates. */
inline void solve_rows(const Newton& newton, Complexes<2> L) noexcept {
    const Complexes<1> y = newton.spare;
    const Ints rows = newton.rows, first = newton.first;
    const Index rank = newton.rank[0];
    for (Index i = 0; i < rank; ++i) {
        Complex total = newton.lack[rows[i]];
        for (Index k = first[i]; k < i; ++k) total -= L(i, k) * y[k];
        y[i] = total / L(i, i);
    }
    fill(newton.multiplier, Complex(0.0));
    for (Index i = rank - 1; i >= 0; --i) {
        Complex total = y[i];
        for (Index k = i + 1; k < lesser(newton.end[i], rank); ++k)
            if (first[k] <= i) total -= L(k, i) * y[k];
        y[i] = total / L(i, i);
        newton.multiplier[rows[i]] = y[i];
    }
}

/* Add the forces of the joints to what acts on the bodies, and change their velocities. */
inline void hold(const Model& model, const Newton& newton, Index k) noexcept {
    for (Index n = 0; n < newton.parts[0]; ++n) {
        const Index row = newton.part(n, 0), b = newton.part(n, 2);
        const Vec block = newton.block[row][newton.part(n, 1)];
        for (Index l = 0; l < 6 + model.elastic(b, 0); ++l) newton.lack[row] -= block[l] * newton.moved(b, l);
    }
    solve_rows(newton, newton.lower[k]);
    for (Index n = 0; n < newton.parts[0]; ++n) {
        const Index row = newton.part(n, 0), b = newton.part(n, 2);
        const Vec block = newton.block[row][newton.part(n, 1)];
        const Complex multiplier = newton.multiplier[row];
        for (Index l = 0; l < 6 + model.elastic(b, 0); ++l) newton.push(b, l) += multiplier * block[l];
    }
    for (Index b = 0; b < model.mass.size(); ++b) solve_body(model, newton, b, k, newton.push[b], newton.moved[b]);
}

/* Set the change of a body's state by its velocities `moved` and what acts on it, `push`. */
inline void change_body(const Model& model, const Newton& newton, CVec y, Index b, Complex g) noexcept {
    const Complexes<1> r = newton.right, D = newton.change, v = newton.moved[b], push = newton.push[b];
    const Index s = WIDTH * b, m = model.elastic(b, 0), q = model.elastic(b, 1), momentum = model.elastic(b, 2);
    for (Index i = 0; i < 3; ++i) {
        D[s + PLACE + i] += g * v[i];
        D[s + SPEED + i] = v[i];
        D[s + SPIN + i] = push[3 + i];
    }
    const Complex a = 0.5 * g * v[3], c = 0.5 * g * v[4], d = 0.5 * g * v[5];
    const CVec e = y.slice(s + TURN, s + TURN + 4);
    D[s + TURN] += -a * e[1] - c * e[2] - d * e[3];
    D[s + TURN + 1] += a * e[0] + c * e[3] - d * e[2];
    D[s + TURN + 2] += c * e[0] + d * e[1] - a * e[3];
    D[s + TURN + 3] += d * e[0] + a * e[2] - c * e[1];
    for (Index l = 0; l < m; ++l) {
        const double stiffness = model.modal_stiffness(b, l);
        D[q + l] += g * v[6 + l];
        const Complex lost = model.modal_damping(b, l) * v[6 + l] + stiffness * D[q + l];
        D[momentum + l] = push[6 + l] + g * (g * stiffness * r[q + l] - lost);
    }
}

/* Set `change`, `moved` and multipliers mu/g of an eigenvalue over the step [1/s] by the residuals `right` and `lack`.
 *
 * y: state at the start. */
inline void solve_system(const Model& model, const Newton& newton, CVec y, Index k, Complex time) noexcept {
    const Complex g = 1.0 / time;
    const Complexes<1> r = newton.right;
    const Complexes<2> push = newton.push;
    for (Index i = 0; i < r.size(); ++i) newton.change[i] = g * r[i];
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Index s = WIDTH * b, q = model.elastic(b, 1), momentum = model.elastic(b, 2);
        for (Index i = 0; i < 3; ++i) {
            push(b, i) = g * model.mass[b] * r[s + SPEED + i];
            push(b, 3 + i) = g * r[s + SPIN + i];
        }
        for (Index l = 0; l < model.elastic(b, 0); ++l)
            push(b, 6 + l) = g * (r[momentum + l] - g * model.modal_stiffness(b, l) * r[q + l]);
        solve_body(model, newton, b, k, push[b], newton.moved[b]);
    }
    if (newton.rank[0]) hold(model, newton, k);
    for (Index i = 0; i < newton.multiplier.size(); ++i) newton.multiplier[i] *= time;
    for (Index b = 0; b < model.mass.size(); ++b) change_body(model, newton, y, b, g);
}

}  // namespace gudgeon::turning
