/* What steps with several stages have in common: when their stages are found, their rates, and the energy balance. */
#pragma once
#include "accelerations.hpp"
#include "step_arrays.hpp"

namespace gudgeon::turning {

/* Power of the last step's ratio that is taken for the first change. */
constexpr double KNOWN_POWER = 0.8;
/* Ratio that is taken for the first change after a step that did not converge. */
constexpr double FAILED_RATIO = 0.5;
/* Error of the balance over the amounts that it is made of, below which it is round-off. */
constexpr double ROUNDING = 1e-14;

enum class Verdict { open, found, failed };

/* Whether stages are found, failed or still open after a change.
 *
 * Changes that decrease by a ratio leave an error that is their geometric series (Hairer, Wanner, Solving ODE II,
 * IV.8).
 * rate: ratio of changes in the last step that needed more than one, which is renewed, (1,).  before: the change before
 * it, infinite for the first one. */
inline Verdict verdict(Vec rate, double change, double before, const Limits& limits, double tolerance) noexcept {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (!(change < infinity)) return Verdict::failed;
    double share = std::pow(rate[0], KNOWN_POWER);
    if (before < infinity) {
        const double ratio = before > 0.0 ? change / before : 0.0;
        if (!(ratio < limits.ratio)) {
            rate[0] = FAILED_RATIO;
            return change <= tolerance ? Verdict::found : Verdict::failed;
        }
        rate[0] = larger(ratio, limits.least);
        share = ratio / (1.0 - ratio);
    }
    return share * change <= tolerance ? Verdict::found : Verdict::open;
}

/* Set the rates of a state under given multipliers, and what rates of rows lack, in `right`. */
inline void set_stage(const Model& model, const Work& work, CVec y, CMat given, CVec amounts, Vec out) noexcept {
    const Vec sums = out.slice(out.size() - SUMS, out.size());
    fill(sums, 0.0);
    set_poses_at(model, work, y, given);
    set_pushes(model, work, amounts, sums);
    if (model.row_terms.size()) {
        set_blocks(model, work);
        set_speed_lacks(model, work, y, given);
    }
    set_rates(model, work, y, given, out);
}

/* Kinetic and strain energy, other potentials, and the sum of the amounts that they are made of [J]. */
struct EnergyParts {
    double kinetic = 0.0, strain = 0.0, other = 0.0, size = 0.0;
};

/* Energies [J]: kinetic; all with what was lost and less what was done on the bodies; the amounts it is made of. */
struct EnergyBalance {
    double kinetic, total, size;
};

/* Add the energies of bodies under gravity. */
inline void add_bodies(const Model& model, const Work& work, CVec y, EnergyParts& parts) noexcept {
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Index s = WIDTH * b;
        for (Index i = 0; i < 3; ++i) {
            const double v = y[s + SPEED + i], fall = model.mass[b] * model.gravity[i] * y[s + PLACE + i];
            parts.kinetic += 0.5 * (model.mass[b] * v * v + work.omega(b, i) * y[s + SPIN + i]);
            parts.other -= fall;
            parts.size += std::abs(fall);
        }
        for (Index k = 0; k < model.elastic(b, 0); ++k) {
            const double q = y[model.elastic(b, 1) + k];
            parts.kinetic += 0.5 * work.modal(b, 3 + k) * y[model.elastic(b, 2) + k];
            parts.strain += 0.5 * model.modal_stiffness(b, k) * q * q;
        }
    }
}

/* Add the energies of springs between two points. */
inline void add_springs(const Model& model, const Work& work, EnergyParts& parts) noexcept {
    const Index first = 2 * model.owner.size();
    for (Index k = 0; k < model.spring.size(); ++k) {
        const Vec a = work.place[first + 2 * k], b = work.place[first + 2 * k + 1];
        double square = 0.0, reach = 0.0;
        for (Index i = 0; i < 3; ++i) {
            square += (b[i] - a[i]) * (b[i] - a[i]);
            reach += std::abs(a[i]) + std::abs(b[i]);
        }
        const double longer = std::sqrt(square) - model.spring(k, 2);
        parts.strain += 0.5 * model.spring(k, 0) * longer * longer;
        parts.size += model.spring(k, 0) * std::abs(longer) * reach;
    }
}

/* Add the energies of bushings and fields. */
inline void add_bushings(const Model& model, const Work& work, EnergyParts& parts) noexcept {
    for (Index u = 0; u < model.bush_rest.size(); ++u) {
        const Vec x = work.bush[u];
        for (Index k = 0; k < 6; ++k)
            for (Index l = 0; l < 6; ++l) parts.strain += 0.5 * x[k] * model.bush_stiffness(u, k, l) * x[l];
    }
    for (Index n = 0; n < work.field.size(); ++n) {
        parts.other -= work.field(n, 0);
        parts.size += std::abs(work.field(n, 0));
    }
}

/* The balance of a state whose points and bushings are set. */
inline EnergyBalance balance(const Model& model, const Work& work, CVec y) noexcept {
    const CVec sums = y.slice(y.size() - SUMS, y.size());
    EnergyParts parts;
    add_bodies(model, work, y, parts);
    add_springs(model, work, parts);
    add_bushings(model, work, parts);
    const double stored = parts.kinetic + parts.strain;
    return {parts.kinetic, stored + parts.other + sums[LOST] - sums[WORK],
            parts.size + stored + std::abs(sums[LOST]) + std::abs(sums[WORK])};
}

/* By how much a balance changed beyond round-off of amounts of a size [J]. */
inline double imbalance(double before, double after, double size) noexcept {
    const double beyond = std::abs(after - before) - ROUNDING * size;
    return beyond > 0.0 ? beyond : 0.0;
}

}  // namespace gudgeon::turning
