/* A sweep: every block of candidates responds once to the measures y = y0 + M x as they are (Gauss-Seidel).
 *
 * Cones are under-relaxed, a projection onto the disc mu f_n after one onto f_n >= 0. M x is kept up to date, so that a
 * sweep costs one product with M.
 */
#pragma once
#include "blocks.hpp"

namespace gudgeon::small {

/* Of cones: two trials with the residual flexibility of a part need 40 sweeps with it, 55 at 1. */
constexpr double RELAXATION = 0.7;

/* Unknowns, measures and columns of the candidates of a solution, n of them. */
struct Candidates {
    Vec x, y;
    CMat columns;
    explicit Candidates(const Problem& problem) noexcept
        : x(problem.x.slice(0, problem.size[0])), y(problem.y.slice(0, problem.size[0])), columns(problem.columns) {}
    CVec column(Index a) const noexcept { return columns[a].slice(0, x.size()); }
};

/* Set an unknown [N], and all measures by its change. */
inline void change(const Candidates& all, Index a, double value) noexcept {
    const double step = value - all.x[a];
    if (step == 0.0) return;
    add(step, all.column(a), all.y);
    all.x[a] = value;
}

/* Set the unknowns of candidate a and of the two after it [N], and all measures by their changes. */
inline void change_three(const Candidates& all, Index a, double normal, double first, double second) noexcept {
    const double by_normal = normal - all.x[a], by_first = first - all.x[a + 1], by_second = second - all.x[a + 2];
    const CVec p = all.column(a), q = all.column(a + 1), r = all.column(a + 2);
    const Vec y = all.y;
    SIMD
    for (Index c = 0; c < y.size(); ++c) y[c] += by_normal * p[c] + (by_first * q[c] + by_second * r[c]);
    all.x[a] = normal, all.x[a + 1] = first, all.x[a + 2] = second;
}

/* The direction of a joint's force in the step with its length [m], and what each of its two ports by unit forces does
 * to the first and to the second [m/N]. */
struct Rod {
    CVec along;
    double columns[4];
};

struct Plane {
    double first, second;
};

/* The force that holds the distance of a joint's point from its driven point, along the rod's direction in the step.
 *
 * x, y: force [N] and measure [m] so far. */
inline Plane held(const Rod& rod, Plane x, Plane y) noexcept {
    const auto& [along, columns] = rod;
    const double length = along[2];
    double by_first = columns[0] * along[0] + columns[2] * along[1];
    double by_second = columns[1] * along[0] + columns[3] * along[1];
    double force = x.first * along[0] + x.second * along[1];
    const double turned[] = {force * along[0] - x.first, force * along[1] - x.second};
    y.first += columns[0] * turned[0] + columns[2] * turned[1];
    y.second += columns[1] * turned[0] + columns[3] * turned[1];
    for (int turn = 0; turn < 2; ++turn) {
        const double size = length_of(y.first, y.second);
        const double step = (length - size) * size / (y.first * by_first + y.second * by_second);
        force += step;
        y.first += step * by_first, y.second += step * by_second;
    }
    return {force * along[0], force * along[1]};
}

/* Hold a joint, candidates a and a + 1. */
inline void hold(CVec along, const Candidates& all, Index a) noexcept {
    const CMat M = all.columns;
    const Rod rod{along, {M(a, a), M(a, a + 1), M(a + 1, a), M(a + 1, a + 1)}};
    const auto [first, second] = held(rod, {all.x[a], all.x[a + 1]}, {all.y[a], all.y[a + 1]});
    change(all, a, first);
    change(all, a + 1, second);
}

/* Bring the ports of a drive, candidates from a on, to where they are given to be. */
inline void drive(const Constants& constants, const Problem& problem, const Candidates& all, Index a) noexcept {
    const Index i = problem.ports[a], count = constants.size[i];
    for (Index b = 0; b < count; ++b)
        for (Index c = 0; c < count; ++c) all.x[a + b] -= constants.inverse(i + b, c) * all.y[a + c];
    for (Index b = 0; b < count; ++b) add(all.x[a + b] - problem.start[a + b], all.column(a + b), all.y);
}

/* Whether a unilateral port is open and stays so. */
inline bool idle(Index kind, Index size, Index a, CVec x, CVec y) noexcept {
    const bool open = (kind == UNILATERAL || kind == CONE) && x[a] == 0.0 && y[a] >= 0.0;
    return open && (size == 1 || (x[a + 1] == 0.0 && x[a + 2] == 0.0));
}

/* The force [N] along the normal of a pressed port, a law or a spring. */
inline double normal_force(const Constants& constants, const State& state, const Problem& problem,
                           const Candidates& all, Index a) noexcept {
    const Index i = problem.ports[a], kind = constants.kind[i];
    const double old = all.x[a], stiff = problem.stiff[a], wrong = all.y[a] * stiff, reach = all.columns(a, a);
    if (stiff == 0.0 && presses(kind)) return 0.0;  /* No force moves it. */
    if (kind == UNILATERAL) return larger(0.0, old - wrong);
    if (kind == CONE) return larger(0.0, old - RELAXATION * wrong);
    const double normal = compliant_force(constants, state, i, all.y[a] - reach * old, reach);
    if (kind == RUBBING_LAW && normal > 0.0) return larger(0.0, old + RELAXATION * (normal - old));
    return normal;
}

/* Let the tangents of a point respond with its normal force [N].
 *
 * decided: whether what slips goes on to slip in this step. */
inline void rub(const Constants& constants, const Problem& problem, const Candidates& all, Index a, double normal,
                bool decided) noexcept {
    const Index i = problem.ports[a];
    const Vec x = all.x, y = all.y;
    const Limit limit{constants.friction(i, 0) * normal, constants.friction(i, 1) * normal};
    const double step = normal - x[a];
    const Friction found = held_or_rubbed(problem.stiff[a + 1], limit, problem.slipped[i], x[a + 1], x[a + 2],
                                          y[a + 1] + step * all.columns(a, a + 1),
                                          y[a + 2] + step * all.columns(a, a + 2));
    problem.slipped[i] = problem.slipped[i] || (decided && found.slips);
    change_three(all, a, normal, found.first, found.second);
}

/* Let every block respond once; returns the number of blocks.
 *
 * decided: as of `rub`. */
inline Index sweep_over(const Constants& constants, const State& state, const Problem& problem, bool decided) noexcept {
    const Candidates all{problem};
    Index blocks = 0;
    for (Index a = 0; a < all.x.size(); ++a) {
        const Index i = problem.ports[a], kind = constants.kind[i], size = constants.size[i];
        if (size == 0) continue;
        blocks += 1;
        if (kind == BILATERAL) {
            hold(state.rod[constants.joint[i]], all, a);
        } else if (kind == DRIVEN) {
            drive(constants, problem, all, a);
        } else if (!idle(kind, size, a, all.x, all.y)) {
            const double normal = normal_force(constants, state, problem, all, a);
            if (size == 3)
                rub(constants, problem, all, a, normal, decided);
            else
                change(all, a, normal);
        }
    }
    return blocks;
}

}  // namespace gudgeon::small
