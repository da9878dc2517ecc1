/* Multipliers of constraint rows that may depend on each other: a factor that reveals the rank, and least norm. */
#pragma once
#include "arrays.hpp"

namespace gudgeon::turning {

/* Square of the sine of the least angle, in the metric of the inertia, between a row and those before it. */
inline constexpr double INDEPENDENT = 1e-12;
/* The same up to which rows are factored without pivots. */
inline constexpr double APART = 1e-6;

/* sum_k L_ik L_jk over k from `first` to `end` - 1. */
inline double rows_product(Mat L, Index i, Index j, Index first, Index end) noexcept {
    const double *a = L[i].data, *b = L[j].data;
    double total = 0.0;
    SIMD_SUM(total)
    for (Index k = first; k < end; ++k) total += a[k] * b[k];
    return total;
}

/* Factor S within its envelope, in the order of the model; false where a pivot is below `APART`. */
inline bool factor_within(const Model& model, const Work& work) noexcept {
    const Mat S = work.matrix, L = work.lower;
    const Ints order = work.order, begin = work.begin;
    const Vec scale = work.scale;
    const Index m = order.size();
    double least = 1.0;
    for (Index i = 0; i < m; ++i) {
        const Index row = model.envelope(i, 0), first = model.envelope(i, 1);
        order[i] = row, begin[i] = first, work.end[i] = model.envelope(i, 2);
        if (!(S(row, row) > 0.0 && S(row, row) < std::numeric_limits<double>::infinity())) return false;
        scale[row] = std::sqrt(S(row, row));
        double pivot = 1.0;
        for (Index j = first; j < i; ++j) {
            double total = S(row, order[j]) / (scale[row] * scale[order[j]]);
            total -= rows_product(L, i, j, larger(first, begin[j]), j);
            L(i, j) = total / L(j, j);
            pivot -= L(i, j) * L(i, j);
        }
        if (!(pivot > APART)) return false;
        least = lesser(least, pivot);
        L(i, i) = std::sqrt(pivot);
    }
    work.least[0] = lesser(work.least[0], least);
    work.rank[0] = m;
    return true;
}

/* Set the scales of rows, alike of those of one joint along axes at right angles, and scale S; false where it is
 * infinite, of bodies far from their joints, where all multipliers become NaN. Its diagonal and the inverse of this are left in `spare`. */
inline bool scale_rows(const Model& model, const Work& work) noexcept {
    const Mat S = work.matrix;
    const Vec scale = work.scale, sums = work.spare[1];
    const Index m = work.order.size();
    double trace = 0.0;
    for (Index i = 0; i < m; ++i) {
        sums[i] = 0.0;
        trace += S(i, i);
    }
    for (Index i = 0; i < m; ++i) sums[model.group(i, 0)] += S(i, i) / double(model.group(i, 1));
    for (Index i = 0; i < m; ++i) {
        const double mean = sums[model.group(i, 0)];
        scale[i] = mean > 0 ? std::sqrt(mean) : 1.0;
        work.order[i] = i, work.begin[i] = 0, work.end[i] = m;
    }
    if (!(trace < std::numeric_limits<double>::infinity())) {
        work.rank[0] = m;
        for (Index i = 0; i < m; ++i) work.lower(i, i) = std::numeric_limits<double>::quiet_NaN();
        return false;
    }
    for (Index i = 0; i < m; ++i) sums[i] = 1.0 / scale[i];
    for (Index i = 0; i < m; ++i) {
        double* row = S[i].data;
        const double factor = sums[i];
        SIMD
        for (Index j = 0; j < m; ++j) row[j] *= factor * sums.data[j];
        work.left[i] = row[i] > 0 ? 1.0 : 0.0;
        work.spare(0, i) = row[i];
    }
    for (Index i = 0; i < m; ++i) work.spare(1, i) = work.left[i] > 0.0 ? 1.0 / work.spare(0, i) : 0.0;
    return true;
}

/* Exchange rows k and `best` of the factor of which k columns are set, the rows of U. */
inline void exchange(const Work& work, Mat U, Index k, Index best) noexcept {
    const auto swap = [](auto& a, auto& b) noexcept {
        const auto before = a;
        a = b, b = before;
    };
    swap(work.order[k], work.order[best]);
    swap(work.left[k], work.left[best]);
    swap(work.spare(0, k), work.spare(0, best));
    swap(work.spare(1, k), work.spare(1, best));
    for (Index l = 0; l < k; ++l) swap(U(l, k), U(l, best));
}

/* Set row k of U = L^T behind its pivot, and subtract its squares, over the diagonal of S, from what is left of rows.
 * Most rows do not couple: of a sum, terms whose factor is zero are left out. */
inline void set_upper_row(const Work& work, Mat U, Index k, double pivot) noexcept {
    const Index m = work.order.size();
    const double *coupling = work.matrix[work.order[k]].data, *inverse = work.spare[1].data;
    const Index* order = work.order.data;
    double *row = U[k].data, *left = work.left.data;
    const double over = 1.0 / pivot;
    for (Index i = k + 1; i < m; ++i) row[i] = coupling[order[i]];
    for (Index l = 0; l < k; ++l) {
        const double* above = U[l].data;
        const double factor = above[k];
        if (factor == 0.0) continue;
        SIMD
        for (Index i = k + 1; i < m; ++i) row[i] -= factor * above[i];
    }
    SIMD
    for (Index i = k + 1; i < m; ++i) {
        row[i] *= over;
        left[i] = left[i] > 0.0 ? left[i] - row[i] * row[i] * inverse[i] : left[i];
    }
}

/* Factor S by pivots on the diagonal.
 *
 * Rows of one joint along axes at right angles are scaled alike, so that least norms do not depend on these axes. One
 * that the others imply leaves a pivot of round-off; it and those after it are left out. The least pivot that is kept,
 * the square of the sine of an angle between rows, lowers `least`. Where S is infinite all multipliers become NaN,
 * which ends the step. */
inline void factor_by_pivots(const Model& model, const Work& work) noexcept {
    const Mat L = work.lower, U = work.small;
    const Vec left = work.left;
    const Index m = work.order.size();
    if (!scale_rows(model, work)) return;
    Index rank = 0;
    for (Index k = 0; k < m; ++k) {
        Index best = k;
        for (Index i = k + 1; i < m; ++i)
            if (left[i] > left[best]) best = i;
        if (!(left[best] > INDEPENDENT)) break;
        ++rank;
        if (left[best] < work.least[0]) work.least[0] = left[best];
        if (best != k) exchange(work, U, k, best);
        const double pivot = std::sqrt(left[k] * work.spare(0, k));
        U(k, k) = pivot;
        set_upper_row(work, U, k, pivot);
    }
    for (Index i = 0; i < m; ++i)
        for (Index k = 0; k < lesser(i + 1, rank); ++k) L(i, k) = U(k, i);
    work.rank[0] = rank;
}

/* Scale S to a diagonal of about one and factor it, S = L L^T; sets scale, order, begin and rank.
 *
 * Within the envelope of S where this is cheaper and no row is near to depend on others, or else by pivots on the
 * diagonal. */
inline void factor(const Model& model, const Work& work) noexcept {
    if (work.within[0] == 0 || !factor_within(model, work)) factor_by_pivots(model, work);
}

/* Set multipliers that satisfy S lambda = right on independent rows; those left out have none. */
inline void solve(const Work& work) noexcept {
    const Mat L = work.lower;
    const Ints order = work.order, begin = work.begin;
    const Vec scale = work.scale, y = work.spare[0], multiplier = work.multiplier;
    const Index rank = work.rank[0];
    for (Index i = 0; i < rank; ++i) {
        double total = work.right[order[i]] / scale[order[i]];
        SIMD_SUM(total)
        for (Index k = begin[i]; k < i; ++k) total -= L(i, k) * y[k];
        y[i] = total / L(i, i);
    }
    for (Index i = 0; i < order.size(); ++i) multiplier[order[i]] = 0.0;
    for (Index i = rank - 1; i >= 0; --i) { /* Row by row of L, whose entries follow each other. */
        const double value = y[i] / L(i, i);
        multiplier[order[i]] = value / scale[order[i]];
        const double* row = L[i].data;
        SIMD
        for (Index k = begin[i]; k < i; ++k) y.data[k] -= row[k] * value;
    }
}

/* Set y to L^T right, and the factor of L^T L in `small`. */
inline void factor_small(const Work& work, Vec y) noexcept {
    const Mat L = work.lower, N = work.small;
    const Ints order = work.order;
    const Index m = order.size(), rank = work.rank[0];
    for (Index i = 0; i < rank; ++i) {
        for (Index j = 0; j <= i; ++j) {
            double total = 0.0;
            for (Index k = i; k < m; ++k) total += L(k, i) * L(k, j);
            N(i, j) = total;
        }
        double total = 0.0;
        for (Index k = i; k < m; ++k) total += L(k, i) * work.right[order[k]] / work.scale[order[k]];
        y[i] = total;
    }
    for (Index i = 0; i < rank; ++i)
        for (Index j = 0; j <= i; ++j) {
            const double total = N(i, j) - rows_product(N, i, j, 0, j);
            N(i, j) = i > j ? total / N(j, j) : std::sqrt(total);
        }
}

/* Set the multipliers of least norm that satisfy S lambda = right: lambda = L (L^T L)^-2 L^T right, rows scaled as by
 * `factor`.
 *
 * The norm is that of lambda_i times the scale of its row, a root of S, whose unit is the same for forces and moments.
 * Of independent rows lambda is unique. */
inline void solve_least(const Work& work) noexcept {
    if (work.rank[0] == work.order.size()) {
        solve(work);
        return;
    }
    const Mat L = work.lower, N = work.small;
    const Vec y = work.spare[0];
    const Index m = work.order.size(), rank = work.rank[0];
    factor_small(work, y);
    for (Index round = 0; round < 2; ++round) {
        for (Index i = 0; i < rank; ++i) {
            double total = y[i];
            for (Index k = 0; k < i; ++k) total -= N(i, k) * y[k];
            y[i] = total / N(i, i);
        }
        for (Index i = rank - 1; i >= 0; --i) {
            double total = y[i];
            for (Index k = i + 1; k < rank; ++k) total -= N(k, i) * y[k];
            y[i] = total / N(i, i);
        }
    }
    for (Index k = 0; k < m; ++k) {
        double total = 0.0;
        for (Index i = 0; i < lesser(k + 1, rank); ++i) total += L(k, i) * y[i];
        work.multiplier[work.order[k]] = total / work.scale[work.order[k]];
    }
}

}  // namespace gudgeon::turning
