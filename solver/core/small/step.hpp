/* One step, or a part of one: its forces, and what they make of the state. */
#pragma once
#include "../response/sweeps.hpp"
#include "../response/candidates.hpp"
#include "../response/pairs.hpp"
#include "closing.hpp"
#include "ending.hpp"
#include "energy.hpp"
#include "flight.hpp"
#include "rebounds.hpp"

namespace gudgeon::small {

/* Largest number of contact solutions in a step, since its means depend on what opens and closes in it. */
constexpr int PASSES = 6;
constexpr double FAINT = 1e-20;  /* Share of the largest force in a residual flexibility below which there is none. */
constexpr Index REPEATED = 4;  /* Entry of the counts: contact solutions that were repeated. */

/* Find the forces of all candidates; false where the sweeps do not converge. */
inline bool respond(const Arrays& arrays, CMat crank) noexcept {
    const auto& [constants, state, problem, log] = arrays;
    const bool foresees = constants.bounces && !constants.divides;
    bool missed = true;
    const auto found = [&] { return constants.paired ? close_pairs(arrays) : solve(arrays); };
    for (int turn = 0; turn <= PASSES; ++turn) {
        if (missed) {
            list_candidates(constants, state, problem);
            free_measures(constants, state, problem, crank);
        }
        if (turn == PASSES) break;
        if (foresees && missed && keep_open(constants, state, problem)) {
            if (!solve(arrays)) return false;
            foresee(constants, state, problem);
        }
        if (problem.size[0] > 0 && !found()) return false;
        bool unsettled = set_extra(constants, state, problem);
        if (foresees && problem.size[0] > 0) unsettled = shifts_change(constants, state, problem) || unsettled;
        if (constants.slides) press_surfaces(state);
        missed = overlooked(constants, state, problem);
        problem.size[2] = !missed;
        if (!(missed || unsettled)) break;
        state.counts[REPEATED] += 1;
    }
    return true;
}

/* Find the forces of a step or of a part of one; false where the sweeps do not converge.
 *
 * arrays: of whole steps or of parts.  crank: driven points of joints at the end, (j, 4). */
inline bool advance(const Arrays& arrays, const StepLoads& loads, CMat crank) noexcept {
    const auto& [constants, state, problem, log] = arrays;
    aim(constants, state, crank);
    fly(constants, state, loads);
    find_candidates(constants, state, problem);
    return respond(arrays, crank);
}

/* Set the means of candidates and add their impulses, and list those with a force in the step; others have none. */
inline void list_pressed(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Ints forced = state.forced;
    for (Index n = 1; n <= forced[0]; ++n) state.mean[forced[n]] = 0.0;
    Index count = 0;
    for (Index a = 0; a < problem.size[0]; ++a) {
        const Index i = problem.ports[a];
        const double now = state.unknown[i], last = state.last[i], extra = state.extra[i], share = constants.share[i];
        if (now == 0.0 && last == 0.0 && extra == 0.0) continue;
        state.mean[i] = share * now + (1.0 - share) * last + extra;
        state.impulses[i] += constants.dt[0] * state.mean[i];
        forced[++count] = i;
    }
    forced[0] = count;
}

/* Set the mean forces and impulses of the step, and list the ports with forces that respond or are surfaces. */
inline void list_forced(const Constants& constants, const State& state, const Problem& problem) noexcept {
    if (constants.sparse) return list_pressed(constants, state, problem);
    const Vec mean = state.mean, impulses = state.impulses;
    const CVec unknown = state.unknown, last = state.last, extra = state.extra, share = constants.share;
    const CInts kind = constants.kind;
    const Ints forced = state.forced;
    const double dt = constants.dt[0];
    SIMD
    for (Index i = 0; i < mean.size(); ++i) {
        mean[i] = share[i] * unknown[i] + (1.0 - share[i]) * last[i] + extra[i];
        impulses[i] += dt * mean[i];
    }
    Index count = 0;
    for (Index i = 0; i < mean.size(); ++i) {
        const bool acts = (unknown[i] != 0.0) | (last[i] != 0.0) | (extra[i] != 0.0);
        /* Without a branch, which could not be foreseen. */
        forced[count + 1] = i;
        count += acts & (kind[i] != GIVEN);
    }
    forced[0] = count;
}

/* Add the effect of the forces of the step's end to q, its rate and the generalised forces. */
inline void push_state(const Constants& constants, const State& state) noexcept {
    const Vec q = state.q, v = state.v, force = state.force, pressed = state.pressed;
    copy(state.half[0], pressed);
    fill(state.half, 0.0);
    fill(state.rest, 0.0);
    push_ends(constants, state);
    const CVec by_q = constants.push[0], by_v = constants.push[1];
    const CVec half = state.half[0], others = state.half[1], rest = state.rest[0], other_rest = state.rest[1];
    SIMD
    for (Index k = 0; k < q.size(); ++k) {
        const double contacts = half[k] + rest[k], second = contacts + others[k] + other_rest[k];
        pressed[k] += contacts;
        force[k] += second;
        q[k] += by_q[k] * second;
        v[k] += by_v[k] * second;
    }
}

/* Set to zero what has decayed to less than `FAINT` of the largest: it would be listed for hundreds of steps. */
inline void forget_faint(Vec held) noexcept {
    double least = -std::numeric_limits<double>::infinity();
    for (Index i = 0; i < held.size(); ++i) least = larger(least, std::abs(held[i]));
    least *= FAINT;
    SIMD
    for (Index i = 0; i < held.size(); ++i) held[i] = std::abs(held[i]) < least ? 0.0 : held[i];
}

/* Bring the forces in the residual flexibility to the end of the step. */
inline void hold_forces(const Constants& constants, const State& state) noexcept {
    const CVec last = state.last, now = state.unknown;
    if (constants.sparse) {
        Index count = 0;
        for (Index s = 0; s < state.held.size(); ++s) {
            const Vec held = state.held[s];
            for (Index n = 1; n <= state.listed[0]; ++n) held[state.listed[n]] = 0.0;
            for (Index n = 1; n <= state.forced[0]; ++n) held[state.forced[n]] = now[state.forced[n]];
        }
        for (Index n = 1; n <= state.forced[0] && state.held.size() > 0; ++n)
            if (now[state.forced[n]] != 0.0) state.listed[++count] = state.forced[n];
        state.listed[0] = count;
        return;
    }
    for (Index s = 0; s < state.held.size(); ++s) {
        const CMat memory = constants.memory[s];
        const CVec part = memory[0], begin = memory[1], end = memory[2];
        const Vec held = state.held[s];
        SIMD
        for (Index i = 0; i < held.size(); ++i) held[i] = part[i] * held[i] + begin[i] * last[i] + end[i] * now[i];
        if (constants.damped) forget_faint(held);
    }
    list_forces(state.held, state.listed);
}

/* Bring all ports and coordinates to the end of the step [s], and its energies. */
inline void finish(const Arrays& arrays, double time) noexcept {
    const auto& [constants, state, problem, log] = arrays;
    list_forced(constants, state, problem);
    push_state(constants, state);
    if (constants.bounces && !constants.divides) strike(constants, state, problem);
    travelled(constants, state);
    hold_forces(constants, state);
    displace(constants, state, problem);
    if (constants.slides) drag_along(constants, state);
    if (!constants.plain) follow(constants, state, problem, time);
    used_margins(constants, state, problem);
    balance(constants, state, problem);
}

}  // namespace gudgeon::small
