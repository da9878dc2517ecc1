/* Balance of energy of a run whose loop integrates the losses of contacts apart from its states. */
#pragma once
#include "extremes.hpp"

namespace gudgeon {

/* Entry of a balance, after those of `Extreme` up to `EXCHANGED`: energy that contacts have lost so far [J]. */
inline constexpr Index LOST = 3;

/* Update the largest error and the largest exchange [J] of a balance.
 *
 * constants: With omega^2, constant forces and y at the start of the run: `stiffness`, `constant` and `start`, (n,).
 * stored: Energy that contacts store [J].  balance: E0, largest error, largest exchange, energy lost so far, (4,). */
template <class Constants>
inline void update_balance(const Constants& constants, CVec y, CVec v, double stored, Vec balance) noexcept {
    const CVec stiffness = constants.stiffness, constant = constants.constant, start = constants.start;
    double kinetic = 0.0, strain = 0.0, work = 0.0;
    SIMD_SUM(kinetic, strain, work)
    for (Index k = 0; k < y.size(); ++k) {
        kinetic += 0.5 * v[k] * v[k];
        strain += 0.5 * stiffness[k] * y[k] * y[k];
        work += constant[k] * (y[k] - start[k]);
    }
    const double error = kinetic + strain + stored + balance[LOST] - work - balance[START_ENERGY];
    balance[ENERGY_ERROR] = larger(balance[ENERGY_ERROR], std::abs(error));
    balance[EXCHANGED] = larger(balance[EXCHANGED], stored);
}

}  // namespace gudgeon
