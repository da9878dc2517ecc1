/* The end of a step: pushes, displacements of ports, anchors of friction, slip and stick, lengths of joints. */
#pragma once
#include "../ports/edges.hpp"
#include "../ports/sliding.hpp"
#include "../response/blocks.hpp"

namespace gudgeon::small {

constexpr double ON_BORDER = 1e-9;  /* Share by which a force beyond the border of its disc is there by round-off. */

/* Whether four ports are of contacts and have no extra mean force. */
inline bool pushed_alike(const Constants& constants, const State& state, FourPorts four) noexcept {
    bool alike = true;
    for (Index n = 0; n < 4; ++n) {
        const Index i = four[n];
        alike = alike && constants.contact[i] >= 0 && constants.share[i] < 1.0 && state.extra[i] == 0.0;
    }
    return alike;
}

/* Set the generalised forces by what acts at the step's end on ports that respond, and on surfaces. */
inline void push_ends(const Constants& constants, const State& state) noexcept {
    const Rows& rows = constants.rows;
    const CVec unknown = state.unknown, extra = state.extra;
    const CInts ports = state.forced.slice(1, state.forced[0] + 1);
    for (Index a = 0; a < ports.size();) {
        const Index i = ports[a];
        a += 1;
        if (unknown[i] == 0.0 && extra[i] == 0.0) continue;
        const Index group = constants.contact[i] >= 0 || constants.kind[i] == SURFACE ? 0 : 1;
        const Vec half = state.half[group], rest = state.rest[group];
        if (four_alike(constants.pattern.group, ports, a - 1)) {
            const Index four[] = {i, ports[a], ports[a + 1], ports[a + 2]};
            if (pushed_alike(constants, state, four)) {
                const double amounts[] = {0.5 * unknown[i], 0.5 * unknown[four[1]], 0.5 * unknown[four[2]],
                                          0.5 * unknown[four[3]]};
                push_four(rows, four, amounts, half);
                a += 3;
                continue;
            }
        }
        if (constants.share[i] < 1.0) {
            push(rows, i, 0.5 * unknown[i], half);
            if (extra[i] != 0.0) push(rows, i, extra[i], rest);
        } else {
            push(rows, i, unknown[i] + extra[i], rest);
        }
    }
}

/* Set the displacement of one port by its row. */
inline void displace_fully(const Constants& constants, const State& state, Index i) noexcept {
    const double response = displaced(constants.residual, i, state.held, state.listed);
    state.response(0, i) = response;
    double position = moved(constants.rows, i, state.q) + response;
    if (state.slides.over[i]) {
        position = moved_over(constants, state.slides, i, NOW, state.q);
        position += displaced_over(constants, state.slides, i, NOW, state.held, state.listed);
    }
    state.displacement(0, i) = constants.offset[i] + position;
}

/* Set the displacement of the candidates at the end of the step [m].
 *
 * That of one over a compliance is its measure less its layer, from its anchor. */
inline void displace_candidates(const Constants& constants, const State& state, const Problem& problem) noexcept {
    /* Rigid contact moves what it pushes once more, after its impulses are found: see `strike`. */
    const bool solved = problem.size[2] != 0 && !constants.bounces;
    const Vec displacement = state.displacement[0];
    const CVec layer = constants.layer, unknown = state.unknown, free = problem.free;
    if (constants.plain && solved && !(constants.edged || constants.damped)) {
        for (Index a = 0; a < problem.size[0]; ++a) {
            const Index i = problem.ports[a];
            displacement[i] = free[i] - layer[i] * unknown[i];
        }
        return;
    }
    for (Index a = 0; a < problem.size[0]; ++a) {
        const Index i = problem.ports[a], block = constants.block[i], kind = constants.kind[i];
        const bool measured = solved && !state.beside[i] && constants.level[block] == POSITION;
        if (!measured || kind == BILATERAL || kind == DRIVEN) {
            displace_fully(constants, state, i);
            continue;
        }
        displacement[i] = free[i] - layer[i] * unknown[i];
        if (i > block && constants.contact[i] >= 0)
            displacement[i] += state.anchor[i] + constants.belt[i] * constants.dt[0];
        if (constants.damped && !state.slides.over[i])
            state.response(0, i) = displaced(constants.residual, i, state.held, state.listed);
    }
}

/* Set the response of ports with forces: of points that slide and functions all at once. */
inline void respond_at_end(const Constants& constants, const State& state) noexcept {
    const Vec response = state.response[0];
    if (!constants.slides) return displace_listed(constants.residual, state.held, state.listed, response);
    over_ranges(state.slides, [&](Index begin, Index end) { fill(response.slice(begin, end), 0.0); });
    displace_all(constants, state.slides, state.held, state.listed, state.slides.inward[1], response);
    for (Index n = 1; n <= state.listed[0]; ++n) {
        const Index i = state.listed[n];
        if (!state.slides.over[i] && constants.kind[i] != SURFACE)
            response[i] = displaced(constants.residual, i, state.held, state.listed);
    }
}

/* Set the displacement of the ports that respond or are loaded, at the end of the step [m]. */
inline void displace(const Constants& constants, const State& state, const Problem& problem) noexcept {
    displace_candidates(constants, state, problem);
    for (Index n = 0; n < constants.given.size(); ++n) {
        const Index i = constants.given[n];
        if (state.unknown[i] != 0.0 || state.last[i] != 0.0 || state.mean[i] != 0.0)
            displace_fully(constants, state, i);
    }
    if (constants.bounces)
        for (Index n = 0; n < constants.touching.size(); ++n) {
            const Index i = constants.touching[n];
            if (constants.level[i] == VELOCITY && problem.awake(0, i))
                for (Index b = i; b < i + constants.size[i]; ++b) displace_fully(constants, state, b);
        }
    if ((state.held.size() == 1 && !constants.sparse) || constants.slides) respond_at_end(constants, state);
}

/* Keep a change between slip and stick [s]. */
inline void note_slip(Index contact, double time, bool begins, Mat slips) noexcept {
    const Index count = Index(slips(0, 0)) + 1;
    slips(0, 0) = double(count);
    if (count < slips.size())
        slips(count, 0) = double(contact), slips(count, 1) = time, slips(count, 2) = begins;
}

/* Whether the tangents of a cone that presses slip. */
inline bool slips_at(const Constants& constants, const State& state, const Problem& problem, Index i) noexcept {
    const Pattern& pattern = constants.pattern;
    const double reach = larger(between(pattern, constants.columns, i + 1, i + 1),
                                between(pattern, constants.columns, i + 2, i + 2));
    const double rest = constants.friction(i, 0) * state.unknown[i], slip = constants.friction(i, 1) * state.unknown[i];
    const double weight = reach > 0.0 ? 1.0 / reach : 0.0;
    /* A force on the border of its disc by round-off sticks. */
    return rubbed({rest * (1 + ON_BORDER), slip * (1 + ON_BORDER)}, problem.slipped[i],
                  state.unknown[i + 1] - weight * state.measure[i + 1],
                  state.unknown[i + 2] - weight * state.measure[i + 2])
        .slips;
}

/* When the gap of a law closes or opens in a step, as a share of it, and its speed then [m/s]. */
struct Passage {
    double share, speed;
};

/* Rate [m/s] that the mean force of port i over the step gives its displacement. */
inline double pushed_rate(const Constants& constants, const State& state, Index i) noexcept {
    const Vec change = state.rest[1];
    const CVec by_v = constants.push[1];
    fill(change, 0.0);
    push(constants.rows, i, state.mean[i], change);
    for (Index k = 0; k < change.size(); ++k) change[k] *= by_v[k];
    return moved(constants.rows, i, change);
}

/* The zero of the parabola through the gaps of a step, at its end without the force of the law itself, whose rate
 * changes by as much as that of the coordinates. */
inline Passage approach_of(const Constants& constants, const State& state, Index i) noexcept {
    const double dt = constants.dt[0], begin = state.displacement(1, i);
    const double reach = coupling(constants.pattern, constants.columns, state.slides, i, i);
    const double change = state.displacement(0, i) - reach * state.unknown[i] - begin;
    const double before = moved_over(constants, state.slides, i, BEFORE, state.before[1]);
    const double after = moved_over(constants, state.slides, i, NOW, state.v) - pushed_rate(constants, state, i);
    const double bend = 0.5 * dt * (after - before), slope = change - bend;
    const double root = std::sqrt(larger(0.0, slope * slope - 4.0 * bend * begin));
    const double share = begin > 0.0 ? larger(0.0, lesser(1.0, 2.0 * begin / (root - slope))) : 0.0;
    return {share, larger(0.0, -(before + share * (after - before)))};
}

/* The same of a gap that opens: the parabola through its end, where the law has no force any more. */
inline Passage departure_of(const Constants& constants, const State& state, Index i) noexcept {
    const double dt = constants.dt[0], gap = state.displacement(0, i);
    const double before = moved_over(constants, state.slides, i, BEFORE, state.before[1]);
    const double after = moved_over(constants, state.slides, i, NOW, state.v);
    const double change = after - pushed_rate(constants, state, i) - before;
    const double speed = std::sqrt(larger(0.0, after * after - 2.0 * change / dt * gap));
    const double since = after + speed > 0.0 ? 2.0 * gap / (after + speed) : 0.0;
    return {larger(0.0, 1.0 - since / dt), after > 0.0 ? speed : 0.0};
}

/* Keep the approach of a law that has closed in the step, and none of one that is open. */
inline void set_approach(const Constants& constants, const State& state, Index i) noexcept {
    const bool open = state.displacement(0, i) >= 0.0 || state.beside[i];
    if (open) {
        state.approach[i] = 0.0;
    } else if (state.displacement(1, i) >= 0.0) {
        const double speed = approach_of(constants, state, i).speed;
        state.fastest[0] = larger(state.fastest[0], speed);
        state.approach[i] = larger(speed, constants.floor * state.fastest[0]);
    }
}

/* Let the anchors of tangents that slip or are open follow them, and set the approach of laws.
 *
 * time: at the end of the step [s]. */
inline void follow(const Constants& constants, const State& state, const Problem& problem, double time) noexcept {
    for (Index a = 0; a < problem.size[0]; ++a) {
        const Index i = problem.ports[a], kind = constants.kind[i];
        if (constants.size[i] == 0) continue;
        if (is_law(kind)) set_approach(constants, state, i);
        if (constants.size[i] != 3 || kind == DRIVEN) continue;
        const bool slips = !(state.unknown[i] > 0.0) || slips_at(constants, state, problem, i);
        const bool slides = slips && state.unknown[i] > 0.0;
        if (slides != state.sliding[i] && state.last[i] > 0.0 && state.unknown[i] > 0.0)
            note_slip(constants.contact[i], time, slides, state.slips);
        state.sliding[i] = slides;
        for (Index b = i + 1; b < i + 3; ++b)
            state.anchor[b] = slips ? state.displacement(0, b) : state.anchor[b] + constants.belt[b] * constants.dt[0];
    }
}

/* Set the length error of each joint [m]. */
inline void set_lengths(const Constants& constants, const State& state, Vec out) noexcept {
    for (Index n = 0; n < constants.joints.size(); ++n) {
        const Index i = constants.joints[n], j = constants.joint[i];
        const double lateral = state.displacement(0, i) - state.pin(j, 0);
        const double along = state.displacement(0, i + 1) - state.pin(j, 1);
        out[j] = length_of(lateral, along) - constants.lengths[i];
    }
}

}  // namespace gudgeon::small
