/* The residual that accepts a solution of the responses of all candidates of a step.
 *
 * Every port has F(x) = x - its response to the measures y = y0 + M x, zero at a solution: of unilateral contact
 * x - max(0, x - rho y), of the tangents of a cone x - the projection of x - rho y onto the disc mu f_n (P. Alart,
 * A. Curnier, Comput. Methods Appl. Mech. Engrg. 92 (1991) 353-375).
 */
#pragma once
#include "blocks.hpp"

namespace gudgeon::small {

/* Residual of a solution that round-off leaves, over the force that would stop a port's free motion, that at the start,
 * and that which would move points by where they are held. */
constexpr double ROUND_OFF_FORCE = 1e-15;
/* Largest force over the one that would stop a port's free motion: none balances the motion, only round-off does. */
constexpr double UNBOUNDED = 1e14;

/* What a residual is relative to. */
struct Bound {
    double largest;  /* Of the forces [N]. */
    double start;    /* The largest force at the start [N]. */
};

inline double square(double value) noexcept { return value * value; }

/* Sum F^2 of unilateral contact and friction, with the changes of the last sweep for ports of other kinds [N^2].
 *
 * A sum: it is not a number where any part of it is not. */
inline double natural_residual(const Constants& constants, const Problem& problem) noexcept {
    const Vec x = problem.x, y = problem.y, stiff = problem.stiff, start = problem.start;
    const Index n = problem.size[0];
    double total = 0.0;
    for (Index a = 0; a < n; ++a) {
        const Index i = problem.ports[a], kind = constants.kind[i], size = constants.size[i];
        if (size == 0) continue;
        if (stiff[a] == 0.0 && presses(kind)) {
            total += x[a] * x[a];  /* No force moves it. */
        } else if (kind == UNILATERAL || kind == CONE) {
            const double wrong = y[a] * stiff[a];
            /* No `larger`, which is 0 where the force wanted is not a number. */
            total += square(x[a] - wrong <= 0.0 ? x[a] : wrong);
        } else {
            const Index count = kind == BILATERAL || kind == DRIVEN ? size : 1;
            for (Index b = a; b < a + count; ++b) total += square(x[b] - start[b]);
        }
        if (size == 3 && kind != DRIVEN) {
            const Limit limit{constants.friction(i, 0) * x[a], constants.friction(i, 1) * x[a]};
            const Friction wanted =
                held_or_rubbed(stiff[a + 1], limit, problem.slipped[i], x[a + 1], x[a + 2], y[a + 1], y[a + 2]);
            total += square(x[a + 1] - wanted.first) + square(x[a + 2] - wanted.second);
        }
    }
    return total;
}

/* The residual of a solution [N]: a share of its largest force, or of its bound [N], or round-off.
 *
 * Measures keep the round-off of the forces at the start, which is all there is where no force is the solution. Those
 * across are differences of places, whose round-off no force takes away where more points are held than can move.
 *
 * Forces of short steps are small differences of what would stop free motions; those of friction are within their
 * cones, however little a point that is held across would move. Not a number, which no residual is below, where a
 * force has grown beyond what round-off can tell from one without end. */
inline double allowed(const Constants& constants, const State& state, const Problem& problem, double tolerance,
                      const Bound& bound) noexcept {
    const Vec x = problem.x, stiff = problem.stiff;
    double largest = 0.0, rough = 0.0, places = 0.0;
    Index across = 0;
    bool placed = false;
    for (Index a = 0; a < problem.size[0]; ++a) {
        const Index i = problem.ports[a];
        largest = larger(largest, std::abs(x[a]));
        if (across > 0) {
            across -= 1;
            places += placed ? square(state.anchor[i] * stiff[a]) : 0.0;
        } else if (x[a] != 0.0) {
            rough = larger(rough, std::abs(problem.free[i]) * stiff[a]);
        }
        if (constants.size[i] == 3 && constants.kind[i] != DRIVEN) {
            across = 2;
            placed = constants.level[i] == POSITION;
        }
    }
    if (largest > UNBOUNDED * rough && UNBOUNDED * rough > 0.0) return std::numeric_limits<double>::quiet_NaN();
    return larger(tolerance * lesser(largest, bound.largest),
                  ROUND_OFF_FORCE * larger(larger(rough, bound.start), std::sqrt(places)));
}

/* Set the measures by the unknowns: those kept up to date have the round-off of all unknowns on the way. */
inline void renew(const Problem& problem) noexcept {
    const Index n = problem.size[0];
    const Vec x = problem.x.slice(0, n), y = problem.y.slice(0, n);
    for (Index a = 0; a < n; ++a) y[a] = problem.free[problem.ports[a]];
    for (Index a = 0; a < n; ++a)
        if (x[a] != 0.0) add(x[a], problem.columns[a].slice(0, n), y);
}

}  // namespace gudgeon::small
