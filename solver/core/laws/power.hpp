/* The force of every law of four coefficients, its energy and its mean over a step.
 *
 * F = max(0, K d^n (1 + chi d'/v-) + c d'); d: indentation [m], v-: rate at which this contact began [m/s].
 */
#pragma once
#include "../view.hpp"

namespace gudgeon {

/* Force [N] and its derivatives by d [N/m] and by d' [N s/m]. */
struct Force {
    double force, stiffness, dashpot;
};

/* d^n, by a root or nothing where n is 1.5 or 1. */
inline double power_of(double d, double exponent) noexcept {
    if (exponent == 1.5) return d * std::sqrt(d);
    if (exponent == 1.0) return d;
    return std::pow(d, exponent);
}

/* Zeros where nothing presses. A contact that began at rest, v- = 0, has no loss chi. `law`: K, n, chi, c, (4,). */
inline Force law_force(CVec law, double d, double rate, double approach) noexcept {
    if (d <= 0.0) return {0.0, 0.0, 0.0};
    const double per_rate = approach > 0.0 ? law[2] / approach : 0.0;
    const double elastic = law[0] * power_of(d, law[1]), swell = 1.0 + per_rate * rate;
    const double force = elastic * swell + law[3] * rate;
    if (force <= 0.0) return {0.0, 0.0, 0.0};
    return {force, law[1] * elastic / d * swell, elastic * per_rate + law[3]};
}

/* What the elastic part stores [J], K d^(n+1) / (n + 1). */
inline double law_energy(CVec law, double d) noexcept {
    return d <= 0.0 ? 0.0 : law[0] * power_of(d, law[1]) * d / (law[1] + 1.0);
}

/* Relative difference of depths below which the quotient is a Gauss integral, whose error is below 1e-20. */
constexpr double CLOSE_DEPTHS = 1e-3;
constexpr double GAUSS_POINTS[4] = {0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263};
constexpr double GAUSS_WEIGHTS[4] = {0.17392742256872693, 0.32607257743127307, 0.32607257743127307,
                                     0.17392742256872693};

/* Mean elastic force [N] between two depths [m], (V(d1) - V(d0)) / (d1 - d0).
 *
 * Under it the energy balance of a step is exact to round-off. */
inline double quotient(CVec law, double before, double after) noexcept {
    const double width = after - before;
    if (before <= 0.0 && after <= 0.0) return 0.0;
    if (before > 0.0 && after > 0.0 && std::abs(width) < CLOSE_DEPTHS * larger(before, after)) {
        double total = 0.0;
        for (int point = 0; point < 4; ++point) {
            total += GAUSS_WEIGHTS[point] * law_force(law, before + GAUSS_POINTS[point] * width, 0.0, 1.0).force;
        }
        return total;
    }
    return (law_energy(law, after) - law_energy(law, before)) / width;
}

}  // namespace gudgeon
