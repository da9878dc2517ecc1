/* Impacts of rigid contact that closes within a step.
 *
 * What touches when the first gap closes, and approaches, rebounds by Newton's law, u'+ + e u'- >= 0 complementary to
 * its impulse, with Coulomb's cone for friction, together with all that is closed. A point that rebounds again within
 * `COLLAPSE` of a step stays closed.
 */
#pragma once
#include "../log/extremes.hpp"
#include "../log/jumps.hpp"
#include "../response/sweeps.hpp"
#include "energy.hpp"
#include "retiming.hpp"

namespace gudgeon::small {

/* Share of a step within which a point that rebounds again stays closed: rebounds follow each other without end. */
constexpr double COLLAPSE = 1e-6;

/* Close rigid contact that touches and does not part; returns whether any of it approaches.
 *
 * whole: length of the step [s]. */
inline bool close_touching(const Constants& constants, const State& state, const Problem& problem,
                           double whole) noexcept {
    bool strikes = false;
    copy(state.q, state.ends[0]);
    copy(state.v, state.ends[1]);
    copy(state.v, state.before[1]);
    for (Index n = 0; n < constants.touching.size(); ++n) {
        const Index i = constants.touching[n];
        if (constants.level[i] != VELOCITY || !problem.awake(0, i)) continue;
        if (!state.closed[i] && !(state.displacement(0, i) <= reached(constants, state, i, whole))) continue;
        const double rate = moved(constants.rows, i, state.v), least = still(constants, state, i);
        strikes = strikes || rate < -least;
        state.closed[i] = state.closed[i] || rate <= least;
    }
    return strikes;
}

/* List rigid contact that touches, with what it asks for, where any of it approaches; returns whether any does. */
inline bool list_touching(const Loop& loop, double time) noexcept {
    const auto& [constants, state, problem, log] = loop.impact;
    const double whole = loop.whole.constants.dt[0];
    if (!close_touching(constants, state, problem, whole)) return false;
    Index count = 0;
    for (Index n = 0; n < constants.touching.size(); ++n) {
        const Index i = constants.touching[n];
        if (!state.closed[i] || constants.level[i] != VELOCITY) continue;
        const double rate = moved(constants.rows, i, state.v), least = still(constants, state, i);
        const bool bounces = rate < -least && time - state.since[i] > COLLAPSE * whole;
        state.rate[i] = rate;
        state.gap[i] = rate + (bounces ? constants.restitution[i] * rate : 0.0);
        for (Index b = i; b < i + constants.size[i]; ++b) {
            if (b > i) {
                state.rate[b] = moved(constants.rows, b, state.v);
                state.gap[b] = state.rate[b] - constants.belt[b];
            }
            state.foreseen[b] = state.unknown[b];
            state.unknown[b] = 0.0;
            problem.ports[count] = b;
            count += 1;
        }
    }
    problem.size[0] = count, problem.size[1] = -1;
    return true;
}

/* Add the work of impulses [J] on each rigid coordinate and on all, and update the largest exchange.
 *
 * change: of the rates of all coordinates. */
inline void exchange_impulses(const Constants& constants, const State& state, CVec change) noexcept {
    const Vec work = state.work, v = state.v;
    const Index count = constants.rigid.size();
    double total = 0.0;
    for (Index n = 0; n < count; ++n) {
        const Index k = constants.rigid[n];
        work[n] += change[k] * (v[k] - 0.5 * change[k]);
    }
    for (Index k = 0; k < change.size(); ++k) total += change[k] * (v[k] - 0.5 * change[k]);
    work[count] += total;
    note_exchange(work, state.parts[CONTACT], state.extreme);
}

/* Account for the energies of impulses [N s], after bodies have been moved by them. */
inline void account_impulses(const Constants& constants, const State& state, const Problem& problem,
                             CVec impulses) noexcept {
    double lost = 0.0, taken = 0.0;
    for (Index a = 0; a < problem.size[0]; ++a) {
        const Index i = problem.ports[a];
        state.impulses[i] += impulses[i];
        state.sudden_impulses(0, i) += impulses[i];
        const double middle = 0.5 * (state.rate[i] + moved(constants.rows, i, state.v));
        const double port_loss = -impulses[i] * (middle - constants.belt[i]);
        lost += port_loss;
        state.parts[WORK] += impulses[i] * constants.belt[i];
        if (constants.block[i] != i)
            state.rubbed[constants.contact[i]] += port_loss;
        else
            taken -= 0.5 * impulses[i] * lesser(0.0, state.rate[i]) / (1.0 + constants.restitution[i]);
    }
    state.extreme[EXCHANGED] = larger(state.extreme[EXCHANGED], taken);
    state.parts[KINETIC] = 0.5 * dot(state.v, state.v);
    /* No impact creates energy: that of a wrong impulse shall appear as drift. */
    if (lost > 0.0) state.parts[DISSIPATED] += lost;
}

/* Note the impulses in the log of impacts, and what parts. */
inline void note_impulses(const Arrays& arrays, CVec impulses, Index number, double time) noexcept {
    const auto& [constants, state, problem, log] = arrays;
    for (Index a = 0; a < problem.size[0]; ++a) {
        const Index i = problem.ports[a], k = constants.contact[i];
        if (constants.block[i] != i) continue;
        if (impulses[i] != 0.0) {
            note_impact(log, k, number, time, state.rate[i]);
            state.since[i] = time;
            for (Index axis = 0; axis < 3; ++axis)
                add_jump(log, k, axis, impulses[i] * constants.direction(i, axis));
        }
        state.closed[i] = moved(constants.rows, i, state.v) <= still(constants, state, i);
    }
    for (Index k = 0; k < log.force.size(); ++k) {
        bool touches = false;
        double opening = 0.0;
        for (Index a = 0; a < problem.size[0]; ++a) {
            const Index i = problem.ports[a];
            if (constants.contact[i] != k || constants.block[i] != i) continue;
            touches = touches || state.closed[i];
            if (impulses[i] != 0.0) opening = larger(opening, moved(constants.rows, i, state.v));
        }
        if (opening > 0.0 && !touches) note_change(log, k, false, time, 0.0, opening);
    }
}

/* Move bodies by the impulses found, account for them, and see what parts. */
inline void strike_at_once(const Arrays& arrays, Index number, double time) noexcept {
    const auto& [constants, state, problem, log] = arrays;
    const Vec impulses = state.sudden_impulses[1], change = state.rest[0];
    fill(change, 0.0);
    for (Index a = 0; a < problem.size[0]; ++a) {
        const Index i = problem.ports[a];
        if (impulses[i] != 0.0) push(constants.rows, i, impulses[i], change);
    }
    add(1.0, change, state.v);
    exchange_impulses(constants, state, change);
    account_impulses(constants, state, problem, impulses);
    note_impulses(arrays, impulses, number, time);
}

/* Let all rigid contact that touches and approaches rebound; false where the impulses are not found.
 *
 * number: of the step.  time: [s]. */
inline bool collide(const Loop& loop, Index number, double time) noexcept {
    const auto& [constants, state, problem, log] = loop.whole;
    if (!list_touching(loop, time)) return true;
    const Index count = problem.size[0];
    const bool sound = solve(loop.impact);
    for (Index a = 0; a < count; ++a) {
        const Index i = problem.ports[a];
        state.sudden_impulses(1, i) = state.unknown[i];
        state.unknown[i] = state.foreseen[i];
    }
    if (sound) strike_at_once(loop.whole, number, time);
    problem.size[0] = 0, problem.size[1] = -1;
    return sound;
}

}  // namespace gudgeon::small
