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

/* Ports of contacts and joints, which come first, where these are all that respond. */
inline Index held_ports(const Constants& constants) noexcept {
    return constants.touching.size() + 2 * constants.joints.size();
}

/* Call with the ranges of the points of each contact and of the functions below them. */
template <class F>
inline void over_ranges(const Slides& slides, F&& call) noexcept {
    for (Index g = 0; g < slides.ports.size(); ++g) {
        call(slides.ports(g, 0), slides.ports(g, 1));
        call(slides.window(g, 0), slides.window(g, 1));
    }
}

/* Set W q of points that slide, and of the functions below them. */
inline void move_all(const Constants& constants, const Slides& slides, CVec q, Vec out) noexcept {
    over_ranges(slides, [&](Index begin, Index end) {
        Index i = begin;
        for (; i + 4 <= end; i += 4) {
            const Index four[] = {i, i + 1, i + 2, i + 3};
            double ways[4];
            moved_four(constants.rows, four, q, ways);
            for (Index n = 0; n < 4; ++n) out[i + n] = ways[n];
        }
        for (; i < end; ++i) out[i] = moved(constants.rows, i, q);
    });
}

/* Add what listed forces in the residual flexibility, (s, p), do to points that slide and functions below them [m].
 *
 * amounts: work, (p,). */
inline void displace_all(const Constants& constants, const Slides& slides, CMat forces, CInts listed, Vec amounts,
                         Vec out) noexcept {
    const Index count = listed[0], surfaces = slides.functions.size() > 0 ? slides.functions[0] : 0;
    const CInts numbers = listed.slice(1, count + 1);
    const Index others = first_from(numbers, count, surfaces);
    for (Index s = 0; s < forces.size(); ++s) {
        for (Index n = 0; n < count; ++n) amounts[n] = forces(s, numbers[n]);
        over_ranges(slides, [&](Index begin, Index end) {
            Index from = 0, until = count;
            if (constants.paired) { /* But for loads, functions are moved through each other alone. */
                from = begin < surfaces ? 0 : lesser(others, first_from(numbers, count, held_ports(constants)));
                until = begin < surfaces ? others : count;
            }
            const CVec table = constants.residual.turned[s];
            combine_rows(constants.pattern, table,
                         {numbers.slice(from, until), amounts.slice(from, until), until - from}, begin, end, out);
        });
    }
}

/* Set the range of functions below the points of a contact, at the end of the step and at its start. */
inline void set_window(const Slides& slides, Index g) noexcept {
    const Index begin = slides.surface(g, 0), width = slides.surface(g, 1), lines = slides.surface(g, 2);
    Index low = begin + width * lines, high = begin;
    for (Index n = 2 * slides.ports(g, 0); n < 2 * slides.ports(g, 1); ++n) {
        const Index corner = slides.corner(n % 2, n / 2);
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
    const Vec placed = slides.inward[0];
    bool changed = false;
    for (Index g = 0; g < slides.chart.size(); ++g) {
        const double sigma = dot(slides.row[g], state.q);
        changed = changed || sigma != slides.sigma(NOW, g) || sigma != slides.sigma(BEFORE, g);
        slides.sigma(BEFORE, g) = slides.sigma(NOW, g);
        slides.sigma(NOW, g) = sigma;
        const Index begin = slides.window(g, 0), end = slides.window(g, 1);
        turn_weights(slides, g, sigma);
        /* That of others is known. */
        for (Index f = slides.window(g, 0); f < slides.window(g, 1); ++f)
            if (f < begin || f >= end)
                state.response(1, f) = displaced(constants.residual, f, state.held, state.listed);
    }
    move_all(constants, slides, state.q, placed);
    displace_all(constants, slides, state.known, state.listed_known, slides.inward[1], placed);
    for (Index g = 0; g < slides.chart.size(); ++g)
        for (Index i = slides.ports(g, 0); i < slides.ports(g, 1); ++i) {
            slides.free[i] = OPEN;
            if (slides.corner(NOW, i) >= 0)
                slides.free[i] = constants.offset[i] + placed[i] + over(slides, i, NOW, placed);
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
inline void press_surfaces(const State& state) noexcept {
    const Slides& slides = state.slides;
    const CInts functions = slides.functions;
    for (Index n = 0; n < functions.size(); ++n) state.unknown[functions[n]] = state.extra[functions[n]] = 0.0;
    for (Index g = 0; g < slides.ports.size(); ++g)
        for (Index i = slides.ports(g, 0); i < slides.ports(g, 1); ++i) {
            if (state.unknown[i] != 0.0) spread(slides, i, NOW, state.unknown[i], state.unknown);
            if (state.extra[i] != 0.0) spread(slides, i, NOW, state.extra[i], state.extra);
        }
}

/* Set the displacement of points that slide and of functions below them, each by its own rows, by the forces found. */
inline void reach_surfaces(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Slides& slides = state.slides;
    const auto add_port = [&](Index j) {
        const Index at = constants.pattern.at[j];
        if (state.unknown[j] == 0.0 && state.extra[j] == 0.0) return;
        over_ranges(slides, [&](Index begin, Index end) {
            const Vec out = slides.inward[1].slice(begin, end);
            add(state.unknown[j], constants.columns.slice(at + begin, at + end), out);
            if (state.extra[j] != 0.0) add(state.extra[j], constants.inertia.slice(at + begin, at + end), out);
        });
    };
    over_ranges(slides, [&](Index begin, Index end) { fill(slides.inward[1].slice(begin, end), 0.0); });
    for (Index a = 0; a < problem.size[0]; ++a) add_port(problem.ports[a]);
    for (Index g = 0; g < slides.window.size(); ++g)
        for (Index f = slides.window(g, 0); f < slides.window(g, 1); ++f) add_port(f);
}

/* Gap [m] of a point that is no candidate, under the forces found, after `reach_surfaces`. */
inline double found_gap(const Slides& slides, Index i) noexcept {
    return slides.free[i] + slides.inward(1, i) + over(slides, i, NOW, slides.inward[1]);
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
                total += slip[f] * (moved(constants.rows, f, state.q) + state.response(0, f));
        slides.drag[g] = total;
    }
}

}  // namespace gudgeon::small
