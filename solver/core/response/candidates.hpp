/* Which ports may respond in a step, and their measures without the forces of the step's end. */
#pragma once
#include "../ports/edges.hpp"
#include "../ports/sliding.hpp"
#include "../small/rebounds.hpp"
#include "../small/retiming.hpp"
#include "margins.hpp"

namespace gudgeon::small {

constexpr double VANISHING = 1e-14;  /* Share of the speeds of a point in rigid contact that is round-off, which no
                                      * force follows. */

/* Whether a block needs its place at the start of a step only once it closes. */
inline bool placed_late(const Constants& constants, Index i) noexcept {
    return (constants.kind[i] == UNILATERAL || constants.kind[i] == CONE) && constants.level[i] == POSITION;
}

/* Set where a block that wakes was at the start of the step [m]. */
inline void place(const Constants& constants, const State& state, Index i) noexcept {
    for (Index b = i; b < i + constants.size[i]; ++b) {
        if (state.slides.over[b]) {
            state.displacement(1, b) = constants.offset[b] + state.response(1, b) +
                                       moved_over(constants, state.slides, b, BEFORE, state.before[0]) +
                                       over(state.slides, b, BEFORE, state.response[1]);
            continue;
        }
        const double response = displaced(constants.residual, b, state.held, state.listed);
        state.response(1, b) = response;
        state.displacement(1, b) = constants.offset[b] + moved(constants.rows, b, state.before[0]) + response;
    }
}

/* Set which ports of contacts may respond in the step. */
inline void find_candidates(const Constants& constants, const State& state, const Problem& problem) noexcept {
    /* What the forces add is foreseen, so that few points are woken after a solution. */
    for (Index part = 0; part < state.travel.size(); ++part) state.lead(1, part) = FORESIGHT * state.lead(0, part);
    look_ahead(constants.parts, state.q, state.before[0], state.travel, state.lead[1], state.ahead);
    if (constants.slides && slide(constants, state)) problem.size[1] = -1;
    if (constants.edged) find_beside(constants, state);
    bound_ways(constants, state.ahead, state.way);
    if (constants.plain) {
        wake(constants.met, state, problem.awake);
        return;
    }
    const CVec margin = state.margin, way = state.way, last = state.last;
    for (Index n = 0; n < constants.touching.size(); ++n) {
        const Index i = constants.touching[n];
        const bool before = problem.awake(0, i);
        bool now = false;
        problem.awake(1, i) = before;
        if (state.slides.over[i]) {
            const bool beside = state.slides.corner(NOW, i) < 0;
            state.slides.left[0] += beside && last[i] != 0.0;
            now = !beside && (last[i] != 0.0 || state.slides.free[i] <= 0.0);
            if (!now) state.unknown[i] = 0.0;
        } else {
            const bool sleeps = margin[i] * (1.0 - SCRATCH) > way[i];
            now = last[i] != 0.0 || !(sleeps || state.beside[i]);
        }
        problem.awake(0, i) = now;
        if (now && !before && !placed_late(constants, i)) place(constants, state, i);
    }
}

/* How many contacts are awake, and whether the list had them. */
struct Awake {
    Index count;
    bool same;
};

/* List the contacts that are awake, where each has one port. */
inline Awake list_awake(CInts touching, CFlags awake, Ints ports) noexcept {
    Index count = 0, others = 0;
    for (Index begin = 0; begin < touching.size(); begin += SCREENED) {
        const Index end = lesser(begin + SCREENED, touching.size());
        const CFlags range = awake.slice(touching[begin], touching[end - 1] + 1);
        bool any = false;
        for (Index k = 0; k < range.size(); ++k) any |= range[k];
        for (Index n = begin; any && n < end; ++n) {
            const Index i = touching[n], before = ports[count]; /* Without a branch, which could not be foreseen. */
            const bool wakes = awake[i];
            others += wakes & (before != i);
            ports[count] = wakes ? i : before;
            count += wakes;
        }
    }
    return {count, others == 0};
}

/* Whether rigid contact stays open without its force; then its unknowns are zero. */
inline bool stays_open(const Constants& constants, const State& state, Index i) noexcept {
    state.closing[i] = -1.0;
    const bool opened = constants.divides ? !state.closed[i]
                                          : constants.offset[i] + moved(constants.rows, i, state.q) > 0.0;
    if (opened)
        for (Index b = i; b < i + constants.size[i]; ++b) state.unknown[b] = 0.0;
    return opened;
}

/* List the candidates; rigid contact is one where its gap closes without it. */
inline void list_candidates(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Ints ports = problem.ports;
    const CFlags awake = problem.awake[0];
    const CInts touching = constants.touching;
    Awake listed{0, true};
    if (constants.plain) listed = list_awake(touching, awake, ports);
    auto [count, same] = listed;
    const auto add_block = [&](Index i) {
        for (Index b = i; b < i + constants.size[i]; ++b) {
            same = same && ports[count] == b;
            ports[count++] = b;
        }
    };
    for (Index n = constants.plain ? touching.size() : 0; n < touching.size(); ++n) {
        const Index i = touching[n];
        if (!awake[i]) continue;
        if (constants.bounces && constants.level[i] == VELOCITY && stays_open(constants, state, i)) continue;
        add_block(i);
    }
    for (Index n = 0; n < constants.always.size(); ++n) add_block(constants.always[n]);
    if (!same || count != problem.size[0]) {
        problem.size[0] = count;
        if (constants.plain) problem.size[1] = -1;
    }
}

/* Set the gaps of points that slide over surfaces, and of those beside their faces. */
inline void set_free(const Constants& constants, const State& state, CInts ports) noexcept {
    if (constants.slides)
        for (Index a = 0; a < ports.size(); ++a)
            if (state.slides.over[ports[a]]) state.gap[ports[a]] = state.slides.free[ports[a]];
    if (constants.edged) clear(constants, state, ports);
}

/* Measure the tangents of a cone from their anchors; one that closes in the step, from where it does.
 *
 * One that forces may still close in it does so at its end. */
inline void touch(const Constants& constants, const State& state, Index i) noexcept {
    const double dt = constants.dt[0];
    const CVec belt = constants.belt, before = state.displacement[1];
    const Vec gap = state.gap, anchor = state.anchor;
    const bool was_open = state.last[i] == 0.0;
    const double begin = before[i], end = gap[i];
    for (Index b = i + 1; b < i + 3; ++b) {
        if (was_open && end > 0.0) {
            anchor[b] = gap[b] - belt[b] * dt;
        } else if (was_open) {
            const double share = begin > 0.0 ? begin / (begin - end) : 0.0;
            anchor[b] = before[b] + share * (gap[b] - before[b]);
            anchor[b] -= share * belt[b] * dt;
        }
        gap[b] -= anchor[b] + belt[b] * dt;
    }
}

/* Set the displacements of the candidates without their forces of the step's end [m]. */
inline void free_displacements(const Constants& constants, const State& state, CInts ports) noexcept {
    const Vec gap = state.gap;
    const CVec offset = constants.offset;
    for (Index a = 0; a < ports.size();) {
        if (four_alike(constants.pattern.group, ports, a)) {
            const Index four[] = {ports[a], ports[a + 1], ports[a + 2], ports[a + 3]};
            double ways[4];
            moved_four(constants.rows, four, state.q, ways);
            for (Index n = 0; n < 4; ++n) gap[four[n]] = offset[four[n]] + ways[n];
            a += 4;
        } else {
            gap[ports[a]] = offset[ports[a]] + moved(constants.rows, ports[a], state.q);
            a += 1;
        }
    }
    if (state.listed_known[0] > 0)
        for (Index a = 0; a < ports.size(); ++a)
            gap[ports[a]] += displaced(constants.residual, ports[a], state.known, state.listed_known);
    set_free(constants, state, ports);
}

/* Take what joints and drives give off their measures.  crank: driven points of joints, (j, 4). */
inline void take_given(const Constants& constants, const State& state, CMat crank) noexcept {
    const double dt = constants.dt[0];
    const Vec gap = state.gap;
    for (Index j = 0; j < constants.joints.size(); ++j)
        for (Index axis = 0; axis < 2; ++axis) {
            const Index i = constants.joints[j] + axis;
            gap[i] -= crank(j, axis);
            if (constants.level[i] == STABILISED)
                gap[i] += 0.5 * dt * (moved(constants.rows, i, state.v) - crank(j, 2 + axis));
        }
    for (Index d = 0; d < constants.drives.size(); ++d) {
        const Index i = constants.drives[d];
        gap[i] -= state.wanted[d];
        if (constants.level[i] == STABILISED) gap[i] += 0.5 * dt * moved(constants.rows, i, state.v);
    }
}

/* Set the measures of rigid contact among the candidates: distances that its velocities give in the step [m]. */
inline void measure_rigid(const Constants& constants, const State& state, CInts ports) noexcept {
    for (Index a = 0; a < ports.size(); ++a) {
        const Index i = ports[a], block = constants.block[i];
        state.shift[i] = 0.0;
        if (constants.level[block] != VELOCITY) continue;
        const double rate = moved(constants.rows, i, state.v);
        double wanted = constants.belt[i];
        state.rate[i] = rate;
        if (constants.divides)
            state.swift[i] = larger(state.swift[i], speed_bound(constants, i, state.v));
        else if (i <= block)
            wanted = rebound(constants, state, i, rate);
        state.gap[i] = constants.dt[0] * (rate - wanted);
        if (constants.divides && std::abs(rate - wanted) <= VANISHING * state.swift[block]) state.gap[i] = 0.0;
    }
}

/* Set the approach of a law that closes in the step [m/s]. */
inline void note_approach(const Constants& constants, const State& state, Index i) noexcept {
    const double before = state.displacement(1, i), rate = (before - state.gap[i]) / constants.dt[0];
    if (before >= 0.0 && state.gap[i] < 0.0 && state.approach[i] <= 0.0) {
        state.fastest[0] = larger(state.fastest[0], rate);
        state.approach[i] = larger(rate, constants.floor * state.fastest[0]);
    }
}

/* Set the measures of the candidates without their forces of the step's end, and the approach of laws. */
inline void free_measures(const Constants& constants, const State& state, const Problem& problem, CMat crank) noexcept {
    const CInts ports = problem.ports.slice(0, problem.size[0]);
    free_displacements(constants, state, ports);
    take_given(constants, state, crank);
    if (constants.bounces) measure_rigid(constants, state, ports);
    for (Index a = 0; a < (constants.plain ? 0 : ports.size()); ++a) {
        const Index i = ports[a], kind = constants.kind[i];
        if (constants.size[i] == 3 && constants.level[i] == POSITION && kind != DRIVEN) {
            if (state.gap[i] <= 0.0 && !problem.awake(1, i) && placed_late(constants, i)) place(constants, state, i);
            touch(constants, state, i);
        }
        if (constants.size[i] > 0 && is_law(kind)) note_approach(constants, state, i);
    }
}

/* Wake the points that the forces found may have closed; whether there are any. */
inline bool overlooked(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const bool enough = add_forces(constants, state, problem);
    if ((!constants.slides || constants.paired) && enough) return false;
    look_ahead(constants.parts, state.q, state.before[0], state.travel, state.lead[0], state.ahead);
    if (constants.slides && !constants.paired) reach_surfaces(constants, state, problem);
    bound_ways(constants, state.ahead, state.way);
    bool wakes = false;
    for (Index n = 0; n < constants.touching.size(); ++n) {
        const Index i = constants.touching[n];
        if (problem.awake(0, i)) continue;
        bool stays = true;
        if (state.slides.over[i])
            stays = constants.paired || state.slides.corner(NOW, i) < 0 ||
                    found_gap(state.slides, i) > 0.0;
        else if (!state.beside[i])
            stays = state.margin[i] * (1.0 - SCRATCH) > state.way[i];
        if (stays) continue;
        problem.awake(0, i) = wakes = true;
        if (!placed_late(constants, i)) place(constants, state, i);
    }
    return wakes;
}

}  // namespace gudgeon::small
