/* Parts of steps: the motion over them, what ports do in them, and when rigid contact closes or slip ends in one.
 *
 * Bodies fly until the first gap closes; a step is divided there, so that impacts act when and as they happen.
 */
#pragma once
#include "../ports/rows.hpp"
#include "arrays.hpp"

namespace gudgeon::small {

/* Way in a step that is left of a gap when it closes, as a share. */
constexpr double REACHED = 1e-10;
/* Share of its largest speed so far below which a point neither approaches nor parts. */
constexpr double STILL = 1e-9;
/* Share by which friction is below its limit, and slip ends before a part of a step does, where it does. */
constexpr double SLIP_MARGIN = 1e-9;
constexpr double ROUND_OFF = 64 * 0x1p-52;

/* Set what forces of a part of a step do to the measures of ports. */
inline void couple_part(const Constants& whole, const Constants& part, const State& state) noexcept {
    const CVec by_q = part.push[0], by_v = part.push[1];
    const Vec place = state.ends[0], rate = state.ends[1];
    const double step = part.dt[0];
    const Pattern& pattern = whole.pattern;
    for (Index j = 0; j < whole.level.size(); ++j) {
        fill(place, 0.0);
        push(whole.rows, j, 1.0, place);
        for (Index k = 0; k < place.size(); ++k) {
            rate[k] = step * by_v[k] * place[k];
            place[k] *= by_q[k];
        }
        const Index group = pattern.group[j];
        for (Index r = pattern.span(group, 0); r < pattern.span(group, 1); ++r)
            for (Index i = pattern.runs(r, 0); i < pattern.runs(r, 1); ++i) {
                const Index entry = pattern.at[j] + pattern.runs(r, 2) + i;
                const double reach = moved(whole.rows, i, whole.level[i] == VELOCITY ? rate : place);
                part.inertia[entry] = reach;
                part.columns[entry] =
                    whole.share[j] * reach + (whole.level[i] == POSITION ? whole.yields[entry] : 0.0);
            }
    }
}

/* Set the motion of undamped coordinates over a part of a step [s], and what ports do in it. */
inline void retime(const Loop& loop, double step) noexcept {
    const Constants &whole = loop.whole.constants, &part = loop.part.constants;
    const Mat motion = part.motion, pushes = part.push;
    part.dt[0] = step;
    loop.whole.problem.size[1] = -1;
    for (Index k = 0; k < whole.stiffness.size(); ++k) {
        const double squared = whole.stiffness[k], omega = std::sqrt(squared), sine = std::sin(omega * step);
        motion(0, k) = motion(3, k) = std::cos(omega * step);
        motion(1, k) = squared > 0.0 ? sine / omega : step;
        motion(2, k) = -omega * sine;
        const double half = std::sin(0.5 * omega * step);
        pushes(0, k) = squared > 0.0 ? 2.0 * half * half / squared : 0.5 * step * step;
        pushes(1, k) = motion(1, k);
    }
    couple_part(whole, part, loop.whole.state);
}

/* Set where coordinates are at the end of a part of the step with the forces found. */
inline void fall(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Vec place = state.ends[0], rate = state.ends[1], force = state.rest[0];
    fill(force, 0.0);
    for (Index a = 0; a < problem.size[0]; ++a) {
        const Index i = problem.ports[a];
        const double amount = (constants.share[i] < 1.0 ? 0.5 : 1.0) * state.unknown[i] + state.extra[i];
        if (amount != 0.0) push(constants.rows, i, amount, force);
    }
    const CVec by_q = constants.push[0], by_v = constants.push[1];
    for (Index k = 0; k < place.size(); ++k) {
        place[k] = state.q[k] + by_q[k] * force[k];
        rate[k] = state.v[k] + by_v[k] * force[k];
    }
}

/* A bound of W times values of the coordinates of one port, of the size of their round-off. */
inline double speed_bound(const Constants& constants, Index i, CVec values) noexcept {
    double total = 0.0;
    for (Index n = 0; n < 4; ++n) {
        if (constants.norms(n, i) == 0.0) continue;
        const CInts range = constants.parts[constants.near(i, n)];
        const CVec rates = values.slice(range[0], range[1]);
        total += constants.norms(n, i) * std::sqrt(dot(rates, rates));
    }
    return total;
}

/* The speed [m/s] below which a point neither approaches nor parts. */
inline double still(const Constants& constants, const State& state, Index i) noexcept {
    state.swift[i] = larger(state.swift[i], speed_bound(constants, i, state.v));
    return STILL * state.swift[i];
}

/* The gap [m] at which a point touches.  whole: length of the step [s]. */
inline double reached(const Constants& constants, const State& state, Index i, double whole) noexcept {
    const double before = std::abs(moved(constants.rows, i, state.before[1]));
    const double rate = larger(before, std::abs(moved(constants.rows, i, state.ends[1])));
    const double size = std::abs(constants.offset[i]) + speed_bound(constants, i, state.ends[0]);
    return REACHED * whole * rate + ROUND_OFF * size;
}

/* A point whose gap closes, -1 where none does, and when [s]. */
struct Closing {
    Index port;
    double time;
};

/* The point whose gap closes first in a part of the step.  whole: length of the step [s]. */
inline Closing first_closing(const Constants& constants, const State& state, const Problem& problem,
                             double whole) noexcept {
    const double step = constants.dt[0];
    Closing earliest{-1, step};
    for (Index n = 0; n < constants.touching.size(); ++n) {
        const Index i = constants.touching[n];
        if (constants.level[i] != VELOCITY || state.closed[i] || !problem.awake(0, i)) continue;
        double begin = state.displacement(1, i);
        const double speed = moved(constants.rows, i, state.before[1]);
        double end = constants.offset[i] + moved(constants.rows, i, state.ends[0]);
        /* A gap below zero by round-off is none. */
        end -= lesser(0.0, begin);
        begin = larger(0.0, begin);
        const double bend = 2.0 * (end - begin - speed * step) / (step * step);
        const double margin = reached(constants, state, i, whole);
        const bool dips = bend > 0.0 && 0.0 < -speed && -speed < bend * step &&
                          0.5 * speed * speed / bend > begin + margin;
        if (!(end < -margin || dips)) continue;
        const double root = std::sqrt(larger(0.0, speed * speed - 2.0 * bend * begin));
        const double time = speed < 0.0 ? 2.0 * begin / (root - speed) : -(speed + root) / bend;
        if (earliest.port < 0 || time < earliest.time) earliest = {i, time};
    }
    return earliest;
}

/* When the slip of a closed point first ends in a part of the step [s]; sets which does.
 *
 * mobility: velocity of ports per impulse [1/kg].
 * Friction at its limit brakes u' by D from the velocity u0 on, besides what other forces do: u0 = t (D - a). */
inline double first_turning(const Arrays& arrays, CVec mobility) noexcept {
    const auto& [constants, state, problem, log] = arrays;
    const Rows& rows = constants.rows;
    const Pattern& pattern = constants.pattern;
    const double step = constants.dt[0];
    double when = step;
    state.turning[0] = -1;
    for (Index a = 0; a < problem.size[0]; ++a) {
        const Index i = problem.ports[a];
        if (constants.level[i] != VELOCITY || constants.size[i] != 3 || state.unknown[i] == 0.0) continue;
        double first = moved(rows, i + 1, state.before[1]) - constants.belt[i + 1];
        double second = moved(rows, i + 2, state.before[1]) - constants.belt[i + 2];
        const double begin = std::sqrt(first * first + second * second);
        if (begin <= still(constants, state, i)) continue;
        first /= begin, second /= begin;
        double end = first * (moved(rows, i + 1, state.ends[1]) - constants.belt[i + 1]);
        end += second * (moved(rows, i + 2, state.ends[1]) - constants.belt[i + 2]);
        const double brake = -first * state.unknown[i + 1] - second * state.unknown[i + 2];
        const double limit = constants.friction(i, 1) * state.unknown[i];
        double reach = first * first * between(pattern, mobility, i + 1, i + 1);
        reach += second * second * between(pattern, mobility, i + 2, i + 2);
        reach += 2.0 * first * second * between(pattern, mobility, i + 1, i + 2);
        const double left = reach * (limit - brake) + (begin - end) / step;
        if (brake < limit * (1.0 - SLIP_MARGIN) && left > 0.0 && begin / left < when * (1.0 - SLIP_MARGIN)) {
            state.turning[0] = i;
            when = begin / left;
        }
    }
    return when;
}

/* How long after the end of a part of the step a point touches [s]; 0 where it does. */
inline double time_left(const Constants& constants, const State& state, Index i, double whole) noexcept {
    const double gap = constants.offset[i] + moved(constants.rows, i, state.ends[0]);
    const double rate = moved(constants.rows, i, state.ends[1]);
    if (gap <= reached(constants, state, i, whole)) return 0.0;
    return rate < 0.0 ? gap / -rate : whole;
}

}  // namespace gudgeon::small
