/* Semismooth Newton's method for the responses of all candidates of a step.
 *
 * F of `residual.hpp` is piecewise smooth; each step factors its derivative anew.
 */
#pragma once
#include "cone.hpp"
#include "residual.hpp"

namespace gudgeon::small {

constexpr int MOST_STEPS = 12;
constexpr Index NEWTON = 5;  /* Entry of the counts: steps of Newton's method. */
/* Added to the diagonal of the derivative, relative to it: rows of points that depend on each other are singular. */
constexpr double RIDGE = 1e-12;
constexpr double DIFFERENCE = 1e-7;  /* Share of a measure by which the slope of a law is found. */

/* F of all candidates and its derivative, a row for each. */
struct Derivative {
    Mat matrix;
    Vec wrong;
};

/* Add the derivative of the measure of candidate a, times a factor, to a row. */
inline void add_derivative(CMat columns, Index a, double factor, Vec row) noexcept {
    for (Index c = 0; c < row.size(); ++c) row[c] += factor * columns(c, a);
}

/* Set F of the tangents of a cone and its derivative. */
inline void derive_friction(CVec friction, const Problem& problem, Index a, const Derivative& out) noexcept {
    const auto& [matrix, wrong] = out;
    const Vec x = problem.x, y = problem.y;
    const CMat columns = problem.columns;
    const Index port = problem.ports[a];
    const double weight = problem.stiff[a + 1];
    const double first = x[a + 1] - weight * y[a + 1], second = x[a + 2] - weight * y[a + 2];
    const double size = std::sqrt(first * first + second * second), normal = larger(0.0, x[a]);
    if (size <= friction[problem.slipped[port] ? 1 : 0] * normal && normal > 0.0) {
        for (Index b = a + 1; b < a + 3; ++b) {
            wrong[b] = weight * y[b];
            add_derivative(columns, b, weight, matrix[b]);
            if (weight == 0.0 || columns(b, b) == 0.0) wrong[b] = x[b], matrix(b, b) = 1.0;
        }
        return;
    }
    /* What slips goes on to slip: between static and kinetic friction it would change without end. */
    problem.slipped[port] = true;
    const double limit = friction[1] * normal, turn = size > 0.0 ? limit / size : 0.0;
    const double along = size > 0.0 ? first / size : 0.0, across = size > 0.0 ? second / size : 0.0;
    for (Index b = a + 1; b < a + 3; ++b) {
        const double axis = b == a + 1 ? along : across, other = b == a + 1 ? across : along;
        const Index other_row = b == a + 1 ? a + 2 : a + 1;
        wrong[b] = x[b] - limit * axis;
        /* -turn (I - n n^T) (dx - weight dy) */
        const double same = -turn * (1.0 - axis * axis), mixed = turn * axis * other;
        add_derivative(columns, b, -same * weight, matrix[b]);
        add_derivative(columns, other_row, -mixed * weight, matrix[b]);
        matrix(b, b) += 1.0 + same;
        matrix(b, other_row) += mixed;
        if (x[a] > 0.0) matrix(b, a) -= friction[1] * axis;
    }
}

/* Set F of a joint: its force is along the rod, and its point at the rod's length from its driven point. */
inline void derive_rod(CVec along, const Problem& problem, Index a, const Derivative& out) noexcept {
    const auto& [matrix, wrong] = out;
    const Vec x = problem.x, y = problem.y;
    const CMat columns = problem.columns;
    const double size = length_of(y[a], y[a + 1]), first = y[a] / size, second = y[a + 1] / size;
    const double reach = columns(a, a) + columns(a + 1, a + 1);
    wrong[a] = (size - along[2]) / reach;
    add_derivative(columns, a, first / reach, matrix[a]);
    add_derivative(columns, a + 1, second / reach, matrix[a]);
    wrong[a + 1] = x[a + 1] * along[0] - x[a] * along[1];
    matrix(a + 1, a) = -along[1];
    matrix(a + 1, a + 1) = along[0];
}

/* Set F of a drive whose first port is candidate a: its ports are where they are given to be. */
inline void derive_drive(const Constants& constants, const Problem& problem, Index a, const Derivative& out) noexcept {
    const auto& [matrix, wrong] = out;
    const Index i = problem.ports[a], count = constants.size[i];
    for (Index b = 0; b < count; ++b) {
        wrong[a + b] = 0.0;
        for (Index c = 0; c < count; ++c) {
            wrong[a + b] += constants.inverse(i + b, c) * problem.y[a + c];
            add_derivative(problem.columns, a + c, constants.inverse(i + b, c), matrix[a + b]);
        }
    }
}

/* Set F of a law or a spring and its derivative, by a difference quotient. */
inline void derive_law(const Constants& constants, const State& state, const Problem& problem, Index a,
                       const Derivative& out) noexcept {
    const auto& [matrix, wrong] = out;
    const Index i = problem.ports[a];
    const double x = problem.x[a], reach = problem.columns(a, a), free = problem.y[a] - reach * x;
    const double force = compliant_force(constants, state, i, free, reach);
    const double away = DIFFERENCE * (std::abs(free) + std::abs(state.displacement(1, i)) + reach * std::abs(x));
    const double other = compliant_force(constants, state, i, free - away, reach);
    const double slope = away > 0.0 ? (force - other) / away : 0.0;
    wrong[a] = x - force;
    add_derivative(problem.columns, a, -slope, matrix[a]);
    matrix(a, a) += 1.0 + slope * reach;
}

/* Set F and its derivative, a row for each candidate. */
inline void derive(const Constants& constants, const State& state, const Problem& problem,
                   const Derivative& out) noexcept {
    const auto& [matrix, wrong] = out;
    const Vec x = problem.x, y = problem.y;
    fill(matrix, 0.0);
    for (Index a = 0; a < wrong.size(); ++a) {
        const Index i = problem.ports[a], kind = constants.kind[i], size = constants.size[i];
        if (size == 0) continue;
        if (kind == BILATERAL) {
            derive_rod(state.rod[constants.joint[i]], problem, a, out);
            continue;
        }
        if (kind == DRIVEN) {
            derive_drive(constants, problem, a, out);
            continue;
        }
        const double reach = problem.columns(a, a);
        if (reach <= 0.0 && presses(kind)) {
            wrong[a] = x[a], matrix(a, a) = 1.0;
        } else if (kind == UNILATERAL || kind == CONE) {
            const bool closed = x[a] - y[a] / reach > 0.0;
            wrong[a] = closed ? y[a] / reach : x[a];
            if (closed)
                add_derivative(problem.columns, a, 1.0 / reach, matrix[a]);
            else
                matrix(a, a) = 1.0;
        } else {
            derive_law(constants, state, problem, a, out);
        }
        if (size == 3) derive_friction(constants.friction[i], problem, a, out);
    }
}

/* Improve the unknowns until the residual is within a tolerance; false where it is not.
 *
 * tolerance: relative to the largest force, or to its bound [N]. */
inline bool newton(const Constants& constants, const State& state, const Problem& problem, double tolerance,
                   const Bound& bound) noexcept {
    const Index n = problem.size[0];
    const Vec x = problem.x.slice(0, n), start = problem.start.slice(0, n), step = problem.correction.slice(0, n);
    const Derivative derivative{derivative_of(problem), step};
    const Mat matrix = derivative.matrix;
    for (int turn = 0; turn < MOST_STEPS; ++turn) {
        state.counts[NEWTON] += 1;
        derive(constants, state, problem, derivative);
        for (Index a = 0; a < n; ++a) matrix(a, a) += RIDGE * std::abs(matrix(a, a));
        if (!eliminate(matrix, step)) return false;
        for (Index a = 0; a < n; ++a) x[a] -= step[a];
        /* The change of the other kinds that the residual takes. */
        for (Index a = 0; a < n; ++a) start[a] = x[a] + step[a];
        renew(problem);
        const double most = allowed(constants, state, problem, tolerance, bound);
        if (natural_residual(constants, problem) <= most * most) return true;
    }
    return false;
}

}  // namespace gudgeon::small
