/* Steps that are divided where rigid contact closes. */
#pragma once
#include "impacts.hpp"
#include "../log/resultants.hpp"
#include "step.hpp"

namespace gudgeon::small {

/* Largest number of parts of a step, and of trials to find where rigid contact closes. */
constexpr int MOST_PARTS = 20'000, MOST_TRIALS = 100;
/* Share of a step that is round-off of its parts. */
constexpr double SHORTEST = 1e-14;

/* Keep what a trial of a part of a step changes. */
inline void keep_approach(const State& state) noexcept {
    const Index count = state.approach.size();
    copy(state.approach, state.kept.slice(0, count));
    state.kept[count] = state.fastest[0];
}

/* Go back to the start of a part of the step. */
inline void restore_part(const State& state, const Problem& problem) noexcept {
    const Index count = state.approach.size();
    copy(state.last, state.unknown);
    copy(state.before[0], state.q);
    copy(state.before[1], state.v);
    copy(state.kept.slice(0, count), state.approach);
    state.fastest[0] = state.kept[count];
    copy(problem.awake[1], problem.awake[0]);
}

/* Set the means of given loads in a part of the step and at its end [N], by the parabola through the whole step.
 *
 * loads: of the whole step.  done: what is done of it [s].  dt: its length [s]. */
inline void share_loads(const Constants& constants, const State& state, const StepLoads& loads, double done,
                        double dt) noexcept {
    const double s = done / dt, e = (done + constants.dt[0]) / dt;
    for (Index n = 0; n < loads.count(); ++n) {
        const double mean = loads.mean[n], end = loads.end[n];
        const double begin = mean == end ? end : state.begun[constants.given[n]];
        const double bend = 3.0 * (begin + end - 2.0 * mean), slope = end - begin - bend;
        state.loads(0, n) = begin + 0.5 * slope * (s + e) + bend * (s * s + s * e + e * e) / 3.0;
        state.loads(1, n) = begin + (slope + bend * e) * e;
    }
}

/* Arrays for a step or for a part of it. */
inline const Arrays& arrays_of(const Loop& loop, bool divided) noexcept { return divided ? loop.part : loop.whole; }

/* Find the forces up to where the first rigid contact closes, and how long that takes [s]; 0 where none are found.
 *
 * divided: whether the step has been divided, so that what is left of it is a part; true on exit where it is divided
 * here.  loads: of the whole step.  done: what is done of it [s].  length: what is left of it [s]. */
inline double find_part(const Loop& loop, bool divided, const StepLoads& loads, double done, double length) noexcept {
    const State& state = loop.whole.state;
    const Problem& problem = loop.whole.problem;
    const double dt = loop.whole.constants.dt[0];
    const StepLoads part_loads{state.loads[0], state.loads[1]};
    double low = 0.0, high = length;
    Index hit = -1;
    state.turning[0] = -1;
    keep_approach(state);
    for (int turn = 0; turn < MOST_TRIALS; ++turn) {
        if (turn > 0) {
            restore_part(state, problem);
            divided = true;
            retime(loop, length);
        }
        const Arrays& arrays = arrays_of(loop, divided);
        const Constants& constants = arrays.constants;
        share_loads(constants, state, loads, done, dt);
        if (!advance(arrays, part_loads, state.pin)) return 0.0;
        fall(constants, state, problem);
        const auto [port, closes] = first_closing(constants, state, problem, dt);
        double time = closes;
        if (port >= 0) {
            hit = port, high = length;
            state.turning[0] = -1;
        } else {
            const double left = hit >= 0 ? time_left(constants, state, hit, dt) : 0.0;
            if (left == 0.0 && state.turning[0] < 0) {
                time = first_turning(arrays, loop.impact.constants.columns);
                if (state.turning[0] >= 0) {
                    hit = -1, high = length, length = time;
                    continue;
                }
            }
            if (left == 0.0 || high - low < SHORTEST * dt) return length;
            low = length;
            time = length + left;
        }
        length = low < time && time < high ? time : 0.5 * (low + high);
    }
    return 0.0;
}

/* Take a step, divided where rigid contact closes; false where forces are not found, or parts are too many. */
inline bool divide_step(const Loop& loop, const StepLoads& loads, Index number) noexcept {
    const State& state = loop.whole.state;
    const Problem& problem = loop.whole.problem;
    const double dt = loop.whole.constants.dt[0], start = double(number) * dt;
    double done = 0.0;
    bool sound = true;
    copy(state.unknown, state.begun);
    fill(state.total, 0.0);
    fill(state.sudden_impulses[0], 0.0);
    for (int turn = 0; turn < MOST_PARTS; ++turn) {
        if (!collide(loop, number, start + done)) return false;
        double length = dt - done;
        if (!(length > SHORTEST * dt)) break;
        if (turn > 0) retime(loop, length);
        length = find_part(loop, turn > 0, loads, done, length);
        if (!(length > 0.0)) return false;
        finish(arrays_of(loop, length != dt), start + done + length);
        if (state.turning[0] >= 0) state.sliding[state.turning[0]] = false;
        note_part(loop.whole, start + done, length);
        done += length;
        add(length, state.mean, state.total);
        sound = turn + 1 < MOST_PARTS;
        if (length != dt) problem.size[1] = -1;
    }
    for (Index i = 0; i < state.mean.size(); ++i) state.mean[i] = (state.total[i] + state.sudden_impulses(0, i)) / dt;
    log_parts(loop.whole, number);
    return sound;
}

}  // namespace gudgeon::small
