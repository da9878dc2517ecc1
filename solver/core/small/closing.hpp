/* Contact that closes or opens within a step: by how much its mean force differs from the trapezoidal rule. */
#pragma once
#include "../response/candidates.hpp"
#include "../response/sweeps.hpp"

namespace gudgeon::small {

constexpr double SETTLED = 1e-6;  /* Change of these means over the largest force at which they are found. */

/* How many candidates open or close, and the largest force of all candidates [N]. */
struct Altered {
    Index count;
    double largest;
};

/* List the candidates that open or close or have an extra mean, and all cones; no branch could be foreseen. */
inline Altered list_altered(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const CVec last = state.last, unknown = state.unknown, extra = state.extra;
    const CInts size = constants.size;
    Altered altered{0, 0.0};
    for (Index a = 0; a < problem.size[0]; ++a) {
        const Index i = problem.ports[a];
        problem.altered[altered.count] = i;
        altered.count += ((unknown[i] != 0.0) != (last[i] != 0.0)) | (extra[i] != 0.0) | (size[i] >= 3);
        altered.largest = larger(altered.largest, std::abs(unknown[i]));
    }
    return altered;
}

/* By how much the compliance of a port gives way in the step under all forces found [m]. */
inline double given_by_compliance(const Constants& constants, const State& state, const Problem& problem,
                                  Index i) noexcept {
    const Slides& slides = state.slides;
    const double last = constants.layer[i] * state.last[i];
    if (!constants.slides)
        return yielded(constants.residual, i, constants.memory, state.held, state.last, state.unknown) +
               constants.layer[i] * state.unknown[i] - last;
    double total = displaced_over(constants, slides, i, NOW, state.known, state.listed_known);
    if (constants.paired) {
        const auto yields = [&](Index j) {
            const auto by = [&](Index begin, Index end) {
                const Index at = constants.pattern.at[j];
                return dot(constants.yields.slice(at + begin, at + end), state.unknown.slice(begin, end));
            };
            if (j < slides.functions[0]) return by(0, held_ports(constants));
            double sum = 0.0;
            for (Index g = 0; g < slides.window.size(); ++g) sum += by(slides.window(g, 0), slides.window(g, 1));
            return sum;
        };
        total += yields(i) - state.response(1, i) - over(slides, i, BEFORE, state.response[1]);
        over_functions(slides, i, NOW, [&](Index f, double weight) { total += weight * yields(f); });
        return total - last;
    }
    /* Of a port without a force, `state.response` is not kept from step to step. */
    total -= displaced_over(constants, slides, i, BEFORE, state.held, state.listed);
    for (Index a = 0; a < problem.size[0]; ++a) {
        const Index j = problem.ports[a];
        total += coupling(constants.pattern, constants.yields, slides, j, i) * state.unknown[j];
    }
    return total - last;
}

/* Share of the step in which a port is closed, and its mean force without it [N]. */
struct ClosedShare {
    double share, force;
};

/* They solve share force (way of the coordinates) = -force (way of the compliance), so that the port does the work that
 * its compliance takes, with the forces of other ports as they are. */
inline ClosedShare closed_share(const Constants& constants, const State& state, const Problem& problem,
                                Index i) noexcept {
    const double extra = state.extra[i], share = constants.share[i], now = state.unknown[i], last = state.last[i];
    double inertia = 0.0, compliance = 0.0;
    if (constants.slides) {
        inertia = coupling(constants.pattern, constants.inertia, state.slides, i, i);
        compliance = coupling(constants.pattern, constants.columns, state.slides, i, i) - share * inertia;
    } else {
        inertia = between(constants.pattern, constants.inertia, i, i);
        compliance = between(constants.pattern, constants.yields, i, i);
    }
    double way = given_by_compliance(constants, state, problem, i);
    if (now > 0.0) {
        const double begin = larger(0.0, state.displacement(1, i)), force = share * now;
        if (begin == 0.0 || compliance <= 0.0) return {1.0, force};
        way = way > 0.0 ? way : compliance * now;
        const double depth = way + inertia * (force + extra), one = 1.0 + inertia * force / way;
        const double less = depth - begin, root = std::sqrt(larger(0.0, less * less + 4.0 * one * depth * begin));
        const double end = larger(0.0, 0.5 * (less + root) / one);
        return {end / (end + begin), force * end / way};
    }
    double end = larger(0.0, state.measure[i] - inertia * extra);
    const double force = (1.0 - share) * last;
    if (end == 0.0 || compliance <= 0.0) return {1.0, force};
    way = way < 0.0 ? way : -compliance * last;
    const double less = end + way - force * inertia;
    end = 0.5 * (less + std::sqrt(less * less - 4.0 * end * way));
    return {way / (way - end), force};
}

/* Set the extra means of the block of port i; returns their largest change [N]. */
inline double alter_block(const Constants& constants, const State& state, const Problem& problem, Index i) noexcept {
    const bool acts = state.unknown[i] != 0.0, acted = state.last[i] != 0.0;
    const bool wakes = acts && state.extra[i] == 0.0 && !problem.awake(1, i) && placed_late(constants, i);
    const double rule = constants.share[i];
    const auto by_rule = [&](Index b) { return rule * state.unknown[b] + (1.0 - rule) * state.last[b]; };
    ClosedShare closed{1.0, by_rule(i)};
    if (acts != acted) {
        if (wakes) place(constants, state, i);
        closed = closed_share(constants, state, problem, i);
    }
    double change = 0.0;
    for (Index b = i; b < i + constants.size[i]; ++b) {
        if (b > i) closed.force = by_rule(b);
        const double wanted = (closed.share - 1.0) * closed.force, step = wanted - state.extra[b];
        if (step == 0.0) continue;
        change = larger(change, std::abs(step));
        if (!constants.paired) add_means(constants, state, problem, b, step); /* There, a repeated solution has it. */
        if (state.last[b] == 0.0 && state.extra[b] == 0.0 && !wakes && !constants.sparse)
            state.response(1, b) = displaced(constants.residual, b, state.held, state.listed);
        state.extra[b] = wanted;
    }
    return change;
}

/* Set by how much means differ from the trapezoidal rule where contact opens or closes; whether that changed.
 *
 * The measures that `problem.free` has are those with it. */
inline bool set_extra(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const auto [count, largest] = list_altered(constants, state, problem);
    double change = 0.0;
    for (Index n = 0; n < count; ++n) {
        const Index i = problem.altered[n];
        if (constants.size[i] == 0 || !placed_late(constants, i)) continue;
        change = larger(change, alter_block(constants, state, problem, i));
    }
    return change > SETTLED * largest;
}

}  // namespace gudgeon::small
