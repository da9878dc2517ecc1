/* Co-energies G of charged conductors over the pose of a body.
 *
 * dG/dpose is the generalised force: -G is what the body sees as potential energy, with the sources that hold the
 * potentials. On a grid of poses G is one tensor cubic spline, so that the force is conservative. A pose has three
 * translations [m] and a rotation vector [rad].
 */
#pragma once
#include "co_energies.hpp"

namespace gudgeon {

namespace co_energy {

/* Kinds: a spline on a grid; parallel plates at a given voltage or charge; a sphere and a plane that adhere. */
constexpr Index GRID = 0, VOLTAGE = 1, CHARGE = 2, ADHESION = 3;
/* Numbers of `out`: G, its gradient over six motions, and at LEFT 0 or 1 + the axis along which the pose left the grid;
   7 of plates that touch. */
constexpr Index OUT = 8, LEFT = 7;
constexpr double TOUCHED = 7.0;
constexpr Index DEGREE = 3;
/* Distance beyond the end of an axis, relative to its length, that is round-off: the end counts. */
constexpr double ROUND_OFF = 1e-9;

/* The axis `a` of a head: its place in the pose, its first knot and its count of values. */
inline Index axis_of(CInts head, Index a) noexcept { return head[3 + 3 * a]; }
inline Index start_of(CInts head, Index a) noexcept { return head[4 + 3 * a]; }
inline Index count_of(CInts head, Index a) noexcept { return head[5 + 3 * a]; }

/* Set values and slopes of the four splines that are not zero at x, (4,) each; return the number of their first.
 *
 * `start`, `count`: first knot and values of the axis. Recurrence of de Boor.
 */
inline Index set_basis(CVec data, Index start, Index count, double x, Vec value, Vec slope) noexcept {
    Index low = DEGREE, high = count - 1;
    while (high > low) {
        const Index middle = (low + high + 1) / 2;
        if (data[start + middle] <= x) {
            low = middle;
        } else {
            high = middle - 1;
        }
    }
    value[0] = 1.0;
    fill(slope, 0.0);
    for (Index order = 1; order <= DEGREE; ++order) {
        double carried = 0.0;
        for (Index r = 0; r < order; ++r) {
            const double left = data[start + low + 1 - order + r], right = data[start + low + 1 + r];
            const double share = value[r] / (right - left);
            if (order == DEGREE) {
                slope[r] -= DEGREE * share;
                slope[r + 1] += DEGREE * share;
            }
            value[r] = carried + (right - x) * share;
            carried = (x - left) * share;
        }
        value[order] = carried;
    }
    return low - DEGREE;
}

/* Whether a pose is in the grid; the first axis along which it is not is noted. NaN is outside. */
inline bool inside(CInts head, CVec size, CVec data, CVec x, Vec out) noexcept {
    for (Index i = 0; i < 6; ++i) {
        double low = i > 2 ? -size[1] : -size[0], high = -low;
        for (Index a = 0; a < head[1]; ++a) {
            if (axis_of(head, a) != i) continue;
            low = data[start_of(head, a)];
            high = data[start_of(head, a) + count_of(head, a)];
            const double more = ROUND_OFF * (high - low);
            low -= more;
            high += more;
        }
        if (!(low <= x[i] && x[i] <= high)) {
            out[LEFT] = 1.0 + double(i);
            return false;
        }
    }
    return true;
}

/* Sum of four products. */
inline double sum_of_four(CVec weight, CVec values, Index start) noexcept {
    return weight[0] * values[start] + weight[1] * values[start + 1] + weight[2] * values[start + 2] +
           weight[3] * values[start + 3];
}

/* Set G and its gradient, contracting the coefficients axis by axis from the last; `basis` has (9, 4^d) or more. */
inline void on_grid(CInts head, CVec data, CVec x, Mat basis, Vec out) noexcept {
    const Index count = head[1];
    Index size = 1, span[6] = {};
    for (Index a = 0; a < count; ++a) {
        const Index start = start_of(head, a), nodes = count_of(head, a), left = 4 * a;
        const double place = lesser(larger(x[axis_of(head, a)], data[start]), data[start + nodes]);
        span[a] = set_basis(data, start, nodes, place, basis[0].slice(left, left + 4), basis[1].slice(left, left + 4));
        size *= 4;
    }
    for (Index c = 0; c < size; ++c) {
        Index place = 0, rest = c, stride = 1;
        for (Index a = count - 1; a >= 0; --a) {
            place += (span[a] + rest % 4) * stride;
            rest /= 4;
            stride *= count_of(head, a);
        }
        basis(2, c) = data[head[2] + place];
    }
    for (Index a = count - 1; a >= 0; --a) {
        size /= 4;
        const Vec value = basis[0].slice(4 * a, 4 * a + 4), slope = basis[1].slice(4 * a, 4 * a + 4);
        for (Index j = 0; j < size; ++j) basis(3 + a, j) = sum_of_four(slope, basis[2], 4 * j);
        for (Index n = 0; n <= count; ++n) {
            if (n != 0 && n <= a + 1) continue;
            for (Index j = 0; j < size; ++j) basis(2 + n, j) = sum_of_four(value, basis[2 + n], 4 * j);
        }
    }
    out[0] = basis(2, 0);
    for (Index a = 0; a < count; ++a) out[1 + axis_of(head, a)] = basis(3 + a, 0);
}

/* NaN for G and its gradient: the pose has left the field. */
inline void leave(Vec out) noexcept { fill(out.slice(0, LEFT), std::numeric_limits<double>::quiet_NaN()); }

/* A sphere that adheres to a plane: G = pull reach / (1 + gap / reach), pull (reach - gap) where they touch. */
inline void adhere(CVec size, double gap, Vec out) noexcept {
    const double near = larger(gap, 0.0) / size[7] + 1.0;
    out[0] = size[6] * (size[7] / near + larger(-gap, 0.0));
    for (Index k = 0; k < 3; ++k) out[1 + k] = -size[6] / (near * near) * size[3 + k];
}

}  // namespace co_energy

/* Set G [J] and its gradient [N, N m] of field i at a pose (6,), NaN where the pose has left it.
 *
 * `basis`: work, (9, max(32, 4^axes)). `out`: (8,); its last number is set only where the pose has left.
 */
inline void evaluate(const CoEnergies& fields, Index i, CVec x, Mat basis, Vec out) noexcept {
    using namespace co_energy;
    const CInts head = fields.head[i];
    const CVec size = fields.size[i];
    fill(out.slice(0, LEFT), 0.0);
    if (head[0] == GRID) {
        if (inside(head, size, fields.data, x, out)) {
            on_grid(head, fields.data, x, basis, out);
        } else {
            leave(out);
        }
        return;
    }
    const double gap = size[2] + size[3] * x[0] + size[4] * x[1] + size[5] * x[2];
    if (head[0] == ADHESION) return adhere(size, gap, out);
    if (!(gap > size[7])) {
        out[LEFT] = TOUCHED;
        return leave(out);
    }
    double slope = size[6];
    out[0] = size[6] * gap;
    if (head[0] == VOLTAGE) {
        out[0] = size[6] / gap;
        slope = -size[6] / (gap * gap);
    }
    for (Index k = 0; k < 3; ++k) out[1 + k] = slope * size[3 + k];
}

}  // namespace gudgeon
