/* Anderson's mixing of the last sweeps (D. G. Anderson, J. ACM 12 (1965) 547-560). */
#pragma once
#include "../small/arrays.hpp"

namespace gudgeon::small {

constexpr Index WINDOW = 8;         /* Sweeps that are mixed. */
constexpr double STEADY = 1e-13;    /* Ridge of the least squares, relative to their largest diagonal. */

/* Set a difference, and the past to what is now. */
inline void change_since(CVec now, Vec past, Vec difference) noexcept {
    SIMD
    for (Index a = 0; a < now.size(); ++a) difference[a] = now[a] - past[a];
    copy(now, past);
}

/* Solve (G + ridge) x = b in place by Cholesky's factor; x replaces b, the last column. False if G is singular. */
inline bool least_squares(Mat gram, Index count, double ridge) noexcept {
    for (Index b = 0; b < count; ++b)
        for (Index c = 0; c <= b; ++c) {
            double total = gram(b, c) + (b == c ? ridge : 0.0);
            for (Index d = 0; d < c; ++d) total -= gram(b, d) * gram(c, d);
            if (b == c) {
                if (!(total > 0.0)) return false;
                gram(b, b) = std::sqrt(total);
            } else {
                gram(b, c) = total / gram(c, c);
            }
        }
    for (Index b = 0; b < count; ++b) {
        double total = gram(b, WINDOW);
        for (Index d = 0; d < b; ++d) total -= gram(b, d) * gram(d, WINDOW);
        gram(b, WINDOW) = total / gram(b, b);
    }
    for (Index b = count - 1; b >= 0; --b) {
        double total = gram(b, WINDOW);
        for (Index d = b + 1; d < count; ++d) total -= gram(d, b) * gram(d, WINDOW);
        gram(b, WINDOW) = total / gram(b, b);
    }
    return true;
}

/* Set the products of the last changes of the residual with each other and with the residual; returns the largest. */
inline double gather_products(const Problem& problem, Index n, Index slot, Index count) noexcept {
    const Mat products = problem.products, gram = problem.gram, changes = problem.changes[0];
    const CVec residual = problem.past[0].slice(0, n), change = changes[slot].slice(0, n);
    const auto slot_of = [slot](Index b) { return (slot - b + WINDOW) % WINDOW; };
    for (Index b = 0; b < count; ++b) {
        const Index other = slot_of(b);
        products(slot, other) = products(other, slot) = dot(change, changes[other].slice(0, n));
    }
    double top = 0.0;
    for (Index b = 0; b < count; ++b) {
        for (Index c = 0; c <= b; ++c) gram(b, c) = products(slot_of(b), slot_of(c));
        gram(b, WINDOW) = dot(changes[slot_of(b)].slice(0, n), residual);
        top = larger(top, gram(b, b));
    }
    return top;
}

/* Mix the last sweeps; returns how many changes are kept.
 *
 * The weights minimise |r - sum gamma dr| in the norm of the diagonal of M. */
inline Index mix(const Problem& problem, Index n, Index sweep) noexcept {
    const Vec x = problem.x.slice(0, n), y = problem.y.slice(0, n), residual = problem.past[0].slice(0, n);
    const Cube changes = problem.changes;
    const Index slot = sweep % WINDOW;
    change_since(x, problem.past[1].slice(0, n), changes[1][slot].slice(0, n));
    change_since(y, problem.past[2].slice(0, n), changes[2][slot].slice(0, n));
    const Vec change = changes[0][slot].slice(0, n);
    const CVec start = problem.start.slice(0, n), weight = problem.weight.slice(0, n);
    SIMD
    for (Index a = 0; a < n; ++a) {
        const double now = (x[a] - start[a]) * weight[a];
        change[a] = now - residual[a];
        residual[a] = now;
    }
    if (sweep == 0) return 0;
    const Index count = lesser(problem.size[4] + 1, WINDOW);
    const double top = gather_products(problem, n, slot, count);
    if (!(top > 0.0)) return 0;
    if (!least_squares(problem.gram, count, STEADY * top)) return 0;
    for (Index b = 0; b < count; ++b) {
        const double share = problem.gram(b, WINDOW);
        const Index place = (slot - b + WINDOW) % WINDOW;
        add(-share, changes[1][place].slice(0, n), x);
        add(-share, changes[2][place].slice(0, n), y);
    }
    return count;
}

}  // namespace gudgeon::small
