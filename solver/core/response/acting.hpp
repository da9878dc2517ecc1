/* Which candidates a contact solution is about: those that have a force or would overlap without one.
 *
 * The others are open. Their measures are found after the forces, not in every sweep; those that overlap then act, too.
 */
#pragma once
#include "../small/arrays.hpp"

namespace gudgeon::small {

/* Whether `pushed` holds for the listed unknowns and a range of ports, such as those of the step before. */
inline bool pushes_alike(const Problem& problem, Index begin, Index end) noexcept {
    if (problem.size[1] < 0 || problem.span[0] > begin || problem.span[1] < end) return false;
    Index others = 0;
    for (Index i = 0; i < problem.pushing.size(); ++i) others += problem.pushing[i] != 0.0;
    for (Index a = 0; a < problem.size[0]; ++a) {
        if (problem.x[a] != problem.pushing[problem.ports[a]]) return false;
        others -= problem.x[a] != 0.0;
    }
    return others == 0;
}

/* Set the measures of all candidates by the unknowns of those that are listed; others between them are not read.
 *
 * count: of the candidates. */
inline void measure(const Constants& constants, const State& state, const Problem& problem, Index count) noexcept {
    if (count == 0) return;
    const Index begin = problem.candidates[0], end = problem.candidates[count - 1] + 1;
    if (!pushes_alike(problem, begin, end)) {
        fill(problem.pushed.slice(begin, end), 0.0);
        combine_rows(constants.pattern, constants.columns, {problem.ports, problem.x, problem.size[0]}, begin, end,
                     problem.pushed);
        fill(problem.pushing, 0.0);
        for (Index a = 0; a < problem.size[0]; ++a) problem.pushing[problem.ports[a]] = problem.x[a];
        problem.span[0] = begin, problem.span[1] = end;
    }
    for (Index i = begin; i < end; ++i) state.measure[i] = problem.free[i] + problem.pushed[i];
}

/* Let candidates act which their measures or forces ask for, all where points slide; whether these are more. */
inline bool choose(const Constants& constants, const State& state, const Problem& problem, Index count) noexcept {
    bool more = false;
    for (Index a = 0; a < count;) {
        const Index i = problem.candidates[a], kind = constants.kind[i];
        a += constants.size[i];
        if (problem.acting[i]) continue;
        /* A measure that is not a number acts, and is found out. */
        bool acts = constants.slides || (kind != UNILATERAL && kind != CONE) || !(state.measure[i] >= 0.0);
        for (Index b = i; b < i + constants.size[i]; ++b) acts = acts || state.unknown[b] != 0.0;
        if (acts) problem.acting[i] = more = true;
    }
    return more;
}

/* List the candidates that act in `problem.ports`; their columns hold if they are those of the last solution. */
inline void list_acting(const Constants& constants, const Problem& problem, Index count) noexcept {
    const Ints ports = problem.ports, gathered = problem.gathered;
    bool same = true;
    Index n = 0;
    for (Index a = 0; a < count;) {
        const Index i = problem.candidates[a];
        if (problem.acting[i])
            for (Index b = i; b < i + constants.size[i]; ++b, ++n) {
                same = same && gathered[n] == b;
                ports[n] = gathered[n] = b;
            }
        a += constants.size[i];
    }
    if (!same || n != problem.size[1]) problem.size[1] = -1;
    problem.size[0] = n;
}

/* Keep the list of all candidates, none of which acts, and list those with forces; returns how many all are. */
inline Index begin_acting(const State& state, const Problem& problem) noexcept {
    const Index count = problem.size[0];
    Index n = 0;
    copy(problem.ports.slice(0, count), problem.candidates.slice(0, count));
    for (Index a = 0; a < count; ++a) {
        const Index i = problem.candidates[a];
        problem.acting[i] = false;
        if (state.unknown[i] != 0.0) {
            problem.ports[n] = i;
            problem.x[n++] = state.unknown[i];
        }
    }
    problem.size[0] = n;
    return count;
}

/* List all candidates again. */
inline void end_acting(const Problem& problem, Index count) noexcept {
    copy(problem.candidates.slice(0, count), problem.ports.slice(0, count));
    problem.size[0] = count;
}

}  // namespace gudgeon::small
