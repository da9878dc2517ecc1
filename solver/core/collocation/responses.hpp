/* Motion from rest of undamped coordinates under forces y'' + omega^2 y = tau^m, m = 0 ... M. */
#pragma once
#include "../view.hpp"

namespace gudgeon::collocation {

/* omega tau up to which the power series is used; above it the closed form loses less than three digits. */
inline constexpr double SERIES_REACH = 0.5;

/* Sum the power series of both in x = omega tau, smallest term first, for coordinate k at time i. */
inline void sum_series(double x, double tau, CMat place, CMat rate, Index i, Index k, Cube y, Cube v) noexcept {
    const Index terms = place.shape[1];
    double power = tau;
    for (Index m = 0; m < y.size(); ++m) {
        double displacement = 0.0, velocity = 0.0;
        for (Index j = terms - 1; j >= 0; --j) {
            displacement = place(m, j) - displacement * x * x;
            velocity = rate(m, j) - velocity * x * x;
        }
        v(m, i, k) = velocity * power;
        power *= tau;
        y(m, i, k) = displacement * power;
    }
}

/* Integrate by parts from m = 0 up: y_m = (tau^m - m (m-1) y_(m-2)) / omega^2, v_m = m y_(m-1). */
inline void integrate_by_parts(double omega, double tau, Index i, Index k, Cube y, Cube v) noexcept {
    const double sine = std::sin(omega * tau), half = std::sin(0.5 * omega * tau), stiffness = omega * omega;
    double power = 1.0;
    for (Index m = 0; m < y.size(); ++m) {
        if (m == 0) {
            y(0, i, k) = 2.0 * half * half / stiffness, v(0, i, k) = sine / omega;
        } else if (m == 1) {
            y(1, i, k) = (tau - sine / omega) / stiffness, v(1, i, k) = y(0, i, k);
        } else {
            y(m, i, k) = (power - double(m * (m - 1)) * y(m - 2, i, k)) / stiffness;
            v(m, i, k) = double(m) * y(m - 1, i, k);
        }
        power *= tau;
    }
}

/* Fill displacement and velocity under each unit force, (M + 1, t, n) each.
 *
 * omega: [rad/s], (n,).  time: [s], (t,).  place, rate: Coefficients of the series of both, (M + 1, terms). */
inline void respond(CVec omega, CVec time, CMat place, CMat rate, Cube y, Cube v) noexcept {
    for (Index i = 0; i < time.size(); ++i)
        for (Index k = 0; k < omega.size(); ++k) {
            const double tau = time[i], x = omega[k] * tau;
            if (x <= SERIES_REACH)
                sum_series(x, tau, place, rate, i, k, y, v);
            else
                integrate_by_parts(omega[k], tau, i, k, y, v);
        }
}

}  // namespace gudgeon::collocation
