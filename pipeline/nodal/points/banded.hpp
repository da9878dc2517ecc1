/* Bodies with narrow band matrices, and their time loop.
 *
 *     S m = M v - h K u / 2 + h (f + G' c) / 2,   u+ = u + h m,   v+ = 2 m - v,   S = M + alpha K,
 *     alpha = h^2 / 4 + h beta / 2
 *
 * m: mean velocity of the step, c: contact forces. S = L D L' is factorised once. A step is one solve and one product
 * with K per body; M m follows from the rule. A rigid body has r coordinates of unit mass. K u and M v are updated by
 * K m and M m and never multiplied out again: K u of a fine mesh has fewer correct digits than its sum over the steps.
 */
#pragma once
#include "contact.hpp"

namespace gudgeon::points {

/* A body and its state. n: dofs, b: entries beside the diagonal, c: points of all contacts. */
struct Band {
    GUDGEON_SHAPES("lower n w, upper n w, pivots n, M b+1 n, K b+1 n, starts c+1, dofs *, entries *, "
                   "answers c n, load n, u n, v n, Ku n, Mv n, mean n, rhs n, balance 2")
    CMat lower;            /* L without its unit diagonal, each row from the diagonal leftwards, zero-padded, (n, w) */
    CMat upper;            /* L', each row from the diagonal rightwards, (n, w) */
    CVec pivots;           /* 1 / D, (n,) */
    CMat M, K;             /* [kg], [N/m], by diagonals from the main one downwards, (b + 1, n) */
    CInts starts, dofs;    /* G as a CSR matrix: where each row begins, (c + 1,), columns */
    CVec entries;          /* its values */
    CMat answers;          /* S^-1 G', (c, n) */
    CVec load;             /* f [N], (n,) */
    double beta;           /* [s] */
    Vec u, v, Ku, Mv;      /* (n,) */
    Vec mean, rhs;         /* m, and what it is solved from, (n,) */
    Vec balance;           /* energy dissipated by damping, and work of the load [J], (2,) */
    GUDGEON_FIELDS(lower, upper, pivots, M, K, starts, dofs, entries, answers, load, beta, u, v, Ku, Mv, mean, rhs,
                   balance)
};

/* Solve a triangle; at widths 3 and 5 the last unknowns stay in registers, and one product waits for them. */
inline void substitute(CMat rows, Vec x, Index start, Index way) noexcept {
    const Index width = rows.shape[1], n = x.size();
    Index j = start;
    double a = 0.0, b = 0.0, c = 0.0, d = 0.0, e = 0.0;
    if (width == 3) {
        for (Index i = 0; i < n; ++i, j += way) {
            const double rest = x[j] - (rows(j, 1) * b + rows(j, 2) * c), next = rest - rows(j, 0) * a;
            c = b, b = a, a = next;
            x[j] = a;
        }
    } else if (width == 5) {
        for (Index i = 0; i < n; ++i, j += way) {
            const double rest = x[j] - ((rows(j, 1) * b + rows(j, 2) * c) + (rows(j, 3) * d + rows(j, 4) * e));
            const double next = rest - rows(j, 0) * a;
            e = d, d = c, c = b, b = a, a = next;
            x[j] = a;
        }
    } else {
        for (Index i = 0; i < n; ++i, j += way) {
            for (Index k = 0; k < lesser(width, i); ++k) x[j] -= rows(j, k) * x[j - way * (k + 1)];
        }
    }
}

/* Replace x by S^-1 x, (n,). */
inline void solve(const Band& band, Vec x) noexcept {
    substitute(band.lower, x, 0, 1);
    for (Index j = 0; j < x.size(); ++j) x[j] *= band.pivots[j];
    substitute(band.upper, x, x.size() - 1, -1);
}

/* Write the product of a symmetric band and x to `out`, (n,). */
inline void product(CMat diagonals, CVec x, Vec out) noexcept {
    const Index n = x.size();
    SIMD
    for (Index j = 0; j < n; ++j) out[j] = diagonals(0, j) * x[j];
    for (Index k = 1; k < diagonals.size(); ++k) {
        const CVec diagonal = diagonals[k];
        SIMD
        for (Index j = 0; j < n - k; ++j) out[j] += diagonal[j] * x[j + k];
        SIMD
        for (Index j = 0; j < n - k; ++j) out[j + k] += diagonal[j] * x[j];
    }
}

/* Add G field to `out`, (c,). */
inline void sample(const Band& band, CVec field, Vec out) noexcept {
    for (Index i = 0; i < out.size(); ++i) {
        for (Index a = band.starts[i]; a < band.starts[i + 1]; ++a) out[i] += band.entries[a] * field[band.dofs[a]];
    }
}

/* Begin a step: the mean velocity without contact forces. */
inline void predict(Band& band, double h) noexcept {
    SIMD
    for (Index j = 0; j < band.u.size(); ++j) {
        band.rhs[j] = band.Mv[j] + 0.5 * h * (band.load[j] - band.Ku[j]);
        band.mean[j] = band.rhs[j];
    }
    solve(band, band.mean);
}

/* End a step under constant contact forces (c,). */
inline void advance(Band& band, CVec force, double h, Vec work) noexcept {
    const Index n = band.u.size();
    for (Index i = 0; i < force.size(); ++i) {
        if (force[i] == 0.0) continue;
        const double push = 0.5 * h * force[i];
        add(push, band.answers[i], band.mean);
        for (Index a = band.starts[i]; a < band.starts[i + 1]; ++a) band.rhs[band.dofs[a]] += push * band.entries[a];
    }
    product(band.K, band.mean, work);
    const double alpha = 0.25 * h * h + 0.5 * h * band.beta;
    double lost = 0.0, given = 0.0;
    SIMD_SUM(lost, given)
    for (Index j = 0; j < n; ++j) {
        lost += band.mean[j] * work[j];
        given += band.load[j] * band.mean[j];
        band.u[j] += h * band.mean[j];
        band.v[j] = 2.0 * band.mean[j] - band.v[j];
        band.Ku[j] += h * work[j];
        /* M m from the rule: K m from it would lose the digits of slow motions. */
        band.Mv[j] = 2.0 * (band.rhs[j] - alpha * work[j]) - band.Mv[j];
    }
    band.balance[0] += h * band.beta * lost;
    band.balance[1] += h * given;
}

/* Scratch of the loop. */
struct Scratch {
    Work press;
    Vec product;    /* K m, of the most dofs that a body has */
    Vec free, rate; /* gaps without contact forces [m], and rates of the gaps [m/s], (c,) */
};

/* Histories of s steps. */
struct Samples {
    Mat forces;   /* mean of each step [N], (s, c) */
    Mat gaps;     /* at its end [m], (s, c) */
    Mat energies; /* kinetic, strain, contact, dissipated energy, work of loads [J], (s, 5) */
};

/* End a step of all bodies, with its gaps and energies. `row`: number of the step in `out`. */
inline void end_step(Band* bodies, Index count, Press& now, CVec rest, Vec gap, const Samples& out, Index row,
                     Scratch& scratch) noexcept {
    copy(rest, gap);
    double kinetic = 0.0, strain = 0.0, lost = now.balance[0], given = 0.0;
    for (Index k = 0; k < count; ++k) {
        Band& band = bodies[k];
        advance(band, now.force, now.step, scratch.product.slice(0, band.u.size()));
        sample(band, band.u, gap);
        for (Index j = 0; j < band.u.size(); ++j) {
            kinetic += 0.5 * band.v[j] * band.Mv[j];
            strain += 0.5 * band.u[j] * band.Ku[j];
        }
        lost += band.balance[0];
        given += band.balance[1];
    }
    copy(now.force, out.forces[row]);
    copy(gap, out.gaps[row]);
    const Vec energies = out.energies[row];
    energies[0] = kinetic, energies[1] = strain, energies[2] = now.balance[1];
    energies[3] = lost, energies[4] = given;
}

/* Make as many steps as `out` has room for; returns how many were made, fewer where a force was not found.
 *
 * `rest`: gaps where u = 0 [m], (c,); `gap`: present gaps [m], changed in place, (c,).
 */
inline Index march(Band* bodies, Index count, Press& now, CVec rest, Vec gap, const Samples& out,
                   Scratch& scratch) noexcept {
    const double h = now.step;
    const Vec free = scratch.free, rate = scratch.rate;
    for (Index n = 0; n < out.forces.size(); ++n) {
        fill(rate, 0.0);
        for (Index k = 0; k < count; ++k) {
            if (now.rigid) sample(bodies[k], bodies[k].v, rate);
            predict(bodies[k], h);
        }
        fill(free, 0.0);
        for (Index k = 0; k < count; ++k) sample(bodies[k], bodies[k].mean, free);
        for (Index i = 0; i < free.size(); ++i) free[i] = gap[i] + h * free[i];
        if (!press(now, gap, rate, free, scratch.press)) return n;
        end_step(bodies, count, now, rest, gap, out, n, scratch);
    }
    return out.forces.size();
}

}  // namespace gudgeon::points
