/* Margins of open points: how far bodies can have come since a gap was found, by the path of their coordinates. */
#pragma once
#include "../ports/rows.hpp"
#include "../small/arrays.hpp"

namespace gudgeon::small {

constexpr double SCRATCH = 1e-13;  /* Share of its margin by which a sleeping point is round-off from waking. */
constexpr Index SCREENED = 32;     /* Points that are looked at together: most sleep. */
constexpr double FORESIGHT = 2.0;  /* What the forces of a step are expected to add to the paths, over what those of the
                                    * last step did. */

/* Add to the paths what the forces found of the step's end do to the coordinates. */
inline void add_pushes(const Constants& constants, const State& state, Vec lead) noexcept {
    const CMat norms = constants.norms;
    const CIntMat near = constants.near;
    for (Index group = 0; group < constants.groups.size(); ++group) {
        const Index begin = constants.groups(group, 0), end = constants.groups(group, 1);
        const CVec reach = constants.farthest.slice(begin, end), share = constants.share.slice(begin, end);
        const CVec now = state.unknown.slice(begin, end), more = state.extra.slice(begin, end);
        const CVec a = norms[0].slice(begin, end), b = norms[1].slice(begin, end);
        const CVec c = norms[2].slice(begin, end), d = norms[3].slice(begin, end);
        double one = 0.0, two = 0.0, three = 0.0, four = 0.0;
        SIMD_SUM(one, two, three, four)
        for (Index k = 0; k < now.size(); ++k) {
            const double amount = reach[k] * std::abs(share[k] * now[k] + more[k]);
            one += amount * a[k];
            two += amount * b[k];
            three += amount * c[k];
            four += amount * d[k];
        }
        lead[near(begin, 0)] += one;
        lead[near(begin, 1)] += two;
        lead[near(begin, 2)] += three;
        lead[near(begin, 3)] += four;
    }
}

/* Add to the paths sum |dr| of the step on each body. */
inline void add_yields(const Constants& constants, const State& state, Vec lead) noexcept {
    const Index sides = state.held.size(), parts = constants.parts.size();
    for (Index s = 0; s < sides; ++s) {
        const CMat memory = constants.memory[s];
        for (Index group = 0; group < constants.groups.size(); ++group) {
            const Index begin = constants.groups(group, 0), end = constants.groups(group, 1);
            const CVec stays = memory[0].slice(begin, end), by_last = memory[1].slice(begin, end);
            const CVec by_now = memory[2].slice(begin, end), held = state.held[s].slice(begin, end);
            const CVec last = state.last.slice(begin, end), now = state.unknown.slice(begin, end);
            double total = 0.0;
            SIMD_SUM(total)
            for (Index k = 0; k < held.size(); ++k)
                total += std::abs((stays[k] - 1.0) * held[k] + by_last[k] * last[k] + by_now[k] * now[k]);
            for (Index side = 0; side < 2; ++side)
                if (constants.sides(begin, side) >= 0 && (side == s || sides == 1))
                    lead[parts + constants.sides(begin, side)] += total;
        }
    }
}

/* Add both where forces are those of the candidates; r is the force. */
inline void add_pressed(const Constants& constants, const State& state, const Problem& problem, Vec lead) noexcept {
    const Index sides = state.held.size(), parts = constants.parts.size();
    for (Index a = 0; a < problem.size[0]; ++a) {
        const Index i = problem.ports[a];
        const double now = state.unknown[i], last = state.last[i];
        if (now == 0.0 && last == 0.0 && state.extra[i] == 0.0) continue;
        const double amount = constants.farthest[i] * std::abs(constants.share[i] * now + state.extra[i]);
        for (Index n = 0; n < 4; ++n) lead[constants.near(i, n)] += amount * constants.norms(n, i);
        for (Index side = 0; side < 2 && sides > 0; ++side)
            if (constants.sides(i, side) >= 0) lead[parts + constants.sides(i, side)] += std::abs(now - last);
    }
}

/* Set what the forces found add to the paths: of the step's end to coordinates, and sum |dr| of the step; returns
 * whether that is as much as was allowed for. */
inline bool add_forces(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Vec lead = state.lead[0];
    fill(lead, 0.0);
    if (constants.sparse) {
        add_pressed(constants, state, problem, lead);
    } else {
        add_pushes(constants, state, lead);
        add_yields(constants, state, lead);
    }
    bool enough = true;
    for (Index part = 0; part < lead.size(); ++part) enough = enough && lead[part] <= state.lead(1, part);
    return enough;
}

/* Set the paths up to the end of the step; what r changes in it was found with its forces. */
inline void travelled(const Constants& constants, const State& state) noexcept {
    const Index parts = constants.parts.size();
    for (Index part = 0; part < state.travel.size(); ++part) /* That of the coordinates by forces is in them. */
        state.lead(1, part) = part >= parts ? state.lead(0, part) : 0.0;
    look_ahead(constants.parts, state.q, state.before[0], state.travel, state.lead[1], state.ahead);
    copy(state.ahead, state.travel);
}

/* Whether all margins of some points are above the ways of these; a point with a force has no margin. */
inline bool all_sleep(CVec margin, CVec way) noexcept {
    Index wakes = 0;
    SIMD_SUM(wakes)
    for (Index k = 0; k < margin.size(); ++k) wakes += !(margin[k] * (1.0 - SCRATCH) > way[k]);
    return wakes == 0;
}

/* Set which points of contacts may respond in the step, where all need their places late. */
inline void wake(CIntMat met, const State& state, FlagMat awake) noexcept {
    for (Index group = 0; group < met.size(); ++group)
        for (Index begin = met(group, 0); begin < met(group, 1); begin += SCREENED) {
            const Index end = lesser(begin + SCREENED, met(group, 1));
            const CVec margin = state.margin.slice(begin, end), way = state.way.slice(begin, end);
            const Flags now = awake[0].slice(begin, end);
            copy(now, awake[1].slice(begin, end));
            if (all_sleep(margin, way)) {
                fill(now, false);
                continue;
            }
            const CVec last = state.last.slice(begin, end);
            const CFlags beside = state.beside.slice(begin, end);
            for (Index k = 0; k < now.size(); ++k)
                now[k] = (last[k] != 0.0) | ((margin[k] * (1.0 - SCRATCH) <= way[k]) & !beside[k]);
        }
}

/* Set the margin of open points, which they use up by the path of the coordinates and by forces. */
inline void used_margins(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const auto keep = [&](Index i) {
        const double gap = state.displacement(0, i);
        state.way[i] = way_of(constants, state.travel, i);
        state.margin[i] = state.unknown[i] == 0.0 && gap > 0.0 ? gap + state.way[i] : 0.0;
    };
    if (constants.plain) { /* Those that are awake are the candidates. */
        for (Index a = 0; a < problem.size[0]; ++a) keep(problem.ports[a]);
        return;
    }
    for (Index n = 0; n < constants.touching.size(); ++n)
        if (problem.awake(0, constants.touching[n])) keep(constants.touching[n]);
}

}  // namespace gudgeon::small
