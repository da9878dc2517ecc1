/* Collocation of contact forces on exact modal motion.
 *
 * Over a step of length h the force of every contact is the cubic through its values at the four Lobatto points 0,
 * (1 -+ 1/sqrt(5))/2 and 1. The response of the coordinates to such forces is exact, so indentation and rate at the
 * points are linear in the values, and the law at the points gives as many equations as unknowns. Step lengths are
 * H/2^level, so that what depends on h is tabulated once.
 */
#pragma once
#include "../log/energies.hpp"
#include "newton.hpp"

namespace gudgeon::collocation {

/* Why a call ended: the end is passed, the track is full, all contacts are open, a level has no table, no force. */
enum Code { GOING, FULL, OVER, MISSING, FAILED };

/* The error of the step [N], the larger of two estimates; sets depth and rate at its start. */
inline double step_error(const Constants& constants, const Motion& motion, const Trial& trial, double h) noexcept {
    const Mat values = trial.values;
    for (Index i = 0; i < values.size(); ++i) {
        const auto [gap, speed] = gap_and_rate(constants, motion, i);
        trial.depth(i, 0) = -gap - constants.series[i] * values(i, 0);
        double rate = -speed;
        for (Index k = 0; k < POINT_COUNT; ++k) rate -= constants.series[i] * RATES(0, k) * values(i, k) / h;
        trial.rate(i, 0) = rate;
    }
    const double forces = missed(motion.before, motion.clock[LAST], h, values);
    return larger(forces, unbalanced(constants.law, motion.clock[REFERENCE], h, values, trial.depth, trial.rate));
}

/* The largest change [N] of an elastic force by the round-off of its gap. */
inline double round_off(const Constants& constants, const Motion& motion, CMat depth) noexcept {
    double worst = 0.0;
    for (Index i = 0; i < depth.size(); ++i) {
        const CVec row = constants.rows[i];
        double blur = std::abs(constants.gap[i]);
        SIMD_SUM(blur)
        for (Index k = 0; k < motion.y.size(); ++k) blur += std::abs(row[k] * motion.y[k]);
        blur *= std::numeric_limits<double>::epsilon();
        const double deepest = larger(larger(depth(i, 1), depth(i, 2)), depth(i, 3));
        if (blur == 0.0 || deepest < -blur) continue;
        const double low = law_force(constants.law[i], deepest, 0.0, 1.0).force;
        const double high = law_force(constants.law[i], larger(deepest, 0.0) + blur, 0.0, 1.0).force;
        worst = larger(worst, blur * (high - low) / (blur + (high - low) * constants.series[i]));
    }
    return worst;
}

/* Set y [m kg^1/2] and y' to those at the end of the step. */
inline void move(const Table& table, const Constants& constants, const Motion& motion, CMat values) noexcept {
    const Vec y = motion.y, v = motion.v;
    const Index n = y.size();
    const CVec free_0 = table.free[0], free_1 = table.free[1], free_2 = table.free[2], free_3 = table.free[3];
    const CVec drift = table.drift[0], drift_rate = table.drift[1];
    SIMD
    for (Index k = 0; k < n; ++k) {
        const double place = free_0[k] * y[k] + free_1[k] * v[k] + drift[k];
        const double speed = free_2[k] * y[k] + free_3[k] * v[k] + drift_rate[k];
        y[k] = place, v[k] = speed;
    }
    const CMat push = table.push[0], rate = table.push[1];
    for (Index i = 0; i < values.size(); ++i) {
        const CVec row = constants.rows[i], force = values[i];
        const double f0 = force[0], f1 = force[1], f2 = force[2], f3 = force[3];
        SIMD
        for (Index k = 0; k < n; ++k) {
            y[k] += row[k] * (push(0, k) * f0 + push(1, k) * f1 + push(2, k) * f2 + push(3, k) * f3);
            v[k] += row[k] * (rate(0, k) * f0 + rate(1, k) * f1 + rate(2, k) * f2 + rate(3, k) * f3);
        }
    }
}

/* Append a step to the track, and set the motion to that at its end. */
inline void accept(const Table& table, const Constants& constants, const Motion& motion, const Track& track,
                   const Trial& trial, Index count) noexcept {
    const Mat values = trial.values;
    const double h = table.length;
    track.start[count] = motion.clock[TIME], track.length[count] = h;
    copy(motion.y, track.y[count]);
    copy(motion.v, track.v[count]);
    move(table, constants, motion, values);
    for (Index i = 0; i < values.size(); ++i) {
        copy(values[i], track.values[count][i]);
        copy(values[i], motion.before[i]);
        motion.force[i] = values(i, 3);
        motion.clock[REFERENCE] = larger(motion.clock[REFERENCE], values(i, 3));
        track.opening(count, 0, i) = -trial.depth(i, 3), track.opening(count, 1, i) = -trial.rate(i, 3);
    }
    motion.clock[TIME] += h;
    motion.clock[LAST] = h;
    motion.counts[STEPS] += 1;
}

/* Update the energy balance [J]; losses are integrated from forces and rates, independently of the states. */
inline void keep_balance(const Constants& constants, const Motion& motion, const Trial& trial, double h) noexcept {
    const Mat values = trial.values, depth = trial.depth;
    double stored = 0.0;
    for (Index i = 0; i < values.size(); ++i) {
        const CVec law = constants.law[i];
        double given = 0.0;
        for (Index j = 0; j < POINT_COUNT; ++j) given = larger(given, values(i, j));
        if (given == 0.0) {
            /* A surface that recovers without force loses all its energy, however long the step. */
            motion.balance[LOST] += law_energy(law, depth(i, 0)) - law_energy(law, depth(i, 3));
        } else {
            for (Index j = 0; j < POINT_COUNT; ++j) {
                const double deep = depth(i, j), elastic = deep > 0.0 ? law[0] * power_of(deep, law[1]) : 0.0;
                motion.balance[LOST] += h * WEIGHTS[j] * (values(i, j) - elastic) * trial.rate(i, j);
            }
        }
        stored += law_energy(law, depth(i, 3)) + 0.5 * constants.series[i] * values(i, 3) * values(i, 3);
    }
    update_balance(constants, motion.y, motion.v, stored, motion.balance);
}

/* Forget the approach speeds of contacts that are open after the step; true where any is closed. */
inline bool any_closed(const Motion& motion, const Trial& trial) noexcept {
    bool closed = false;
    for (Index i = 0; i < trial.values.size(); ++i) {
        if (trial.values(i, 3) > 0.0 || trial.depth(i, 3) > 0.0) {
            closed = true;
        } else if (trial.depth(i, 3) < 0.0) {
            motion.approach[i] = 0.0;
        }
    }
    return closed;
}

/* The level of the next trial of a step whose error is too large, by its fourth order in h. */
inline Index finer_level(Index level, Index levels, double error, double allowed) noexcept {
    constexpr double endless = std::numeric_limits<double>::infinity();
    const double drop = error < endless ? std::ceil(std::log2(error / allowed) / 4.0) : 1.0;
    return Index(lesser(double(level) + larger(1.0, drop), double(levels - 1)));
}

/* Code, and number of accepted steps. */
struct Marched {
    Code code;
    Index count;
};

/* Advance until contact is over, `end` [s] is passed, the track is full or a level's table is missing. */
inline Marched march(const Tables& tables, const Constants& constants, const Motion& motion, const Track& track,
                     const Trial& trial, double end) noexcept {
    constexpr double endless = std::numeric_limits<double>::infinity();
    const bool adapts = constants.fixed < 0;
    const Index levels = tables.known.size();
    Index count = 0;
    while (true) {
        if (motion.clock[TIME] >= end) return {GOING, count};
        if (count == track.start.size()) return {FULL, count};
        const Index level = motion.level[0];
        if (!tables.known[level]) return {MISSING, count};
        const Table table = table_of(tables, level);
        predict(motion, table.length, trial.guess);
        copy(motion.approach, trial.approach);
        const double top = motion.clock[FASTEST];
        const bool good = solve(table, constants, motion, trial);
        const double error = good ? step_error(constants, motion, trial, table.length) : endless;
        const double allowed = constants.tolerance * motion.clock[REFERENCE];
        /* The part of the error by round-off does not shrink with the step. */
        const bool small = error * 25.0 < allowed || (good && error <= round_off(constants, motion, trial.depth));
        if (adapts && !small && error > allowed) {
            motion.counts[REJECTED] += 1;
            copy(trial.approach, motion.approach);
            motion.clock[FASTEST] = top;
            if (level + 1 >= levels) return {FAILED, count};
            motion.level[0] = finer_level(level, levels, error, allowed);
            continue;
        }
        if (!good) return {FAILED, count};
        track.lost(count, 0) = motion.balance[LOST];
        accept(table, constants, motion, track, trial, count);
        keep_balance(constants, motion, trial, table.length);
        track.lost(count, 1) = motion.balance[LOST];
        count += 1;
        if (adapts && level > 0 && small) motion.level[0] = level - 1;
        if (!any_closed(motion, trial)) return {OVER, count};
    }
}

}  // namespace gudgeon::collocation
