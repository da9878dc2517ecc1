/* Tensor cubic B-splines of surfaces and their derivatives. */
#pragma once
#include "../view.hpp"

namespace gudgeon {

/* Cells by which a point may be beyond the end of a surface, which elastic motion moves: its splines go on there. */
constexpr double BORDER = 0.05;

struct FourValues {
    double value[4];
    double operator[](Index k) const noexcept { return value[k]; }
};

/* The four cubic splines at a share t of an interval. */
inline FourValues cubic(double t) noexcept {
    const double s = 1.0 - t;
    return {{s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6}};
}

/* Their derivatives over t. */
inline FourValues cubic_rates(double t) noexcept {
    const double s = 1.0 - t;
    return {{-0.5 * s * s, 1.5 * t * t - 2 * t, -1.5 * s * s + 2 * s, 0.5 * t * t}};
}

/* Their second derivatives over t. */
inline FourValues cubic_second_rates(double t) noexcept { return {{1.0 - t, 3 * t - 2, 1 - 3 * t, t}}; }

/* The interval of a coordinate counted in intervals, -1 beyond their end. */
inline Index interval(double x, Index cells) noexcept {
    if (!(-BORDER <= x && x <= double(cells) + BORDER)) return -1;
    return lesser(larger(Index(std::floor(x)), Index(0)), cells - 1);
}

/* H [m] and its derivatives. */
struct Height {
    double value, s, t, ss, st, tt;
};

/* H and its derivatives of surface s at a place (x0, x1) counted in intervals; `Surfaces` has step, cells, heights. */
template <class Surfaces>
inline Height height_at(const Surfaces& f, Index s, Index cell0, Index cell1, double x0, double x1) noexcept {
    const double p = x0 - double(cell0), q = x1 - double(cell1);
    const FourValues a = cubic(p), b = cubic(q), da = cubic_rates(p), db = cubic_rates(q);
    const FourValues dda = cubic_second_rates(p), ddb = cubic_second_rates(q);
    double h0 = 0.0, hs = 0.0, ht = 0.0, hss = 0.0, hst = 0.0, htt = 0.0;
    for (Index i = 0; i < 4; ++i) {
        const Index row = f.cells(s, 2) + (cell0 + i) * (f.cells(s, 1) + 3) + cell1;
        for (Index j = 0; j < 4; ++j) {
            const double h = f.heights[row + j];
            h0 += a[i] * b[j] * h, hs += da[i] * b[j] * h, ht += a[i] * db[j] * h;
            hss += dda[i] * b[j] * h, hst += da[i] * db[j] * h, htt += a[i] * ddb[j] * h;
        }
    }
    const double u = 1 / f.step(s, 0), v = 1 / f.step(s, 1);
    return {h0, hs * u, ht * v, hss * u * u, hst * u * v, htt * v * v};
}

}  // namespace gudgeon
