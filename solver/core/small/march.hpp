/* The implicit time loop over ports: exact modal motion under mean forces, all ports respond at the end of the step.
 *
 * The mean force of a port over a step is 1/2 (f_n + f+) where it has a compliance of its own, and its unknown where
 * contact is rigid, where a law is its only compliance, and for joints. Where contact closes or opens within the step, at
 * the share theta of it, the mean is 1/2 (1 - theta) f+ or 1/2 theta f_n, so that it does the work that its compliance
 * stores: the average of the force along the step. Rigid contact keeps 0 <= f _|_ u'+ + e u'- >= 0 once its gap closes
 * (J. J. Moreau, 1988). Points that the path of the coordinates cannot have closed are left out.
 */
#pragma once
#include "fields.hpp"
#include "divided.hpp"
#include "open_flight.hpp"

namespace gudgeon::small {

/* Add the mean force of port i, over the steps of a sample, to the resultant of its contact [N]. */
inline void add_resultant(const Constants& constants, const State& state, Index i, double stride, Mat forces) noexcept {
    const Index k = constants.contact[i];
    if (k < 0 || state.mean[i] == 0.0) return;
    const double force = state.mean[i] / stride;
    for (Index axis = 0; axis < 3; ++axis) forces(k, axis) += force * constants.direction(i, axis);
}

/* Take one step, and add the resultants of its contacts to those of its sample, (k, 3); false where it failed. */
inline bool take_step(const Loop& loop, const StepLoads& loads, CMat crank, Index number, Index stride,
                      Mat forces) noexcept {
    const auto& [constants, state, problem, log] = loop.whole;
    if (state.clearance[0] > 0.0 && fly_open(constants, state)) {
        log_forces(constants, state, problem, log, number);
        return true;
    }
    if (constants.divides) {
        if (!divide_step(loop, loads, number)) return false;
        for (Index i = 0; i < state.mean.size(); ++i) add_resultant(constants, state, i, double(stride), forces);
        return true;
    }
    if (!advance(loop.whole, loads, crank)) return false;
    finish(loop.whole, double(number + 1) * constants.dt[0]);
    for (Index j = 0; j < state.pin.size(); ++j) copy(crank[j], state.pin[j]);
    log_forces(constants, state, problem, log, number);
    for (Index n = 1; n <= state.forced[0]; ++n)
        add_resultant(constants, state, state.forced[n], double(stride), forces);
    if (constants.idles) keep_clearance(constants, state, problem);
    return true;
}

/* Set the forces at the end of a sample [N]; unknowns of laws alone are means of the last step. */
inline void keep_forces(const Constants& constants, const State& state, Vec ports) noexcept {
    copy(state.unknown, ports);
    for (Index n = 1; n <= state.forced[0]; ++n) {
        const Index i = state.forced[n];
        if (!(is_law(constants.kind[i]) && constants.share[i] == 1.0) || state.beside[i]) continue;
        const double rate = -moved_over(constants, state.slides, i, NOW, state.v);
        ports[i] = law_force(constants.law[i], -state.displacement(0, i), rate, state.approach[i]).force;
    }
}

/* Keep the state at the end of a sample. */
inline void keep_sample(const Constants& constants, const State& state, const Found& out, Index sample) noexcept {
    copy(state.parts, out.energies[sample]);
    copy(state.q, out.q[sample]);
    copy(state.v, out.v[sample]);
    keep_forces(constants, state, out.ports[sample]);
    set_lengths(constants, state, out.lengths[sample]);
}

/* Advance the samples of `out` by `stride` steps each, from step number `first`; false where this failed. */
inline bool march(const Loop& loop, const Given& given, Index first, Index stride, const Found& out) noexcept {
    const auto& [constants, state, problem, log] = loop.whole;
    const bool fields = constants.field_start.size() > 0;
    for (Index sample = 0; sample < out.forces.size(); ++sample) {
        for (Index part = 0; part < stride; ++part) {
            const Index step = sample * stride + part;
            const StepLoads loads{given.loads[0][step], given.loads[1][step]};
            copy(given.driven[step], state.wanted);
            state.field_energy[1] = double(first + step);
            if (fields && !set_fields(constants, state, loads)) return false;
            if (!take_step(loop, loads, given.crank[step], first + step, stride, out.forces[sample])) return false;
            if (fields && field_left(constants, state)) return false;
            const Vec sums = out.loads[sample];
            for (Index i = 0; i < constants.loaded.size(); ++i)
                sums[i] += state.mean[constants.loaded[i]] / double(stride);
        }
        keep_sample(constants, state, out, sample);
    }
    return true;
}

}  // namespace gudgeon::small
