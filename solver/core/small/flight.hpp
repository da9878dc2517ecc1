/* The motion of a step under what is known at its start: loads and the first half of the forces. */
#pragma once
#include "../ports/rows.hpp"
#include "../ports/sliding.hpp"
#include "arrays.hpp"

namespace gudgeon::small {

/* Set the direction of each joint's force in the middle of the step, and the length of its measure [m].
 *
 * crank: driven points of joints at the end of the step, (j, 4). */
inline void aim(const Constants& constants, const State& state, CMat crank) noexcept {
    const double dt = constants.dt[0];
    for (Index n = 0; n < constants.joints.size(); ++n) {
        const Index i = constants.joints[n], j = constants.joint[i];
        double size = 0.0, apart = 0.0, closing = 0.0, speed = 0.0;
        for (Index axis = 0; axis < 2; ++axis) {
            const double rate = moved(constants.rows, i + axis, state.v);
            const double place = state.displacement(0, i + axis), pin = state.pin(j, axis);
            const double relative = rate - state.pin(j, 2 + axis);
            state.rod(j, axis) = 2 * place + dt * rate - pin - crank(j, axis);
            size += state.rod(j, axis) * state.rod(j, axis);
            apart += (place - pin) * (place - pin);
            closing += (place - pin) * relative;
            speed += relative * relative;
        }
        for (Index axis = 0; axis < 2; ++axis) state.rod(j, axis) /= std::sqrt(size);
        const double across = larger(0.0, speed - closing * closing / apart);
        state.rod(j, 2) = constants.lengths[i];
        if (constants.level[i] == STABILISED) state.rod(j, 2) += dt * dt * across / (8.0 * constants.lengths[i]);
    }
}

/* Set where a given load that begins was at the start of the step [m]. */
inline void place_given(const Constants& constants, const State& state, Index i) noexcept {
    const double response = displaced(constants.residual, i, state.held, state.listed);
    state.response(1, i) = response;
    state.displacement(1, i) = constants.offset[i] + moved(constants.rows, i, state.before[0]) + response;
}

/* Set the forces of the given loads, and add their means to the generalised force. */
inline void apply_given(const Constants& constants, const State& state, const StepLoads& loads) noexcept {
    for (Index n = 0; n < constants.given.size(); ++n) {
        const Index i = constants.given[n];
        const double mean = loads.mean[n], end = loads.end[n], last = state.last[i];
        if (mean != 0.0) push(constants.rows, i, mean, state.force);
        if (last == 0.0 && (mean != 0.0 || end != 0.0)) place_given(constants, state, i);
        state.unknown[i] = end;
        state.extra[i] = mean - 0.5 * (last + end);
    }
}

/* Set the part of r that is known before contact, and list where it is not zero. */
inline void know_residual(const Constants& constants, const State& state) noexcept {
    const CVec last = state.last;
    for (Index s = 0; s < state.held.size(); ++s) {
        const CMat memory = constants.memory[s];
        const CVec part = memory[0], begin = memory[1], end = memory[2], held = state.held[s];
        const Vec known = state.known[s];
        SIMD
        for (Index i = 0; i < last.size(); ++i) known[i] = part[i] * held[i] + begin[i] * last[i];
        for (Index n = 0; n < constants.given.size(); ++n) {
            const Index i = constants.given[n];
            known[i] += end[i] * state.unknown[i];
        }
    }
    list_forces(state.known, state.listed_known);
}

/* Set q or its rate to the end of the step: a q + b v + c f of each coordinate. */
inline void propagate(CVec a, CVec b, CVec c, CMat before, CVec force, Vec out) noexcept {
    const CVec q = before[0], v = before[1];
    SIMD
    for (Index k = 0; k < out.size(); ++k) out[k] = a[k] * q[k] + b[k] * v[k] + c[k] * force[k];
}

/* Set q and its rate to the end of the step under the loads and the first half of the forces that are not zero. */
inline void fly(const Constants& constants, const State& state, const StepLoads& loads) noexcept {
    const Mat motion = constants.motion, pushes = constants.push;
    const Vec force = state.force;
    copy(state.unknown, state.last);
    copy(state.displacement[0], state.displacement[1]);
    copy(state.response[0], state.response[1]);
    copy(state.q, state.before[0]);
    copy(state.v, state.before[1]);
    const CVec gravity = constants.gravity, contacts = state.half[0], others = state.half[1];
    for (Index k = 0; k < force.size(); ++k) force[k] = gravity[k] + contacts[k] + others[k];
    fill(state.extra, 0.0);
    apply_given(constants, state, loads);
    if (constants.slides) pull_along(constants, state, force);
    propagate(motion[0], motion[1], pushes[0], state.before, force, state.q);
    propagate(motion[2], motion[3], pushes[1], state.before, force, state.v);
    if (constants.damped || constants.given.size() > 0) know_residual(constants, state);
}

}  // namespace gudgeon::small
