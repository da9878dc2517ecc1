/* The responses of all candidates of a step together: sweeps over the ports with Anderson's mixing.
 *
 * The last sweeps are mixed so that their residuals cancel best (D. G. Anderson, J. ACM 12 (1965) 547-560).
 */
#pragma once
#include "../ports/rows.hpp"
#include "../ports/sliding.hpp"
#include "acting.hpp"
#include "closed.hpp"
#include "mixing.hpp"
#include "newton.hpp"
#include "sweep.hpp"

namespace gudgeon::small {

/* Largest force over that of a port's own flexibility: forces that push each other in would grow without end. */
constexpr double GAIN = 1e6;
/* Sweeps in which a cone may change between static and kinetic friction; where the force that holds it is between them,
 * it would do so without end. */
constexpr Index UNDECIDED = 40;
constexpr Index MOST_SWEEPS = 150;
constexpr Index SWEEPS = 3;          /* Entry of the counts: sweeps. */
/* Residual of a solution, relative to the largest force, at which sweeps end. */
constexpr double TOLERANCE = 1e-11;
/* Change of the forces in a sweep over the residual that is allowed, above which the residual is not looked at. */
constexpr double NEAR = 100.0;
/* Sweeps after which the residual that is allowed is found again, of changes that are not near to it. */
constexpr Index LOOKS = 4;
/* Before Newton's method, which without them goes to and fro where slip turns round. */
constexpr Index FIRST_SWEEPS = 6;
/* As `TOLERANCE`, of Newton's method: the round-off of its factor. */
constexpr double LAST_TOLERANCE = 1e-9;

/* Add what a mean force of port j [N] does to the measures of the candidates. */
inline void add_means(const Constants& constants, const State& state, const Problem& problem, Index j,
                      double amount) noexcept {
    const Ints ports = problem.ports.slice(0, problem.size[0]);
    if (!constants.slides) {
        add_row(constants.pattern, constants.inertia, j, amount, ports, problem.free);
        return;
    }
    for (Index a = 0; a < ports.size(); ++a)
        problem.free[ports[a]] += amount * coupling(constants.pattern, constants.inertia, state.slides, j, ports[a]);
}

/* Gather the columns of the candidates. */
inline void gather_columns(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Index n = problem.size[0];
    const Pattern& pattern = constants.pattern;
    const Ints ports = problem.ports;
    for (Index a = 0; a < n; ++a) {
        const Vec column = problem.columns[a];
        const Index group = pattern.group[ports[a]];
        if (constants.slides) {
            gather_sliding(constants, state.slides, problem, a);
        } else {
            fill(column.slice(0, n), 0.0);
            for (Index r = pattern.span(group, 0); r < pattern.span(group, 1); ++r) {
                const Index first = pattern.runs(r, 0), last = pattern.runs(r, 1);
                const Index begin = pattern.at[ports[a]] + pattern.runs(r, 2);
                const Index end = first_from(ports, n, last);
                for (Index c = first_from(ports, n, first); c < end; ++c)
                    column[c] = constants.columns[begin + ports[c]];
            }
        }
        problem.weight[a] = std::sqrt(column[a]);
    }
    for (Index a = 0; a < n; ++a) problem.stiff[a] = stiffness(problem.columns, a, 1);
    for (Index a = 0; a < n; ++a)
        if (constants.size[ports[a]] == 3 && constants.kind[ports[a]] != DRIVEN)
            problem.stiff[a + 1] = problem.stiff[a + 2] = stiffness(problem.columns, a + 1, 2);
    problem.size[1] = n;
}

/* Open the contact whose response is no force: what is left of it within the tolerance would never end. */
inline void release(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Candidates all{problem};
    for (Index a = 0; a < all.x.size(); ++a) {
        const Index i = problem.ports[a], kind = constants.kind[i], size = constants.size[i];
        if (size == 0 || !presses(kind)) continue;
        const double reach = all.columns(a, a);
        double force = 0.0;
        if (reach > 0.0)
            force = kind == UNILATERAL || kind == CONE
                        ? all.x[a] - all.y[a] / reach
                        : compliant_force(constants, state, i, all.y[a] - reach * all.x[a], reach);
        if (force <= 0.0)
            for (Index b = a; b < a + size; ++b) change(all, b, 0.0);
    }
}

/* Set unknowns and measures of the candidates to those of the unknowns at the start. */
inline Bound begin_solution(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Candidates all{problem};
    const Vec x = all.x, y = all.y;
    double largest = 0.0, start = 0.0;
    for (Index a = 0; a < x.size(); ++a) {
        const Index i = problem.ports[a];
        x[a] = state.unknown[i];
        y[a] = constants.slides ? problem.free[i] : state.measure[i];
        problem.slipped[i] = state.sliding[i];
    }
    if (constants.slides)
        for (Index a = 0; a < x.size(); ++a)
            if (x[a] != 0.0) add(x[a], all.column(a), y);
    for (Index a = 0; a < x.size(); ++a) {
        const double reach = all.columns(a, a);
        if (!(reach > 0.0)) continue;
        start = larger(start, std::abs(x[a]));
        largest = larger(larger(largest, start), std::abs(problem.free[problem.ports[a]]) / reach);
    }
    return {GAIN * largest, start};
}

/* Sum of the squares of the changes of the unknowns in a sweep [N^2], and in the norm of the diagonal of M. */
struct Change {
    double plain, weighted;
};

inline Change change_in_sweep(const Problem& problem) noexcept {
    const Vec x = problem.x, start = problem.start, weight = problem.weight;
    double plain = 0.0, weighted = 0.0;
    const Index n = problem.size[0];
    SIMD_SUM(plain, weighted)
    for (Index a = 0; a < n; ++a) {
        const double step = x[a] - start[a], scaled = weight[a] * step;
        weighted += scaled * scaled;
        plain += step * step;
    }
    return {plain, weighted};
}

/* Sweep over the candidates until the residual is within its tolerance; false where that takes too long.
 *
 * most: largest number of sweeps.  window: how many are mixed. */
inline bool swept(const Constants& constants, const State& state, const Problem& problem, Index most, Index window,
                  const Bound& bound) noexcept {
    const Index n = problem.size[0];
    double before = 0.0, within = 0.0;
    problem.size[4] = 0;
    for (Index sweep = 0; sweep < most; ++sweep) {
        copy(problem.x.slice(0, n), problem.start.slice(0, n));
        const Index blocks = sweep_over(constants, state, problem, sweep >= UNDECIDED);
        if (sweep % LOOKS == 0) within = allowed(constants, state, problem, TOLERANCE, bound);
        const auto [change, size] = change_in_sweep(problem);
        state.counts[SWEEPS] += 1;
        if (sweep == 0 || change <= square(NEAR * within)) {
            within = allowed(constants, state, problem, TOLERANCE, bound);
            if (natural_residual(constants, problem) <= within * within) {
                renew(problem);
                if (natural_residual(constants, problem) <= within * within) return true;
            }
        }
        if (blocks == 1 && constants.size[problem.ports[0]] == 1 && size < std::numeric_limits<double>::infinity())
            return true;
        if (sweep > 0 && size > 4.0 * before) problem.size[4] = 0;
        before = size;
        if (window > 0 && sweep + 1 < most) problem.size[4] = mix(problem, n, sweep);
    }
    return false;
}

/* Find the forces by sweeps, else by Newton's method after a few sweeps, of the places where points are held.
 *
 * Newton's method begins where sweeps came, then after a few: far from the forces the one goes to and fro, near to them
 * the other. */
inline bool find_forces(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Bound bound = begin_solution(constants, state, problem);
    if (swept(constants, state, problem, MOST_SWEEPS, WINDOW, bound)) return true;
    if (newton(constants, state, problem, LAST_TOLERANCE, bound)) return true;
    begin_solution(constants, state, problem);
    if (swept(constants, state, problem, FIRST_SWEEPS, 0, bound)) return true;
    return newton(constants, state, problem, LAST_TOLERANCE, bound);
}

/* Find the forces of the listed candidates; false where neither sweeps nor Newton's method do.
 *
 * Of points that no motion reaches at once, the forces against each other have no bound but those of slip. */
inline bool balanced(const Constants& constants, const State& state, const Problem& problem) noexcept {
    if (problem.size[1] != problem.size[0]) gather_columns(constants, state, problem);
    bool found = find_forces(constants, state, problem);
    if (!found && make_reachable(constants, state, problem)) found = find_forces(constants, state, problem);
    if (found) release(constants, state, problem);
    return found;
}

/* Find the unknowns and measures of all candidates from the unknowns that they have; false where none are found. */
inline bool solve(const Arrays& arrays) noexcept {
    const auto& [constants, state, problem, log] = arrays;
    if (constants.plain) return close(constants, state, problem);
    const Ints ports = problem.ports.slice(0, problem.size[0]);
    const Vec free = problem.free;
    for (Index a = 0; a < ports.size(); ++a) free[ports[a]] = state.gap[ports[a]];
    for (Index a = 0; a < ports.size(); ++a)
        if (const double extra = state.extra[ports[a]]; extra != 0.0)
            add_means(constants, state, problem, ports[a], extra);
    const Index count = begin_acting(state, problem);
    bool sound = true;
    if (!constants.slides) measure(constants, state, problem, count);
    while (sound && choose(constants, state, problem, count)) {
        list_acting(constants, problem, count);
        sound = balanced(constants, state, problem);
        if (!constants.slides) measure(constants, state, problem, count);
        for (Index a = 0; a < problem.size[0]; ++a) {
            const Index i = problem.ports[a];
            state.unknown[i] = problem.x[a];
            state.measure[i] = problem.y[a];
        }
    }
    end_acting(problem, count);
    for (Index a = 0; a < ports.size(); ++a) free[ports[a]] = state.measure[ports[a]];
    return sound;
}

}  // namespace gudgeon::small
