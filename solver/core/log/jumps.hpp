/* Impulses without duration in the log of impacts. */
#pragma once
#include "impacts.hpp"

namespace gudgeon {

/* Evaluate the windowed force of the present impact of contact k up to its end, with no force after it. */
inline void complete_impact(const ImpactLog& log, Index k) noexcept {
    Index number = log.steps(k, PRESENT);
    while (double(number - log.steps(k, LAST)) * log.dt < log.separation) add_impulse(log, k, ++number, false);
}

/* Begin an impact with an impulse without duration, which the caller adds by `add_jump`, unless one goes on.
 *
 * time: [s].  rate: of the gap before it [m/s]. */
inline void note_impact(const ImpactLog& log, Index k, Index number, double time, double rate) noexcept {
    const Ints steps = log.steps[k];
    if (steps[FIRST] >= 0 && steps[TOUCHING] == 0 && time - log.running(k, ENDS) >= log.separation) {
        if (steps[PRESENT] < number) add_impulse(log, k, number, pressed(log, k));
        complete_impact(log, k);
        end_impact(log, k);
    }
    note_change(log, k, true, time, 0.0, rate);
    if (steps[FIRST] < 0) begin_impact(log, k, number);
    steps[LAST] = number;
}

/* Add an impulse without duration along an axis to the present impact [N s]: it is in no force but the windowed. */
inline void add_jump(const ImpactLog& log, Index k, Index axis, double impulse) noexcept {
    log.sudden(k, axis) += impulse;
    log.jump(k, axis) += impulse;
}

}  // namespace gudgeon
