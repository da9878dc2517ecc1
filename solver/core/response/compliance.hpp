/* The compliance matrix of a contact problem, computed row by row on demand, and the products of a step.
 *
 * Where bodies slide over a traction space the matrix is base + N M N^T with weights N that move; a row is computed
 * when its point first becomes active in an era, and an era ends when the weights have moved too far.
 */
#pragma once
#include <utility>

#include "../layout.hpp"
#include "../view.hpp"

namespace gudgeon {

/* Which ports share a body. Shapes: p ports, G groups, r runs of all groups. */
struct Pattern {
    GUDGEON_SHAPES("at p, group p, runs * 3, span * 2")
    CInts at;      /* Place of each row's first value, (p,). */
    CInts group;   /* Group of each port, in the order of the ports, (p,). */
    CIntMat runs;  /* First and last + 1 port of a run, and what is added to a port for its place, (r, 3). */
    CIntMat span;  /* First and last + 1 run of each group, (G, 2). */
    GUDGEON_FIELDS(at, group, runs, span)
};

/* Shapes: c rows, k contacts, F functions of all traction spaces. */
struct Compliance {
    GUDGEON_SHAPES("values *, base c c ?, stamp c, era 1, master F F, block o 2, candidate *, space o 3, "
                   "corner c, across c 4, along 4 c, known o, window o 2, scratch F, touched 16, weights 16")
    Pattern pattern;    /* Which rows couple; all where contacts slide. */
    Vec values;         /* A table over them [m/N]; row i is valid where stamp[i] is the era. */
    CMat base;          /* Constant part [m/N], (c, c). */
    Ints stamp, era;    /* (c,) and (1,). */
    CMat master;        /* M, compliance of the functions [m/N], (F, F). */
    CIntMat block;      /* First and last + 1 row of each contact, (k, 2). */
    Flags candidate;    /* Whether points of each contact may touch in this step, (k,). */
    CIntMat space;      /* First function, functions across, functions along; zero without sliding, (k, 3). */
    Ints corner;        /* First function that each row touches at this era, negative outside of the space, (c,). */
    CMat across;        /* Spline values across of each row, (c, 4). */
    Mat along;          /* Spline values along of each row at this era, (4, c). */
    Flags known;        /* Whether rows of this era have the columns of each contact, (k,). */
    IntMat window;      /* First and last + 1 function along that any row touches at this era, (k, 2). */
    Vec scratch;        /* (F,) */
    Ints touched;       /* Functions that a row touches, (16,), */
    Vec weights;        /* and their weights, (16,). */
    GUDGEON_FIELDS(pattern, values, base, stamp, era, master, block, candidate, space, corner, across, along, known,
                   window, scratch, touched, weights)
};

/* A sparse vector: the numbers and amounts of its entries that are not zero, `size` of them in use. */
struct Listed {
    CInts numbers;
    CVec amounts;
    Index size;
};

/* What port j does to port i, zero where they share no body. */
inline double between(const Pattern& pattern, CVec values, Index j, Index i) noexcept {
    const Index group = pattern.group[j];
    for (Index n = pattern.span(group, 0); n < pattern.span(group, 1); ++n)
        if (pattern.runs(n, 0) <= i && i < pattern.runs(n, 1)) return values[pattern.at[j] + pattern.runs(n, 2) + i];
    return 0.0;
}

/* t += p a + q b + r c + s d, five vectors of one length. */
inline void add_four(Vec t, const double (&p)[4], CVec a, CVec b, CVec c, CVec d) noexcept {
    SIMD
    for (Index i = 0; i < t.size(); ++i) t[i] += (p[0] * a[i] + p[1] * b[i]) + (p[2] * c[i] + p[3] * d[i]);
}

/* Add sum_n amounts[n] row numbers[n] to `out` at ports first to last - 1, four of a group at once. */
inline void combine_rows(const Pattern& pattern, CVec values, Listed listed, Index first, Index last,
                         Vec out) noexcept {
    const auto [numbers, amounts, count] = listed;
    const CInts groups = pattern.group;
    for (Index n = 0; n < count;) {
        const Index group = groups[numbers[n]];
        const bool four = n + 4 <= count && groups[numbers[n + 1]] == group && groups[numbers[n + 2]] == group &&
                          groups[numbers[n + 3]] == group;
        for (Index r = pattern.span(group, 0); r < pattern.span(group, 1); ++r) {
            const Index low = larger(first, pattern.runs(r, 0)), high = lesser(last, pattern.runs(r, 1));
            if (low >= high) continue;
            const auto row = [&](Index m) {
                const Index begin = pattern.at[numbers[m]] + pattern.runs(r, 2) + low;
                return values.slice(begin, begin + high - low);
            };
            const Vec target = out.slice(low, high);
            if (four) {
                const double p[] = {amounts[n], amounts[n + 1], amounts[n + 2], amounts[n + 3]};
                add_four(target, p, row(n), row(n + 1), row(n + 2), row(n + 3));
            } else {
                add(amounts[n], row(n), target);
            }
        }
        n += four ? 4 : 1;
    }
}

/* Add share sum_n amounts[n] matrix[numbers[n]] to `out`, in columns first to last - 1. */
inline void combine(CMat matrix, Listed listed, double share, Index first, Index last, Vec out) noexcept {
    const auto [numbers, amounts, count] = listed;
    const Vec target = out.slice(first, last);
    const auto row = [&](Index m) { return matrix[numbers[m]].slice(first, last); };
    Index n = 0;
    for (; n + 4 <= count; n += 4) {
        const double p[] = {share * amounts[n], share * amounts[n + 1], share * amounts[n + 2], share * amounts[n + 3]};
        add_four(target, p, row(n), row(n + 1), row(n + 2), row(n + 3));
    }
    for (; n < count; ++n) add(share * amounts[n], row(n), target);
}

/* Write the entries of a part of a vector that are not zero into a list; returns their number. */
inline Index pack(CVec vector, Index first, Index last, Ints numbers, Vec amounts) noexcept {
    Index count = 0;
    for (Index i = first; i < last; ++i)
        if (vector[i] != 0.0) {
            numbers[count] = i;
            amounts[count++] = vector[i];
        }
    return count;
}

/* First and last + 1 function in the window of a contact. */
inline std::pair<Index, Index> window_of(const Compliance& matrix, Index k) noexcept {
    const Index first = matrix.space(k, 0), across = matrix.space(k, 1);
    return {first + matrix.window(k, 0) * across, first + matrix.window(k, 1) * across};
}

/* Number of the contact of a row. */
inline Index contact_of(const Compliance& matrix, Index row) noexcept {
    Index k = 0;
    while (matrix.block(k, 1) <= row) ++k;
    return k;
}

/* Add N field to `out`, (c,): the field of functions at the points of contact k, zero outside of its space. */
inline void gather(const Compliance& matrix, Index k, CInts corner, CMat along, CVec field, Vec out) noexcept {
    const Index first = matrix.block(k, 0), last = matrix.block(k, 1), width = matrix.space(k, 1);
    const CVec p = along[0], q = along[1], r = along[2], s = along[3];
    for (Index i = first; i < last; ++i) {
        if (corner[i] < 0) continue;
        const CVec e = field.slice(corner[i], corner[i] + 3 * width + 4), weights = matrix.across[i];
        double total = 0.0;
        for (Index a = 0; a < 4; ++a)
            total +=
                weights[a] * (p[i] * e[a] + q[i] * e[a + width] + r[i] * e[a + 2 * width] + s[i] * e[a + 3 * width]);
        out[i] += total;
    }
}

/* Add share N^T lambda to `out`, (F,); returns the first and last + 1 function changed. */
inline std::pair<Index, Index> scatter(const Compliance& matrix, CInts corner, CMat along, Listed listed, double share,
                                       Vec out) noexcept {
    Index low = out.size(), high = 0;
    for (Index n = 0; n < listed.size; ++n) {
        const Index i = listed.numbers[n];
        if (corner[i] < 0) continue;
        const Index width = matrix.space(contact_of(matrix, i), 1);
        for (Index b = 0; b < 4; ++b) {
            const Index f = corner[i] + b * width;
            const double amount = share * listed.amounts[n] * along(b, i);
            for (Index a = 0; a < 4; ++a) out[f + a] += amount * matrix.across(i, a);
        }
        low = lesser(low, corner[i]);
        high = larger(high, corner[i] + 3 * width + 4);
    }
    return {low, high};
}

/* Compute row i of the matrix in the columns of contact k. */
inline void prepare_part(const Compliance& matrix, Index i, Index k) noexcept {
    const Index first = matrix.block(k, 0), last = matrix.block(k, 1), begin = matrix.pattern.at[i];
    copy(matrix.base[i].slice(first, last), matrix.values.slice(begin + first, begin + last));
    const CInts corner = matrix.corner;
    if (corner[i] < 0) return;
    const Index width = matrix.space(contact_of(matrix, i), 1);
    for (Index b = 0; b < 4; ++b)
        for (Index a = 0; a < 4; ++a) {
            matrix.touched[4 * b + a] = corner[i] + b * width + a;
            matrix.weights[4 * b + a] = matrix.along(b, i) * matrix.across(i, a);
        }
    const auto [low, high] = window_of(matrix, k);
    fill(matrix.scratch.slice(low, high), 0.0);
    combine(matrix.master, {matrix.touched, matrix.weights, matrix.touched.size()}, 1.0, low, high, matrix.scratch);
    gather(matrix, k, corner, matrix.along, matrix.scratch, matrix.values.slice(begin, begin + corner.size()));
}

/* Compute row i of the matrix, in the columns of contacts that are known, if it is not valid in this era. */
inline void prepare(const Compliance& matrix, Index i) noexcept {
    if (matrix.stamp[i] == matrix.era[0]) return;
    matrix.stamp[i] = matrix.era[0];
    for (Index k = 0; k < matrix.space.size(); ++k)
        if (matrix.known[k]) prepare_part(matrix, i, k);
}

/* Compute the columns of contact k too, of the rows listed and of those to come in this era. */
inline void know(const Compliance& matrix, Index k, CInts rows, Index count) noexcept {
    if (matrix.known[k] || matrix.master.size() == 0) return;
    matrix.known[k] = true;
    matrix.era[0] += 1;
    for (Index n = 0; n < count; ++n) {
        matrix.stamp[rows[n]] = matrix.era[0];
        prepare_part(matrix, rows[n], k);
    }
}

}  // namespace gudgeon
