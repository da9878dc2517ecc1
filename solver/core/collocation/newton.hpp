/* The forces of a collocation step: prediction, gaps that depend on them, Newton's method. */
#pragma once
#include "../dense.hpp"
#include "estimate.hpp"

namespace gudgeon::collocation {

inline constexpr Index NEWTON_STEPS = 40;

/* Gap without R [m] and its rate [m/s]. */
struct Gap {
    double gap, rate;
};

inline Gap gap_and_rate(const Constants& constants, const Motion& motion, Index i) noexcept {
    const CVec row = constants.rows[i];
    double gap = constants.gap[i], rate = 0.0;
    SIMD_SUM(gap, rate)
    for (Index k = 0; k < motion.y.size(); ++k) {
        gap += row[k] * motion.y[k];
        rate += row[k] * motion.v[k];
    }
    return {gap, rate};
}

/* Predict the forces [N] at the four points from the cubics of the step before. */
inline void predict(const Motion& motion, double h, Mat guess) noexcept {
    const double last = motion.clock[LAST];
    for (Index i = 0; i < guess.size(); ++i) {
        guess(i, 0) = motion.force[i];
        for (Index j = 1; j < POINT_COUNT; ++j) {
            if (!(last > 0.0 && motion.approach[i] > 0.0)) {
                guess(i, j) = motion.force[i];
                continue;
            }
            const double x = 1.0 + POINTS[j] * h / last;
            double total = 0.0;
            for (Index k = 0; k < POINT_COUNT; ++k) total += motion.before(i, k) * cubic(k, x);
            guess(i, j) = larger(total, 0.0);
        }
    }
}

/* Compute gaps [m] and rates [m/s] at the last three points with the forces of the first point only. */
inline void free_gaps(const Table& table, const Constants& constants, const Motion& motion,
                      const Trial& trial) noexcept {
    const Index c = constants.rows.shape[0], n = constants.rows.shape[1];
    for (Index i = 0; i < c; ++i)
        for (Index j = 0; j < 3; ++j) {
            const CVec gap = table.gap[0][j][i], gap_rate = table.gap[1][j][i];
            double place = constants.gap[i] + table.gap_drift(0, j, i), speed = table.gap_drift(1, j, i);
            SIMD_SUM(place, speed)
            for (Index k = 0; k < n; ++k) {
                place += gap[k] * motion.y[k] + gap[n + k] * motion.v[k];
                speed += gap_rate[k] * motion.y[k] + gap_rate[n + k] * motion.v[k];
            }
            for (Index other = 0; other < c; ++other) {
                place += table.reach[0][i][other](j, 0) * trial.guess(other, 0);
                speed += table.reach[1][i][other](j, 0) * trial.guess(other, 0);
            }
            trial.loose(i, j) = place, trial.loose_rate(i, j) = speed;
        }
}

/* The part of indentation [m] and rate [m/s] at one of the last three points by the forces at these. */
struct Pressed {
    double deep, fast;
};

inline Pressed pressed(const Table& table, const Constants& constants, CMat values, Index i, Index j) noexcept {
    const double h = table.length, series = constants.series[i];
    const CCube reach = table.reach[0][i], reach_rate = table.reach[1][i];
    double deep = -series * values(i, j + 1), fast = 0.0;
    for (Index other = 0; other < values.size(); ++other)
        for (Index k = 1; k < POINT_COUNT; ++k) {
            deep -= reach(other, j, k) * values(other, k);
            fast -= reach_rate(other, j, k) * values(other, k);
        }
    for (Index k = 0; k < POINT_COUNT; ++k) fast -= series * RATES(j + 1, k) * values(i, k) / h;
    return {deep, fast};
}

/* Set the approach speed [m/s] of contacts that close in the step, at the zero of the predicted gap. */
inline void set_approach(const Table& table, const Constants& constants, const Motion& motion,
                         const Trial& trial) noexcept {
    for (Index i = 0; i < trial.loose.size(); ++i) {
        if (motion.approach[i] > 0.0) continue;
        auto [gap, rate] = gap_and_rate(constants, motion, i);
        for (Index j = 0; j < 3; ++j) {
            const auto [deep, fast] = pressed(table, constants, trial.guess, i, j);
            const double later = trial.loose(i, j) - deep, later_rate = trial.loose_rate(i, j) - fast;
            if (later < 0.0) {
                /* Under constant forces the square of the speed is linear in the displacement. */
                const double share = gap > 0.0 ? gap / (gap - later) : 0.0;
                const double square = rate * rate + share * (later_rate * later_rate - rate * rate);
                const double speed = std::sqrt(larger(square, 0.0));
                motion.clock[FASTEST] = larger(motion.clock[FASTEST], speed);
                motion.approach[i] = larger(speed, constants.floor * motion.clock[FASTEST]);
                break;
            }
            gap = later, rate = later_rate;
        }
    }
}

/* Set the residual of the laws [N], (3 c,), and its derivative by the force values, (3 c, 3 c). */
inline void linearise(const Table& table, const Constants& constants, const Motion& motion,
                      const Trial& trial) noexcept {
    const Index c = trial.values.size();
    for (Index i = 0; i < c; ++i) {
        const double series = constants.series[i];
        const CCube reach = table.reach[0][i], reach_rate = table.reach[1][i];
        for (Index j = 0; j < 3; ++j) {
            const auto [force, by_depth, by_rate] =
                law_force(constants.law[i], trial.depth(i, j + 1), trial.rate(i, j + 1), motion.approach[i]);
            const Index row = 3 * i + j;
            const Vec entries = trial.matrix[row];
            trial.wrong[row] = trial.values(i, j + 1) - force;
            for (Index other = 0; other < c; ++other)
                for (Index k = 1; k < POINT_COUNT; ++k)
                    entries[3 * other + k - 1] = by_depth * reach(other, j, k) + by_rate * reach_rate(other, j, k);
            for (Index k = 1; k < POINT_COUNT; ++k)
                entries[3 * i + k - 1] += by_rate * series * RATES(j + 1, k) / table.length;
            entries[row] += 1.0 + by_depth * series;
        }
    }
}

/* Compute the forces [N] at the last three points by Newton's method; false where it does not converge. */
inline bool solve(const Table& table, const Constants& constants, const Motion& motion, const Trial& trial) noexcept {
    const Mat values = trial.values;
    const Index c = values.size();
    free_gaps(table, constants, motion, trial);
    set_approach(table, constants, motion, trial);
    for (Index i = 0; i < c; ++i) copy(trial.guess[i], values[i]);
    for (Index iteration = 0; iteration < NEWTON_STEPS; ++iteration) {
        motion.counts[ITERATIONS] += 1;
        for (Index i = 0; i < c; ++i)
            for (Index j = 0; j < 3; ++j) {
                const auto [deep, fast] = pressed(table, constants, values, i, j);
                trial.depth(i, j + 1) = deep - trial.loose(i, j);
                trial.rate(i, j + 1) = fast - trial.loose_rate(i, j);
            }
        linearise(table, constants, motion, trial);
        if (!eliminate(trial.matrix, trial.wrong)) return false;
        double largest = 0.0, step = 0.0;
        for (Index i = 0; i < c; ++i)
            for (Index j = 0; j < 3; ++j) {
                const double change = trial.wrong[3 * i + j];
                largest = larger(largest, std::abs(values(i, j + 1)));
                step = larger(step, std::abs(change));
                values(i, j + 1) = larger(values(i, j + 1) - change, 0.0);
            }
        if (step <= 1e-13 * larger(largest, motion.clock[REFERENCE])) return true;
    }
    return false;
}

}  // namespace gudgeon::collocation
