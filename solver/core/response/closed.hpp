/* Candidates that are all unilateral over a symmetric compliance: their complementarity problem by its closed ports. */
#pragma once
#include "../log/extremes.hpp"
#include "../ports/rows.hpp"
#include "../small/arrays.hpp"
#include "complementarity.hpp"

namespace gudgeon::small {

/* Ports between two candidates up to which the loops over a run cost less than two loops. */
constexpr Index BETWEEN = 32;
/* Violation of a gap that is accepted, over the largest overlap without forces: gaps of open points may be wide. */
constexpr double GAP_TOLERANCE = 1e-12;

/* List the candidates by runs of ports that follow each other, and open closed ports that are no candidates.
 *
 * Runs with few others between them are one: the gaps of those are computed too, and are infinite.
 * They are of contacts, whose ports come first of all. */
inline void list_runs(Vec gap, const Problem& problem) noexcept {
    const ActiveSet& active = problem.active;
    Index count = 0, last = -2 - BETWEEN;
    for (Index a = 0; a < problem.size[0]; ++a) {
        const Index i = problem.ports[a];
        if (i > last + 1 + BETWEEN) {
            problem.runs(count, 0) = i;
            count += 1;
        } else {
            for (Index j = last + 1; j < i; ++j) gap[j] = std::numeric_limits<double>::infinity();
        }
        problem.runs(count - 1, 1) = i + 1;
        last = i;
    }
    problem.size[3] = count, problem.size[1] = problem.size[0];
    for (Index a = active.size[0] - 1; a >= 0; --a)
        if (!problem.awake(0, active.rows[a])) remove(active, active.rows[a]);
}

/* The compliance over the runs of candidates. */
inline Compliance over_runs(const Problem& problem) noexcept {
    Compliance matrix = problem.matrix;
    matrix.block = CIntMat{problem.runs.data, {problem.size[3], 2}};
    matrix.candidate = problem.matrix.candidate.slice(0, problem.size[3]);
    return matrix;
}

/* Set the gaps without unknowns of all runs [m]; returns the deepest. */
inline double open_gaps(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Ints ports = problem.ports.slice(0, problem.size[0]);
    const Vec free = problem.free;
    bool averaged = false;
    double deepest = 0.0;
    for (Index a = 0; a < ports.size(); ++a) {
        deepest = lesser(deepest, state.gap[ports[a]]);
        averaged |= state.extra[ports[a]] != 0.0;
    }
    for (Index k = 0; k < problem.size[3]; ++k) {
        const Index first = problem.runs(k, 0), last = problem.runs(k, 1);
        copy(state.gap.slice(first, last), free.slice(first, last));
    }
    if (averaged)
        for (Index a = 0; a < ports.size(); ++a) {
            const Index i = ports[a];
            if (state.extra[i] != 0.0)
                add_row(constants.pattern, constants.inertia, i, state.extra[i], ports, free);
        }
    return deepest;
}

/* Find the unknowns and measures of all candidates; false where ports depend on each other.
 *
 * The set of closed ports and its factor are kept from step to step. */
inline bool close(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const ActiveSet& active = problem.active;
    const Vec free = problem.free;
    if (problem.size[1] != problem.size[0]) list_runs(state.gap, problem);
    const double deepest = open_gaps(constants, state, problem);
    const Index pivots =
        solve_lcp(over_runs(problem), free, active, problem.x, problem.y, -GAP_TOLERANCE * deepest);
    state.counts[PIVOTS] += larger(Index(0), pivots);
    if (pivots < 0) {
        active.size[0] = active.size[1] = 0;
        problem.size[1] = -1;
        return false;
    }
    for (Index k = 0; k < problem.size[3]; ++k) {
        const Index first = problem.runs(k, 0), last = problem.runs(k, 1);
        const CVec forces = problem.x.slice(first, last), gaps = problem.y.slice(first, last);
        copy(gaps, free.slice(first, last));
        copy(gaps, state.measure.slice(first, last));
        const Vec unknown = state.unknown.slice(first, last);
        /* A force within the tolerance below zero is none. */
        for (Index n = 0; n < unknown.size(); ++n) unknown[n] = forces[n] > 0.0 ? forces[n] : 0.0;
    }
    return true;
}

}  // namespace gudgeon::small
