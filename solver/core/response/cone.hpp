/* Points that friction holds at places which no motion of their bodies reaches together.
 *
 * A rigid body on three points has six places across for three motions. Points that close at different times of a step,
 * or slide while others are held to the tolerance of a solution, are held at places that differ by what no motion of the
 * body takes away. Forces against each other grow until one of them slips by that, which a solution need not find.
 */
#pragma once
#include "../dense.hpp"
#include "../small/arrays.hpp"

namespace gudgeon::small {

/* Added to the diagonal of what forces across move, relative to it: displacements are kept to that, others are none. */
constexpr double HELD_RIDGE = 1e-8;

/* Rows and columns of a dense matrix of the candidates, in the memory of the largest, (n, n). */
inline Mat derivative_of(const Problem& problem) noexcept {
    const Index n = problem.size[0];
    return {problem.derivative.data, {n, n}};
}

/* Whether a candidate is the normal of a point that friction may hold at a place. */
inline bool may_hold(const Constants& constants, const Problem& problem, Index a) noexcept {
    const Index i = problem.ports[a];
    return constants.size[i] == 3 && constants.kind[i] != DRIVEN && constants.level[i] == POSITION;
}

/* Set what forces across move of points that friction may hold, and minus the displacements there. */
inline void fill_across(const Constants& constants, const Problem& problem, Mat matrix, Vec part) noexcept {
    const Index n = part.size();
    fill(matrix, 0.0);
    for (Index a = 0; a < n; ++a) matrix(a, a) = 1.0, part[a] = 0.0;
    for (Index a = 0; a < n; ++a) {
        if (!may_hold(constants, problem, a)) continue;
        for (Index b = a + 1; b < a + 3; ++b) {
            part[b] = -problem.free[problem.ports[b]];
            for (Index c = 0; c < n; ++c)
                if (may_hold(constants, problem, c)) {
                    matrix(b, c + 1) = problem.columns(c + 1, b);
                    matrix(b, c + 2) = problem.columns(c + 2, b);
                }
            matrix(b, b) += matrix(b, b) > 0.0 ? HELD_RIDGE * matrix(b, b) : 1.0;
        }
    }
}

/* Move the anchors of all candidates that may be held by the part of their displacements that no force changes.
 *
 * With M + D the matrix of what forces across move, and a small diagonal D, (M + D) z = -y0 leaves y0 + M z = -D z of
 * the displacements y0, which is their part that M z does not reach.
 * Returns whether there are such points, and anything moved. */
inline bool make_reachable(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Index n = problem.size[0];
    bool moves = false;
    const Mat matrix = derivative_of(problem);
    const Vec part = problem.correction.slice(0, n);
    fill_across(constants, problem, matrix, part);
    if (!eliminate(matrix, part)) return false;
    for (Index a = 0; a < n; ++a) {
        if (!may_hold(constants, problem, a)) continue;
        for (Index b = a + 1; b < a + 3; ++b) {
            const Index i = problem.ports[b];
            const double beyond = -HELD_RIDGE * problem.columns(b, b) * part[b];
            problem.free[i] -= beyond;
            state.gap[i] -= beyond;
            state.measure[i] -= beyond;
            state.anchor[i] += beyond;
            moves |= beyond != 0.0;
        }
    }
    return moves;
}

}  // namespace gudgeon::small
