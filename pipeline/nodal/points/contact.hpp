/* Contact forces at fixed points in one step of the midpoint rule.
 *
 *     g+ = free + W f,   W = sum of G_b W_b G_b' over the bodies, f: mean force of the step
 *
 * This is the reference of the solver and shares nothing with it but views. With a law f is the mean of the elastic
 * force over the depths of the step, (V(d+) - V(d))/(d+ - d), plus damping, so that an elastic law conserves energy. In
 * rigid contact (Signorini) a point closes when its gap half-way through the step would be negative, and stays closed
 * while its force is positive:
 *
 *     0 <= f _|_ g'+ + max(g', 0) >= 0,   g'+ = 2 (g+ - g)/h - g'
 *
 * (Moreau and Jean's rule with theta = 1/2 and no restitution, V. Acary, Z. Angew. Math. Mech. 96 (2016) 585-603, but
 * for the maximum.) Its work h f (g' + g'+)/2 is never positive: a closing dissipates the kinetic energy of the mass
 * that W sees in one step, which tends to zero with step and mesh; a closed point dissipates none. Constraints on gaps
 * instead of rates would let closed nodes oscillate undamped. The forces are found by Gauss-Seidel sweeps over the
 * points, which converge since W is symmetric and positive definite.
 */
#pragma once
#include "../../../solver/core/layout.hpp"
#include "../../../solver/core/view.hpp"

namespace gudgeon::points {

/* Gauss-Seidel sweeps after which a step fails; one or two suffice for a few points. */
constexpr Index SWEEPS = 10'000;
/* Allowed violation of a rigid contact's condition, and change of a law's depth in a sweep, relative to gaps and their
   changes in the step; round-off of sums over points is a hundredth of it. */
constexpr double TOLERANCE = 1e-13;
/* Pivot of W, relative to its diagonal, below which a point depends on others; then sweeps alone find the forces. */
constexpr double DEPENDENT = 1e-14;
/* Change of a depth in Newton's method, relative to the depths of the step, at which it has converged. */
constexpr double ROUND_OFF = 1e-14;
/* Newton iterations of one depth; about five suffice, and a step that leaves the bracket halves it instead. */
constexpr int NEWTON_LIMIT = 200;
/* Relative difference of two depths below which two Gauss points give the mean force to 1e-16. */
constexpr double CLOSE = 1e-3;
/* Least approach speed of a contact for its damping, relative to the largest so far; grazing contacts use it. */
constexpr double SLOWEST = 1e-6;

/* Data and state of the contact of c points; arrays change in place. */
struct Press {
    GUDGEON_SHAPES("W c c, law c 4, force c, depth c ?, approach c+1 ?, balance 3")
    bool rigid;   /* whether contact has no law */
    double step;  /* h [s] */
    CMat W;       /* change of gaps in a step per constant force [m/N], (c, c) */
    CMat law;     /* K, n, chi, c of each point's law, (c, 4) */
    Vec force;    /* of the last step [N], (c,) */
    Vec depth;    /* -g at its end [m], (c,); with laws */
    Vec approach; /* v- of the present contact of each point, then the largest so far [m/s], (c + 1,); with laws */
    Vec balance;  /* energy dissipated so far and energy stored by laws [J], iterations, (3,) */
    GUDGEON_FIELDS(rigid, step, W, law, force, depth, approach, balance)
};

/* Scratch of c points. */
struct Work {
    Vec b, depth, solved; /* (c,) */
    Flags usable;         /* (c,) */
    Ints pressed;         /* (c,) */
    Mat L;                /* (c, c) */
};

/* Force of a law, max(0, K d^n), its stiffness and its energy; zeros where nothing presses. */
struct Elastic {
    double force, stiffness, stored;
};

inline Elastic elastic_law(CVec law, double d) noexcept {
    if (d <= 0.0) return {0.0, 0.0, 0.0};
    const double n = law[1], power = n == 1.5 ? d * std::sqrt(d) : n == 1.0 ? d : std::pow(d, n);
    const double force = law[0] * power;
    return {force, n * force / d, force * d / (n + 1.0)};
}

/* A force and its derivative by the depth at the step's end. */
struct Mean {
    double force, slope;
};

/* The mean of the elastic force between two depths, and its derivative by the second. */
inline Mean elastic_mean(CVec law, double before, double after) noexcept {
    const double width = after - before;
    if (before <= 0.0 && after <= 0.0) return {0.0, 0.0};
    if (std::abs(width) < CLOSE * lesser(before, after)) {
        const double middle = 0.5 * (before + after), aside = width / std::sqrt(12.0);
        const Elastic low = elastic_law(law, middle - aside), high = elastic_law(law, middle + aside);
        return {0.5 * (low.force + high.force), 0.25 * (low.stiffness + high.stiffness)};
    }
    const Elastic end = elastic_law(law, after);
    const double elastic = (end.stored - elastic_law(law, before).stored) / width;
    return {elastic, (end.force - elastic) / width};
}

/* The mean force between two depths in a step, damping included, and its derivative by the second. */
inline Mean mean_force(CVec law, double before, double after, double approach, double h) noexcept {
    const auto [elastic, steepness] = elastic_mean(law, before, after);
    const double rate = (after - before) / h, per_rate = approach > 0.0 ? law[2] / approach : 0.0;
    const double damping = before > 0.0 || after > 0.0 ? law[3] : 0.0;
    const double force = elastic * (1.0 + per_rate * rate) + damping * rate;
    if (force <= 0.0) return {0.0, 0.0};
    return {force, steepness * (1.0 + per_rate * rate) + (elastic * per_rate + damping) / h};
}

/* x'y by eight sums beside each other: a vector unit waits for a single sum, which takes twice as long at 300 terms. */
inline double product_of(CVec x, CVec y) noexcept {
    constexpr Index LANES = 8;
    const Index n = x.size(), end = n - n % LANES;
    double total = 0.0;
    if (end > 0) {
        double lane[LANES] = {};
        for (Index i = 0; i < end; i += LANES)
            for (Index k = 0; k < LANES; ++k) lane[k] += x[i + k] * y[i + k];
        for (Index half = LANES / 2; half > 0; half /= 2)
            for (Index k = 0; k < half; ++k) lane[k] += lane[k + half];
        total = lane[0];
    }
    SIMD_SUM(total)
    for (Index i = end; i < n; ++i) total += x[i] * y[i];
    return total;
}

/* Go from f towards W f = -b on the pressed points until a point is free; returns whether any was. */
inline bool polish(CMat W, CVec b, Vec force, double tolerance, Work& work) noexcept {
    Index n = 0;
    for (Index i = 0; i < force.size(); ++i) {
        if (force[i] != 0.0) work.pressed[n++] = i;
    }
    const Ints pressed = work.pressed;
    const Mat L = work.L;
    const Vec solved = work.solved;
    for (Index i = 0; i < n; ++i) {
        for (Index j = 0; j < i; ++j) {
            L(i, j) = (W(pressed[i], pressed[j]) - product_of(L[i].slice(0, j), L[j].slice(0, j))) / L(j, j);
        }
        const double diagonal = W(pressed[i], pressed[i]);
        const double pivot = diagonal - product_of(L[i].slice(0, i), L[i].slice(0, i));
        if (pivot <= DEPENDENT * diagonal) return false;
        L(i, i) = std::sqrt(pivot);
        solved[i] = (-b[pressed[i]] - product_of(L[i].slice(0, i), solved.slice(0, i))) / L(i, i);
    }
    Index freed = -1;
    double share = 1.0;
    for (Index i = n - 1; i >= 0; --i) {
        solved[i] /= L(i, i);
        add(-solved[i], L[i].slice(0, i), solved.slice(0, i));
        const double old = force[pressed[i]];
        if (W(pressed[i], pressed[i]) * solved[i] < -tolerance && old < share * (old - solved[i])) {
            freed = pressed[i];
            share = old / (old - solved[i]);
        }
    }
    for (Index i = 0; i < n; ++i) {
        force[pressed[i]] = larger(0.0, (1.0 - share) * force[pressed[i]] + share * solved[i]);
    }
    if (freed >= 0) force[freed] = 0.0;
    return freed >= 0;
}

/* Whether no gap is negative and no pressed gap is open, to the tolerance. */
inline bool fits(CMat W, CVec b, CFlags usable, CVec force, double tolerance) noexcept {
    for (Index i = 0; i < b.size(); ++i) {
        if (!usable[i]) continue;
        const double gap = b[i] + product_of(W[i], force);
        if (gap < -tolerance || (force[i] > 0.0 && gap > tolerance)) return false;
    }
    return true;
}

/* Solve 0 <= f _|_ W f + b >= 0; returns the sweeps made, negative where they were not enough.
 *
 * Sweeps find which points are pressed, Cholesky's method their forces to round-off. Each lowers f'Wf/2 + b'f, so that
 * no set of pressed points recurs. `W`: symmetric, positive [m/N]; `b` [m]; `usable`: points that take part, others
 * have no force on entry and get none; `force`: a guess on entry, f on exit [N]; `tolerance`: allowed violation [m].
 */
inline Index complementary(CMat W, CVec b, CFlags usable, Vec force, double tolerance, Work& work) noexcept {
    for (Index sweep = 1; sweep <= SWEEPS; ++sweep) {
        double change = 0.0;
        for (Index i = 0; i < b.size(); ++i) {
            if (!usable[i]) continue;
            const double next = larger(0.0, force[i] - (b[i] + product_of(W[i], force)) / W(i, i));
            change = larger(change, W(i, i) * std::abs(next - force[i]));
            force[i] = next;
        }
        while (polish(W, b, force, tolerance, work)) {
        }
        if (change <= tolerance || fits(W, b, usable, force, tolerance)) return sweep;
    }
    return -SWEEPS;
}

/* Find the forces of rigid contact; returns whether they were found. */
inline bool close(Press& now, CVec gap, CVec rate, CVec free, Work& work) noexcept {
    const Vec force = now.force;
    double size = 0.0;
    for (Index i = 0; i < gap.size(); ++i) {
        work.usable[i] = force[i] > 0.0 || gap[i] + free[i] <= 0.0;
        work.b[i] = free[i] - gap[i] - 0.5 * now.step * lesser(rate[i], 0.0);
        if (work.usable[i]) size = larger(size, std::abs(free[i] - gap[i]) + 0.5 * now.step * std::abs(rate[i]));
    }
    if (size == 0.0) {
        fill(force, 0.0);
        return true;
    }
    const Index sweeps = complementary(now.W, work.b, work.usable, force, TOLERANCE * size, work);
    now.balance[2] += double(std::abs(sweeps));
    for (Index i = 0; i < gap.size(); ++i) {
        now.balance[0] += larger(0.0, -force[i] * (free[i] - gap[i] + product_of(now.W[i], force)));
    }
    return sweeps > 0;
}

struct Answer {
    double force, depth;
    int iterations;
};

/* Solve d + W_ii f(d) = d0 of a point; d0, `alone`: depth at the end of the step under all other forces [m].
 *
 * The force grows with the depth, so that there is a single root. Where the force jumps across it, as a dashpot's does
 * when a contact begins, the depth is zero and the force is the one that keeps it zero.
 */
inline Answer point_force(const Press& now, Index i, double alone) noexcept {
    const CVec law = now.law[i];
    const double before = now.depth[i], approach = now.approach[i], give = now.W(i, i);
    if (before <= 0.0 && alone <= 0.0) return {0.0, alone, 0};
    double low = alone - give * mean_force(law, before, alone, approach, now.step).force, high = alone;
    double d = lesser(larger(alone - give * now.force[i], low), high);
    for (int iteration = 1; iteration < NEWTON_LIMIT; ++iteration) {
        const auto [force, slope] = mean_force(law, before, d, approach, now.step);
        const double wrong = d + give * force - alone;
        if (wrong > 0.0) {
            high = d;
        } else {
            low = d;
        }
        const double change = -wrong / (1.0 + give * slope);
        if (std::abs(change) <= ROUND_OFF * (std::abs(d) + std::abs(before))) {
            return {larger(force + slope * change, 0.0), d + change, iteration};
        }
        d += change;
        if (!(low < d && d < high)) {
            d = 0.5 * (low + high);
            if (high - low <= ROUND_OFF * (std::abs(d) + std::abs(before))) break;
        }
    }
    /* Exactly zero: the sign of a rounded value would decide whether the contact has begun. */
    if (low <= 0.0 && 0.0 <= high) d = 0.0;
    return {larger((alone - d) / give, 0.0), d, NEWTON_LIMIT};
}

/* Note the approach speed of contacts that begin. */
inline void begin_contacts(Press& now, CVec free) noexcept {
    const Index c = free.size();
    for (Index i = 0; i < c; ++i) {
        if (now.depth[i] <= 0.0 && 0.0 < -free[i] && now.approach[i] <= 0.0) {
            const double rate = (-free[i] - now.depth[i]) / now.step;
            now.approach[c] = larger(now.approach[c], rate);
            now.approach[i] = larger(rate, SLOWEST * now.approach[c]);
        }
    }
}

/* Find the forces of laws; returns whether they were found. */
inline bool yield(Press& now, CVec free, Work& work) noexcept {
    const Index c = free.size();
    const Vec force = now.force, depth = work.depth;
    begin_contacts(now, free);
    bool settled = false;
    for (Index sweep = 0; sweep < SWEEPS; ++sweep) {
        settled = true;
        for (Index i = 0; i < c; ++i) {
            const double alone = now.W(i, i) * force[i] - free[i] - product_of(now.W[i], force), before = force[i];
            const Answer answer = point_force(now, i, alone);
            force[i] = answer.force;
            depth[i] = answer.depth;
            now.balance[2] += answer.iterations;
            const double size = std::abs(alone) + std::abs(free[i]) + std::abs(now.depth[i]);
            settled = settled && now.W(i, i) * std::abs(force[i] - before) <= TOLERANCE * size;
        }
        if (c == 1 || settled) break;
    }
    now.balance[1] = 0.0;
    for (Index i = 0; i < c; ++i) {
        const double elastic = elastic_mean(now.law[i], now.depth[i], depth[i]).force;
        const double lost = (force[i] - elastic) * (depth[i] - now.depth[i]);
        /* No law creates energy: an error of the force that does must show as energy drift. */
        now.balance[0] += larger(lost, 0.0);
        now.balance[1] += elastic_law(now.law[i], depth[i]).stored;
        now.depth[i] = depth[i];
        if (depth[i] <= 0.0) now.approach[i] = 0.0;
    }
    return c == 1 || settled;
}

/* Find the force of a step; returns whether it was found.
 *
 * `gap`, `rate`: gaps [m] and their rates [m/s] at its start; `free`: gaps at its end without contact forces [m], (c,).
 */
inline bool press(Press& now, CVec gap, CVec rate, CVec free, Work& work) noexcept {
    return now.rigid ? close(now, gap, rate, free, work) : yield(now, free, work);
}

}  // namespace gudgeon::points
