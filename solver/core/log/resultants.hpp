/* Resultants of contacts of the loop over ports, and the log of their impacts. */
#pragma once
#include "../ports/sliding.hpp"
#include "../response/sweeps.hpp"
#include "../small/ending.hpp"
#include "../small/retiming.hpp"
#include "impacts.hpp"

namespace gudgeon::small {

/* Add a normal force [N] of port i to the resultant of its contact, and keep the port with the largest one. */
inline void add_normal(const Constants& constants, const State& state, const ImpactLog& log, Index i,
                       double force) noexcept {
    const Index k = constants.contact[i];
    for (Index axis = 0; axis < 3; ++axis) log.force(k, axis) += force * constants.direction(i, axis);
    if (state.unknown[i] > state.unknown[log.steps(k, ROW)]) log.steps(k, ROW) = i;
}

/* Whether a port is the normal one of a point of a contact. */
inline bool is_normal(const Constants& constants, Index i) noexcept {
    return constants.contact[i] >= 0 && constants.block[i] == i;
}

/* Whether port i touches at the end of a step: a law until its gap opens, or its force ends that has a dashpot.
 *
 * The unknown of a law alone is the mean of the step, and one that recovers slowly has no force but round-off. */
inline bool touches(const Constants& constants, const State& state, Index i) noexcept {
    if (!is_law(constants.kind[i])) return state.unknown[i] > 0.0;
    const bool closed = state.displacement(0, i) < 0.0 && !state.beside[i];
    return closed && (state.unknown[i] > 0.0 || constants.law(i, 3) == 0.0);
}

/* Note that contact k begins to touch or parts at the end of a step of some length [s]. */
inline void note_gap(const Constants& constants, const State& state, const ImpactLog& log, Index k, bool acts,
                     double time, double length) noexcept {
    const Index i = log.steps(k, ROW);
    if (acts && is_law(constants.kind[i]) && state.displacement(1, i) >= 0.0) {
        const auto [share, speed] = approach_of(constants, state, i);
        note_change(log, k, true, time - (1.0 - share) * length, 0.0, -speed);
    } else if (!acts && is_law(constants.kind[i]) && state.displacement(0, i) >= 0.0) {
        const auto [share, speed] = departure_of(constants, state, i);
        note_change(log, k, false, time - (1.0 - share) * length, 0.0, speed);
    } else if (acts) {
        const double rate = moved_over(constants, state.slides, i, BEFORE, state.before[1]);
        note_change(log, k, true, time, state.displacement(1, i) + length * rate, rate);
    } else {
        /* The rate changes in the step since it parted. */
        const double end = moved_over(constants, state.slides, i, NOW, state.v), gap = state.displacement(0, i);
        const double begin = moved_over(constants, state.slides, i, BEFORE, state.before[1]);
        const double since = end > 0.0 && gap > 0.0 ? lesser(1.0, gap / (end * length)) : 0.0;
        note_change(log, k, false, time, gap, end - since * (end - begin));
    }
}

/* Add the normal forces of a step to the log of impacts, and note what begins to touch and what parts.
 *
 * The force over a step in which rigid contact strikes is an impulse over it, no force that could be the largest. */
inline void log_forces(const Constants& constants, const State& state, const Problem& problem, const ImpactLog& log,
                       Index number) noexcept {
    const Index contacts = log.force.size();
    const double dt = constants.dt[0], time = double(number + 1) * dt;
    for (Index k = 0; k < contacts; ++k) state.acting[k] = 0.0, state.struck[k] = false;
    Index active = 0;
    for (Index n = 1; n <= state.forced[0]; ++n) {
        const Index i = state.forced[n], k = constants.contact[i];
        if (!is_normal(constants, i)) continue;
        if (touches(constants, state, i)) state.acting[k] = 1.0;
        if (state.mean[i] == 0.0) continue;
        active += 1;
        state.struck[k] = state.struck[k] || state.closing[i] >= 0.0;
        add_normal(constants, state, log, i, state.mean[i]);
    }
    for (Index a = 0; a < (constants.plain ? 0 : problem.size[0]); ++a) {
        const Index i = problem.ports[a];
        const bool normal_law = is_normal(constants, i) && is_law(constants.kind[i]);
        if (normal_law && touches(constants, state, i)) state.acting[constants.contact[i]] = 1.0;
    }
    state.counts[ACTIVE] = active;
    if (active > 0) state.counts[CONTACT_STEPS] += 1;
    if (active == 0 && log.counts[GOING] == 0) return;
    for (Index k = 0; k < contacts; ++k) {
        const bool acts = state.acting[k] > 0.0;
        if (changes(log, k, acts)) note_gap(constants, state, log, k, acts, time, dt);
    }
    for (Index k = 0; k < contacts; ++k) {
        const bool going = log.steps(k, FIRST) >= 0;
        state.peak(k, 0) = going ? log.running(k, PEAK) : 0.0;
        state.peak(k, 1) = going ? log.running(k, PEAK_TIME) : (double(number) + 0.5) * dt;
    }
    log_step(log, number);
    for (Index k = 0; k < contacts; ++k)
        if (state.struck[k]) log.running(k, PEAK) = state.peak(k, 0), log.running(k, PEAK_TIME) = state.peak(k, 1);
}

/* Add the normal forces of a part of a step to the log of impacts, and note what begins to touch and what parts.
 *
 * start, length: of the part [s]. */
inline void note_part(const Arrays& arrays, double start, double length) noexcept {
    const auto& [constants, state, problem, log] = arrays;
    const Index contacts = log.force.size();
    fill(state.acting, 0.0);
    Index active = 0;
    for (Index a = 0; a < problem.size[0]; ++a) {
        const Index i = problem.ports[a], k = constants.contact[i];
        if (!is_normal(constants, i)) continue;
        const bool rigid = constants.level[i] == VELOCITY;
        /* What an impact's solution leaves of an approach, the next step takes away, by round-off over its length. */
        const bool left = rigid && state.unknown[i] * length <= TOLERANCE * state.impulses[i];
        if (!left && touches(constants, state, i)) state.acting[k] = 1.0;
        if (state.mean[i] != 0.0 && !left) {
            active += 1;
            add_normal(constants, state, log, i, state.mean[i] * length / constants.dt[0]);
        }
        if (rigid) { /* It stays closed where it rests without a force. */
            const double rate = moved(constants.rows, i, state.v);
            state.closed[i] = state.unknown[i] > 0.0 || rate <= still(constants, state, i);
        }
    }
    state.counts[ACTIVE] = active;
    for (Index k = 0; k < contacts; ++k) {
        const bool acts = state.acting[k] > 0.0;
        if (!changes(log, k, acts)) continue;
        const Index i = log.steps(k, ROW);
        if (constants.level[i] == VELOCITY)
            note_change(log, k, acts, start, 0.0, moved(constants.rows, i, state.before[1]));
        else
            note_gap(constants, state, log, k, acts, start + length, length);
    }
}

/* Log the forces of a step of many parts. */
inline void log_parts(const Arrays& arrays, Index number) noexcept {
    const auto& [constants, state, problem, log] = arrays;
    bool acts = false;
    for (Index k = 0; k < log.force.size(); ++k) acts = acts || pressed(log, k);
    for (Index i = 0; i < state.mean.size(); ++i) acts = acts || (state.mean[i] != 0.0 && constants.contact[i] >= 0);
    if (acts) state.counts[CONTACT_STEPS] += 1;
    if (acts || log.counts[GOING] > 0) log_step(log, number);
}

}  // namespace gudgeon::small
