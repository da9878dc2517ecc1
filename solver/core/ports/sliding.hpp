/* Points that slide over traction spaces: rows of the state, as weighted sums of the ports of functions.
 *
 * With weights N(sigma) a point's displacement is u + N e of its own rows and those of the functions; a force on it is
 * one on its own rows and N^T of it on the functions. Weights of the end of a step are known from the motion without
 * the forces of its end: these move points across the line of sliding. N changes the displacement by dN e in a step,
 * whose work a force along the line of sliding gives back in the next one.
 */
#pragma once
#include "../small/arrays.hpp"
#include "rows.hpp"
#include "weights.hpp"

namespace gudgeon::small {

constexpr double OPEN = 1e30;  /* Gap of a point beside its surface [m]; not infinity: zero times it is no number. */

/* Weighted sum of values of ports over the functions that a port touches, 0 where it touches none. */
inline double over(const Slides& slides, Index i, Index moment, CVec values) noexcept {
    const Index corner = slides.corner(moment, i), width = slides.width[i];
    double total = 0.0;
    if (corner >= 0)
        for (Index b = 0; b < 4; ++b) {
            double line = 0.0;
            for (Index a = 0; a < 4; ++a) line += slides.across(i, a) * values[corner + b * width + a];
            total += slides.along(moment, b, i) * line;
        }
    return total;
}

/* Call with each function that a port touches and its weight. */
template <class F>
inline void over_functions(const Slides& slides, Index i, Index moment, F&& call) noexcept {
    const Index corner = slides.corner(moment, i), width = slides.width[i];
    if (corner >= 0)
        for (Index b = 0; b < 4; ++b)
            for (Index a = 0; a < 4; ++a)
                call(corner + b * width + a, slides.along(moment, b, i) * slides.across(i, a));
}

/* Add an amount on a port to values of the functions that it touches, with their weights. */
inline void spread(const Slides& slides, Index i, Index moment, double amount, Vec values) noexcept {
    const Index corner = slides.corner(moment, i), width = slides.width[i];
    if (corner >= 0)
        for (Index b = 0; b < 4; ++b) {
            const double share = amount * slides.along(moment, b, i);
            for (Index a = 0; a < 4; ++a) values[corner + b * width + a] += share * slides.across(i, a);
        }
}

/* Add an amount on a port to values of the functions that it touches, with the slopes of its weights along. */
inline void spread_slope(const Slides& slides, Index i, double amount, Vec values) noexcept {
    const Index corner = slides.corner(NOW, i), width = slides.width[i];
    for (Index b = 0; b < 4; ++b) {
        const double share = amount * slope(slides.along(NOW, 3, i), b);
        for (Index a = 0; a < 4; ++a) values[corner + b * width + a] += share * slides.across(i, a);
    }
}

/* W q of a port with its surface. */
inline double moved_over(const Constants& constants, const Slides& slides, Index i, Index moment, CVec q) noexcept {
    double total = moved(constants.rows, i, q);
    over_functions(slides, i, moment, [&](Index f, double weight) { total += weight * moved(constants.rows, f, q); });
    return total;
}

/* Displacement [m] of a port with its surface by listed forces in the residual flexibility, (s, p). */
inline double displaced_over(const Constants& constants, const Slides& slides, Index i, Index moment, CMat forces,
                             CInts listed) noexcept {
    double total = displaced(constants.residual, i, forces, listed);
    over_functions(slides, i, moment, [&](Index f, double weight) {
        total += weight * displaced(constants.residual, f, forces, listed);
    });
    return total;
}

/* Measure of port i by a force on port j, both with their surfaces, of a table of ports.
 *
 * Where there are surfaces, each row of the table has all ports. */
inline double coupling(const Pattern& pattern, CVec table, const Slides& slides, Index j, Index i) noexcept {
    const auto row = [&](Index n) { return table.slice(pattern.at[n], pattern.at[n] + pattern.at.size()); };
    double total = between(pattern, table, j, i);
    if (slides.corner(NOW, i) >= 0) total += over(slides, i, NOW, row(j));
    over_functions(slides, j, NOW, [&](Index f, double weight) {
        total += weight * (table[pattern.at[f] + i] + over(slides, i, NOW, row(f)));
    });
    return total;
}

/* Set the range of functions below the points of a contact. */
inline void set_window(const Slides& slides, Index g) noexcept {
    const Index begin = slides.surface(g, 0), width = slides.surface(g, 1), lines = slides.surface(g, 2);
    Index low = begin + width * lines, high = begin;
    for (Index i = slides.ports(g, 0); i < slides.ports(g, 1); ++i) {
        const Index corner = slides.corner(NOW, i);
        if (corner < 0) continue;
        const Index line = begin + (corner - begin) / width * width;
        low = lesser(low, line);
        high = larger(high, line + 4 * width);
    }
    slides.window(g, 0) = lesser(low, high);
    slides.window(g, 1) = high;
}

/* Keep the weights of a contact's points at the start of the step, and set those of its end. */
inline void turn_weights(const Slides& slides, Index g, double sigma) noexcept {
    const Index begin = slides.ports(g, 0), end = slides.ports(g, 1);
    const auto along = [&](Index moment, Index b) { return slides.along[moment][b].slice(begin, end); };
    copy(slides.corner[NOW].slice(begin, end), slides.corner[BEFORE].slice(begin, end));
    for (Index b = 0; b < 4; ++b) copy(along(NOW, b), along(BEFORE, b));
    const Places places{slides.height.slice(begin, end), sigma, slides.start.slice(begin, end)};
    const Chart chart{slides.chart(g, 0), slides.chart(g, 1), double(slides.surface(g, 2)) - 4.0, slides.surface(g, 1)};
    weigh(places, chart, slides.corner[NOW].slice(begin, end), along(NOW, 0), along(NOW, 1), along(NOW, 2),
          along(NOW, 3));
    set_window(slides, g);
}

/* Set how far points have slid, their weights, and their gaps without the forces of the step's end [m]; returns whether
 * any weight has changed. */
inline bool slide(const Constants& constants, const State& state) noexcept {
    const Slides& slides = state.slides;
    const auto placed = [&](Index i) {
        return moved(constants.rows, i, state.q) + displaced(constants.residual, i, state.known, state.listed_known);
    };
    bool changed = false;
    for (Index g = 0; g < slides.chart.size(); ++g) {
        const double sigma = dot(slides.row[g], state.q);
        changed = changed || sigma != slides.sigma(NOW, g) || sigma != slides.sigma(BEFORE, g);
        slides.sigma(BEFORE, g) = slides.sigma(NOW, g);
        slides.sigma(NOW, g) = sigma;
        turn_weights(slides, g, sigma);
        for (Index f = slides.window(g, 0); f < slides.window(g, 1); ++f) slides.inward(0, f) = placed(f);
        for (Index i = slides.ports(g, 0); i < slides.ports(g, 1); ++i) {
            slides.free[i] = OPEN;
            if (slides.corner(NOW, i) >= 0)
                slides.free[i] = constants.offset[i] + placed(i) + over(slides, i, NOW, slides.inward[0]);
        }
    }
    return changed;
}

/* Add what a force on a port moves, to a column of the candidates and to the functions below points. */
inline void add_source(CVec source, const Slides& slides, const Problem& problem, double weight, Vec column) noexcept {
    for (Index c = 0; c < problem.size[0]; ++c) column[c] += weight * source[problem.ports[c]];
    for (Index g = 0; g < slides.window.size(); ++g) {
        const Index begin = slides.window(g, 0), end = slides.window(g, 1);
        add(weight, source.slice(begin, end), slides.inward[1].slice(begin, end));
    }
}

/* Set the column of candidate a with the surfaces of all. */
inline void gather_sliding(const Constants& constants, const Slides& slides, const Problem& problem, Index a) noexcept {
    const Index count = problem.size[0], j = problem.ports[a], p = constants.pattern.at.size();
    const auto row = [&](Index n) {
        const Index begin = constants.pattern.at[n];
        return constants.columns.slice(begin, begin + p);
    };
    const Vec column = problem.columns[a];
    fill(column.slice(0, count), 0.0);
    for (Index g = 0; g < slides.window.size(); ++g)
        fill(slides.inward[1].slice(slides.window(g, 0), slides.window(g, 1)), 0.0);
    add_source(row(j), slides, problem, 1.0, column);
    over_functions(slides, j, NOW,
                   [&](Index f, double weight) { add_source(row(f), slides, problem, weight, column); });
    for (Index c = 0; c < count; ++c) column[c] += over(slides, problem.ports[c], NOW, slides.inward[1]);
}

/* Set the forces on functions by those of the points that slide over them. */
inline void press_surfaces(const Constants& constants, const State& state) noexcept {
    const Slides& slides = state.slides;
    const CInts functions = slides.functions;
    for (Index n = 0; n < functions.size(); ++n) state.unknown[functions[n]] = state.extra[functions[n]] = 0.0;
    for (Index g = 0; g < slides.ports.size(); ++g)
        for (Index i = slides.ports(g, 0); i < slides.ports(g, 1); ++i) {
            if (state.unknown[i] != 0.0) spread(slides, i, NOW, state.unknown[i], state.unknown);
            if (state.extra[i] != 0.0) spread(slides, i, NOW, state.extra[i], state.extra);
        }
    for (Index n = 0; n < functions.size(); ++n) {
        const Index f = functions[n];
        if (state.last[f] == 0.0 && state.unknown[f] != 0.0)
            state.response(1, f) = displaced(constants.residual, f, state.held, state.listed);
    }
}

/* Displacement of a port, without its surface, by the forces found [m]. */
inline double given_way(const Constants& constants, const State& state, const Problem& problem, Index i) noexcept {
    const Slides& slides = state.slides;
    const CVec columns = constants.columns, inertia = constants.inertia;
    const CInts at = constants.pattern.at;
    double total = 0.0;
    const auto add_port = [&](Index j) {
        total += columns[at[j] + i] * state.unknown[j] + inertia[at[j] + i] * state.extra[j];
    };
    for (Index a = 0; a < problem.size[0]; ++a) add_port(problem.ports[a]);
    for (Index g = 0; g < slides.window.size(); ++g)
        for (Index f = slides.window(g, 0); f < slides.window(g, 1); ++f) add_port(f);
    return total;
}

/* Set the displacement of the functions by the forces found [m]. */
inline void reach_surfaces(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Slides& slides = state.slides;
    for (Index g = 0; g < slides.window.size(); ++g)
        for (Index f = slides.window(g, 0); f < slides.window(g, 1); ++f)
            slides.inward(1, f) = given_way(constants, state, problem, f);
}

/* Gap [m] of a point that is no candidate, under the forces found, after `reach_surfaces`. */
inline double found_gap(const Constants& constants, const State& state, const Problem& problem, Index i) noexcept {
    const Slides& slides = state.slides;
    return slides.free[i] + given_way(constants, state, problem, i) + over(slides, i, NOW, slides.inward[1]);
}

/* Add the generalised force of the drag of the last step. */
inline void pull_along(const Constants& constants, const State& state, Vec force) noexcept {
    const Slides& slides = state.slides;
    for (Index g = 0; g < slides.drag.size(); ++g)
        if (slides.drag[g] != 0.0) {
            slides.drag_impulse[g] += constants.dt[0] * slides.drag[g];
            add(slides.drag[g], slides.row[g], force);
        }
}

/* Set the displacement of loaded functions by the residual flexibility at the end of the step [m]. */
inline void place_surfaces(const Constants& constants, const State& state) noexcept {
    const CInts functions = state.slides.functions;
    for (Index n = 0; n < functions.size(); ++n) {
        const Index f = functions[n];
        if (state.unknown[f] != 0.0 || state.last[f] != 0.0)
            state.response(0, f) = displaced(constants.residual, f, state.held, state.listed);
    }
}

/* Find the force [N] along the line of sliding on each deformed surface, lambda-bar^T dN e / dsigma.
 *
 * Where dN is round-off, its slope takes the place of the quotient: a quotient of round-off by less is any force. */
inline void drag_along(const Constants& constants, const State& state) noexcept {
    const Slides& slides = state.slides;
    const Vec slip = slides.inward[1];
    for (Index g = 0; g < slides.drag.size(); ++g) {
        const double slid = slides.sigma(NOW, g) - slides.sigma(BEFORE, g), spacing = slides.chart(g, 1);
        const Index begin = slides.surface(g, 0), end = begin + slides.surface(g, 1) * slides.surface(g, 2);
        fill(slip.slice(begin, end), 0.0);
        for (Index i = slides.ports(g, 0); i < slides.ports(g, 1); ++i) {
            if (state.mean[i] == 0.0 || slides.corner(NOW, i) < 0 || slides.corner(BEFORE, i) < 0) continue;
            if (std::abs(slid) > SHORT_SLIDE * spacing) {
                spread(slides, i, NOW, state.mean[i] / slid, slip);
                spread(slides, i, BEFORE, -state.mean[i] / slid, slip);
            } else {
                spread_slope(slides, i, state.mean[i] / spacing, slip);
            }
        }
        double total = 0.0;
        for (Index f = begin; f < end; ++f)
            if (slip[f] != 0.0)
                total += slip[f] * (moved(constants.rows, f, state.q) +
                                    displaced(constants.residual, f, state.held, state.listed));
        slides.drag[g] = total;
    }
}

}  // namespace gudgeon::small
