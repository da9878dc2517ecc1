/* The cubics of a collocation step and the estimates of its error. */
#pragma once
#include "../laws/power.hpp"
#include "arrays.hpp"

namespace gudgeon::collocation {

inline constexpr Index POINT_COUNT = 4;
inline constexpr double INVERSE_ROOT_5 = 0.44721359549995793928;
/* Lobatto points of a step of length 1, and their weights. */
inline constexpr double POINTS[4] = {0.0, 0.5 * (1.0 - INVERSE_ROOT_5), 0.5 * (1.0 + INVERSE_ROOT_5), 1.0};
inline constexpr double WEIGHTS[4] = {1.0 / 12, 5.0 / 12, 5.0 / 12, 1.0 / 12};
/* Largest |prod (x - x_j)| of the four points within a step. */
inline constexpr double SPAN = 0.0131;

struct Square {
    double entry[4][4];
    constexpr double operator()(Index i, Index j) const noexcept { return entry[i][j]; }
};

/* Coefficient of (tau/h)^m in the cubic that is 1 at one point and 0 at the others, (4 points, 4 m): the product of
 * (x - x_j)/(x_k - x_j) over the other points j. */
constexpr Square lagrange_coefficients() noexcept {
    Square result{};
    for (int k = 0; k < 4; ++k) {
        result.entry[k][0] = 1.0;
        for (int j = 0; j < 4; ++j) {
            if (j == k) continue;
            const double width = POINTS[k] - POINTS[j];
            for (int m = 3; m >= 0; --m) {
                const double lower = m > 0 ? result.entry[k][m - 1] : 0.0;
                result.entry[k][m] = (lower - POINTS[j] * result.entry[k][m]) / width;
            }
        }
    }
    return result;
}

inline constexpr Square MONOMIALS = lagrange_coefficients();

/* Derivative at each point of the cubic that is 1 at one point and 0 at the others, times h, (4, 4). */
constexpr Square lagrange_rates() noexcept {
    Square result{};
    for (int j = 0; j < 4; ++j)
        for (int k = 0; k < 4; ++k) {
            const double* c = MONOMIALS.entry[k];
            result.entry[j][k] = c[1] + POINTS[j] * (2 * c[2] + POINTS[j] * 3 * c[3]);
        }
    return result;
}

inline constexpr Square RATES = lagrange_rates();

/* The cubic that is 1 at point k, at x. */
inline double cubic(Index k, double x) noexcept {
    return MONOMIALS(k, 0) + x * (MONOMIALS(k, 1) + x * (MONOMIALS(k, 2) + x * MONOMIALS(k, 3)));
}

/* The interpolation error within a step [N], from the cubics' error at a point of the step before.
 *
 * before: Forces of the step before [N], (c, 4).  last: Its length [s], 0 where there is none. */
inline double missed(CMat before, double last, double h, CMat values) noexcept {
    if (last <= 0.0) return 0.0;
    const double x = -last * (1.0 - POINTS[1]) / h;
    const double remainder = std::abs(x * (x - POINTS[1]) * (x - POINTS[2]) * (x - 1.0));
    double worst = 0.0;
    for (Index i = 0; i < values.size(); ++i) {
        double total = 0.0;
        for (Index k = 0; k < POINT_COUNT; ++k) total += values(i, k) * cubic(k, x);
        worst = larger(worst, std::abs(total - before(i, 1)));
    }
    return worst * SPAN / remainder;
}

/* The quadrature error of elastic energy, as a force [N]: relative to the energy of a reference force.
 *
 * Beside a dashpot, a surface returns energy at almost no force, where the error of the force shows nothing. */
inline double unbalanced(CMat laws, double reference, double h, CMat values, CMat depth, CMat rate) noexcept {
    double worst = 0.0;
    for (Index i = 0; i < values.size(); ++i) {
        const CVec law = laws[i];
        const double stiffness = law[0], exponent = law[1];
        double largest = 0.0;
        for (Index j = 0; j < POINT_COUNT; ++j) largest = larger(largest, values(i, j));
        if (largest == 0.0 || stiffness <= 0.0) continue;
        double wrong = law_energy(law, depth(i, 0)) - law_energy(law, depth(i, 3));
        for (Index j = 0; j < POINT_COUNT; ++j) {
            const double deep = depth(i, j);
            if (deep > 0.0) wrong += h * WEIGHTS[j] * (exponent + 1.0) * law_energy(law, deep) / deep * rate(i, j);
        }
        const double scale = (exponent + 1.0) * std::pow(stiffness / reference, 1.0 / exponent);
        worst = larger(worst, std::abs(wrong) * scale);
    }
    return worst;
}

}  // namespace gudgeon::collocation
