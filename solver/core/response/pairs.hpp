/* Points that slide over traction spaces, all unilateral, and joints: their complementarity problem by closed ports.
 *
 * The compliance base + N M N^T changes as points slide. Rows of closed ports are kept for an era, while weights move by
 * less than `REFRESH`; gaps are exact under the forces that are expected, so that the kept rows meet nothing but the
 * change from these. Joints follow the forces of contacts, and all are found again until none changes any more.
 */
#pragma once
#include "candidates.hpp"
#include "complementarity.hpp"
#include "sweep.hpp"

namespace gudgeon::small {

constexpr double REFRESH = 0.2;   /* Share of the spacing of functions that points may slide before an era ends. */
constexpr double FOLLOWED = 1e-3; /* Change of the forces in a trial, over the largest, up to which it was the last: at
                                   * 2e-2 the energy drift of an elastic piston did not fall with the step. */
constexpr int TRIALS = 4;         /* Most complementarity problems in a solution. */
constexpr double PAIR_TOLERANCE = 1e-12; /* Violation of a gap that is accepted, over the largest overlap. */

/* Ports of contacts, which come first. */
inline Index points_of(const Problem& problem) noexcept { return problem.active.rows.size(); }

/* Make the weights of the end of the step those of the kept rows, and factorise the closed ones again. */
inline void begin_era(const State& state, const Problem& problem) noexcept {
    const Slides& slides = state.slides;
    const Compliance& matrix = problem.matrix;
    const ActiveSet& active = problem.active;
    matrix.era[0] += 1;
    copy(slides.corner[NOW], matrix.corner);
    for (Index b = 0; b < 4; ++b) copy(slides.along[NOW][b], matrix.along[b]);
    copy(slides.sigma[NOW], slides.sigma[ERA]);
    for (Index k = 0, g = 0; k < matrix.space.size(); ++k) {
        if (matrix.space(k, 2) == 0) continue;
        matrix.window(k, 0) = (slides.window(g, 0) - matrix.space(k, 0)) / matrix.space(k, 1);
        matrix.window(k, 1) = (slides.window(g, 1) - matrix.space(k, 0)) / matrix.space(k, 1);
        ++g;
    }
    const Index size = active.size[0];
    active.size[0] = active.size[1] = 0;
    for (Index a = 0; a < size; ++a) append(matrix, active, active.rows[a]);
}

/* Whether points have slid too far for the kept rows. */
inline bool era_ends(const Slides& slides) noexcept {
    bool ends = false;
    for (Index g = 0; g < slides.chart.size(); ++g)
        ends = ends || !(std::abs(slides.sigma(NOW, g) - slides.sigma(ERA, g)) <= REFRESH * slides.chart(g, 1));
    return ends;
}

/* Set values of functions to those that points spread on them, and list them by windows; returns how many. */
inline Index list_spread(const State& state, const Problem& problem, Vec values) noexcept {
    const Slides& slides = state.slides;
    const CInts functions = slides.functions;
    if (functions.size() == 0) return 0;
    fill(values.slice(functions[0], functions[functions.size() - 1] + 1), 0.0);
    for (Index g = 0; g < slides.ports.size(); ++g)
        for (Index i = slides.ports(g, 0); i < slides.ports(g, 1); ++i)
            if (values[i] != 0.0) spread(slides, i, NOW, values[i], values);
    Index count = 0;
    for (Index n = 0; n < functions.size(); ++n) {
        const Index f = functions[n];
        problem.gathered[count] = f, problem.pushing[count] = values[f];
        count += values[f] != 0.0;
    }
    return count;
}

/* Set in `pushed` how values on points, joints and functions, (p,), move these, each with its own rows of a table. */
inline void push_ports(const Constants& constants, const State& state, const Problem& problem, CVec table,
                       Vec values) noexcept {
    const Slides& slides = state.slides;
    const Index last = held_ports(constants);
    const Vec pushed = problem.pushed;
    fill(pushed.slice(0, last), 0.0);
    const auto combine_listed = [&](Index count, Index begin, Index end) {
        combine_rows(constants.pattern, table, {problem.gathered, problem.pushing, count}, begin, end, pushed);
    };
    const Index functions = list_spread(state, problem, values);
    for (Index g = 0; g < slides.window.size(); ++g) {
        fill(pushed.slice(slides.window(g, 0), slides.window(g, 1)), 0.0);
        combine_listed(functions, slides.window(g, 0), slides.window(g, 1));
    }
    Index count = 0;
    for (Index i = 0; i < last; ++i) {
        problem.gathered[count] = i, problem.pushing[count] = values[i];
        count += values[i] != 0.0;
    }
    combine_listed(count, 0, last);
}

/* Add to measures of points and joints, (p,), what `pushed` has of their own and of functions below points. */
inline void add_pushed(const Constants& constants, const State& state, const Problem& problem, Vec measures) noexcept {
    const Index last = held_ports(constants);
    add(1.0, problem.pushed.slice(0, last), measures.slice(0, last));
    const Compliance& matrix = problem.matrix;
    for (Index k = 0; k < matrix.space.size(); ++k)
        if (matrix.space(k, 2) > 0)
            gather(matrix, k, state.slides.corner[NOW], state.slides.along[NOW], problem.pushed, measures);
}

/* Set the measures of points and joints without the unknowns; returns the deepest [m]. */
inline double unforced(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Vec start = problem.start;
    bool averaged = false;
    double deepest = 0.0;
    for (Index i = 0; i < points_of(problem); ++i) {
        const double gap = state.slides.over[i] ? state.slides.free[i] : state.gap[i];
        start[i] = problem.awake(0, i) || state.slides.over[i] ? gap : OPEN;
        deepest = lesser(deepest, start[i]);
        averaged |= state.extra[i] != 0.0;
    }
    for (Index i = points_of(problem); i < held_ports(constants); ++i) start[i] = state.gap[i];
    if (averaged) {
        push_ports(constants, state, problem, constants.inertia, state.extra);
        add_pushed(constants, state, problem, start);
    }
    return deepest;
}

/* Let each joint follow the forces found; what it changes is in `pushed`. */
inline void follow_joints(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Index last = held_ports(constants);
    const auto row = [&](Index i) {
        return constants.columns.slice(constants.pattern.at[i], constants.pattern.at[i] + last);
    };
    for (Index n = 0; n < constants.joints.size(); ++n) {
        const Index i = constants.joints[n];
        const CVec first = row(i), second = row(i + 1);
        const Vec x = state.unknown.slice(i, i + 2);
        const Rod rod{state.rod[constants.joint[i]], {first[i], first[i + 1], second[i], second[i + 1]}};
        const auto [along, up] = held(rod, {x[0], x[1]}, {problem.start[i] + problem.pushed[i],
                                                          problem.start[i + 1] + problem.pushed[i + 1]});
        add(along - x[0], first, problem.pushed.slice(0, last));
        add(up - x[1], second, problem.pushed.slice(0, last));
        x[0] = along, x[1] = up;
    }
}

/* Close the ports that have forces, and open those that are beside their surface or no candidates. */
inline bool keep_closed(const State& state, const Problem& problem) noexcept {
    const ActiveSet& active = problem.active;
    for (Index a = active.size[0] - 1; a >= 0; --a)
        if (!problem.awake(0, active.rows[a])) remove(active, active.rows[a]);
    fill(active.closed[0], false);
    for (Index a = 0; a < active.size[0]; ++a) active.closed(0, active.rows[a]) = true;
    for (Index i = 0; i < points_of(problem); ++i) {
        active.expected[i] = state.unknown[i];
        if (state.unknown[i] != 0.0 && !active.closed(0, i) && !append(problem.matrix, active, i)) return false;
    }
    return true;
}

/* Take the forces of a trial; returns whether they are those that were expected, to `FOLLOWED`. */
inline bool take_forces(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Index first = points_of(problem);
    double change = 0.0, top = 0.0;
    for (Index i = 0; i < first; ++i) {
        const double force = larger(problem.x[i], 0.0), step = force - state.unknown[i];
        if (step == 0.0) continue;
        change = larger(change, std::abs(step));
        top = larger(top, force);
        state.unknown[i] = force;
        for (Index a = first; a < held_ports(constants); ++a)
            problem.pushed[a] += step * constants.columns[constants.pattern.at[i] + a];
    }
    return change <= FOLLOWED * top;
}

/* Find the unknowns and measures of all points and joints; false where ports depend on each other. */
inline bool close_pairs(const Arrays& arrays) noexcept {
    const auto& [constants, state, problem, log] = arrays;
    const Index points = points_of(problem);
    const auto of_points = [&](Vec view) { return view.slice(0, points); };
    if (era_ends(state.slides)) begin_era(state, problem);
    const double deepest = unforced(constants, state, problem);
    for (int trial = 0; trial < TRIALS; ++trial) {
        push_ports(constants, state, problem, constants.columns, state.unknown);
        follow_joints(constants, state, problem);
        copy(problem.start, problem.free);
        add_pushed(constants, state, problem, problem.free);
        if (!keep_closed(state, problem)) return false;
        const Index pivots = solve_lcp(problem.matrix, of_points(problem.free), problem.active, of_points(problem.x),
                                       of_points(problem.y), -PAIR_TOLERANCE * deepest);
        if (pivots < 0) return false;
        state.counts[PIVOTS] += pivots;
        if (take_forces(constants, state, problem)) break;
    }
    follow_joints(constants, state, problem);
    press_surfaces(state);
    bool more = false;
    for (Index i = 0; i < points; ++i) {
        problem.free[i] = state.measure[i] = problem.y[i];
        more = more || (state.unknown[i] > 0.0 && !problem.awake(0, i));
        problem.awake(0, i) = problem.awake(0, i) || state.unknown[i] > 0.0;
    }
    for (Index i = points; i < held_ports(constants); ++i)
        problem.free[i] = state.measure[i] = problem.start[i] + problem.pushed[i];
    if (more) list_candidates(constants, state, problem);
    return true;
}

}  // namespace gudgeon::small
