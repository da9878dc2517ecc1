/* Rigid contact that closes within a step: when it does, what it asks for, and what its impulse moves. */
#pragma once
#include "../ports/rows.hpp"
#include "../ports/sliding.hpp"
#include "arrays.hpp"

namespace gudgeon::small {

/* Change of where ports are, relative to the way of rigid contact in a step, at which they are found. */
constexpr double SETTLED_SHIFT = 1e-6;
/* Gap of what does not close, over the largest measure. */
constexpr double FAR = 1e9;

/* Whether a port is of rigid contact. */
inline bool is_rigid(const Constants& constants, Index i) noexcept {
    return constants.level[constants.block[i]] == VELOCITY;
}

/* The velocity [m/s] that rigid contact asks for at the end of the step; sets when it closes in it.
 *
 * What closes at the share theta of the step rebounds by e of its velocity there, and then moves on freely; or it stays,
 * where its force would close it again: then only a part of the impulse, `sudden`, acts when it closes. */
inline double rebound(const Constants& constants, const State& state, Index i, double rate) noexcept {
    const double begin = state.displacement(1, i), before = moved(constants.rows, i, state.before[1]);
    const double end = constants.offset[i] + moved(constants.rows, i, state.q);
    state.closing[i] = -1.0;
    if (begin > 0.0 && 0.0 > end) {
        const double bend = 0.5 * constants.dt[0] * (rate - before), slope = end - begin - bend;
        state.closing[i] = 2.0 * begin / (std::sqrt(slope * slope - 4.0 * bend * begin) - slope);
    }
    const double share = larger(0.0, state.closing[i]), hit = before + share * (rate - before);
    const double wanted = (1.0 - share) * (rate - before) - constants.restitution[i] * lesser(0.0, hit);
    state.sudden[i] = wanted > 0.0 || rate >= 0.0 ? 1.0 : lesser(1.0, larger(0.0, hit / rate));
    return larger(0.0, wanted);
}

/* Keep rigid contact from closing, so that the forces of all other ports are found without it.
 *
 * Returns whether there are rigid contact and other ports among the candidates. */
inline bool keep_open(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Ints ports = problem.ports.slice(0, problem.size[0]);
    double far = 0.0;
    bool rigid = false, others = false;
    for (Index a = 0; a < ports.size(); ++a) {
        far = larger(far, std::abs(state.gap[ports[a]]));
        (is_rigid(constants, ports[a]) ? rigid : others) = true;
    }
    if (!(rigid && others)) return false;
    for (Index a = 0; a < ports.size(); ++a) {
        const Index i = ports[a];
        if (!is_rigid(constants, i)) continue;
        state.unknown[i] = 0.0;
        state.gap[i] = constants.block[i] == i ? FAR * far : 0.0;
    }
    return true;
}

/* Set what rigid contact asks for where all other ports have the forces found without it. */
inline void foresee(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Ints ports = problem.ports.slice(0, problem.size[0]);
    for (Index a = 0; a < ports.size(); ++a) {
        const Index i = ports[a];
        state.foreseen[i] = state.unknown[i];
        if (!is_rigid(constants, i)) continue;
        const double alone = state.rate[i];
        for (Index b = 0; b < ports.size(); ++b) {
            const double moves = coupling(constants.pattern, constants.columns, state.slides, ports[b], i);
            state.rate[i] += moves * state.unknown[ports[b]] / constants.dt[0];
        }
        const double wanted =
            i > constants.block[i] ? constants.belt[i] : rebound(constants, state, i, state.rate[i]);
        state.gap[i] = constants.dt[0] * (alone - wanted);
    }
}

/* By which share of the step the impulse of rigid contact acts earlier than over the whole step. */
inline double earlier(const Constants& constants, const State& state, Index i) noexcept {
    const double share = state.closing[constants.block[i]], sudden = state.sudden[constants.block[i]];
    return share >= 0.0 ? sudden * (0.5 - share) - (1.0 - sudden) * 0.5 * share : 0.0;
}

/* The mean of `earlier` over the impulses of the step: that of the impulses that joints answer with. */
inline double mean_earlier(const Constants& constants, const State& state, const Problem& problem) noexcept {
    double total = 0.0, weighted = 0.0;
    for (Index a = 0; a < problem.size[0]; ++a) {
        const Index i = problem.ports[a];
        if (constants.level[i] != VELOCITY || constants.block[i] != i || !(state.closing[i] >= 0.0)) continue;
        total += std::abs(state.unknown[i]);
        weighted += std::abs(state.unknown[i]) * earlier(constants, state, i);
    }
    return total > 0.0 ? weighted / total : 0.0;
}

/* The force of a port over the step [N] times the share of it by which it acts earlier.
 *
 * A joint or drive without a compliance of its own answers impulses with an impulse, beside its force without them. */
inline double sudden_force(const Constants& constants, const State& state, Index i, double average) noexcept {
    const Index level = constants.level[constants.block[i]];
    if (level == VELOCITY) return earlier(constants, state, i) * state.unknown[i];
    if (level == STABILISED) return average * (state.unknown[i] - state.foreseen[i]);
    return 0.0;
}

/* Move other ports by the impulses of rigid contact when these act; returns whether that changed where they are. */
inline bool shifts_change(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Ints ports = problem.ports.slice(0, problem.size[0]);
    const double average = mean_earlier(constants, state, problem);
    double changed = 0.0, way = 0.0;
    for (Index a = 0; a < ports.size(); ++a) {
        const Index i = ports[a];
        if (is_rigid(constants, i)) {
            way = larger(way, constants.dt[0] * std::abs(state.rate[i]));
            continue;
        }
        double shift = 0.0;
        for (Index b = 0; b < ports.size(); ++b) {
            const double amount = sudden_force(constants, state, ports[b], average);
            if (amount != 0.0)
                shift += amount * coupling(constants.pattern, constants.inertia, state.slides, ports[b], i);
        }
        changed = larger(changed, std::abs(shift - state.shift[i]));
        state.gap[i] += shift - state.shift[i];
        state.shift[i] = shift;
    }
    return changed > SETTLED_SHIFT * way;
}

/* Let impulses of rigid contact that closes within the step act when it closes and from then on. */
inline void strike(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Vec q = state.q, second = state.rest[0];
    const CVec by_v = constants.push[1];
    fill(second, 0.0);
    const double average = mean_earlier(constants, state, problem);
    state.average[0] = average;
    for (Index a = 0; a < problem.size[0]; ++a) {
        const Index i = problem.ports[a];
        const double amount = sudden_force(constants, state, i, average);
        if (amount != 0.0) push(constants.rows, i, amount, second);
    }
    for (Index k = 0; k < q.size(); ++k) q[k] += constants.dt[0] * by_v[k] * second[k];
}

}  // namespace gudgeon::small
