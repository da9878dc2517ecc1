/* What a state tells of joints: wrenches of least norm, angles and violations. */
#pragma once
#include "explicit.hpp"

namespace gudgeon::turning {

/* Add the forces of sections to the wrenches of their pairs. */
inline void read_sections(const Model& model, const Work& work, const Reading& reading) noexcept {
    for (Index i = 0; i < model.touch_pair.size(); ++i) {
        if (model.touch_shape[i] == SURFACE) continue;
        const Wrench wrench = wrench_on_journal(model, work, i, three(work.touch[i], Touch::ARM));
        const Index j = model.touch_pair[i];
        for (Index k = 0; k < 3; ++k) {
            reading.wrenches(j, k) += wrench.force[k], reading.wrenches(j, 3 + k) += wrench.moment[k];
            reading.holds(j, k) += wrench.force[k], reading.holds(j, 3 + k) += wrench.moment[k];
        }
    }
}

/* Set a `Reading` of a state with drives (d, 3) and loads (l,) of its time. */
inline void read_state(const Model& model, const Work& work, CVec y, CMat given, CVec amounts,
                       const Reading& reading) noexcept {
    prepare(model, work, y, given, amounts, work.lost);
    fill(reading.angles, 0.0), fill(reading.violations, 0.0);
    fill(reading.wrenches, 0.0), fill(reading.holds, 0.0);
    read_sections(model, work, reading);
    if (!model.row_terms.size()) return;
    solve_least(work);
    copy(work.multiplier, reading.multipliers);
    for (Index t = 0; t < model.terms.size(); ++t)
        if (model.terms(t, 0) == ANGLE) reading.angles[model.terms(t, 1)] = work.value[t];
    for (Index i = 0; i < model.row_terms.size(); ++i) {
        const Index j = model.row_pair[i];
        for (Index part = 0; part < 2; ++part) {
            const Index t = model.row_terms(i, part);
            if (t == NONE) continue;
            const Vec slope = work.slope[t][1];
            for (Index k = 0; k < 6; ++k) {
                const double push = work.multiplier[i] * model.factors(i, part) * slope[k];
                reading.holds(model.terms(t, 1), k) += push;
                if (j != NONE) reading.wrenches(j, k) += push;
            }
        }
        if (j == NONE) continue;
        const double lack = std::abs(violation(model, work, given, i)) / model.reach[i];
        if (!(lack <= reading.violations[j])) reading.violations[j] = lack;
    }
}

}  // namespace gudgeon::turning
