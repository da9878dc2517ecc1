/* Electrostatic fields in the loop over ports: explicit, by the pose in the middle of a step.
 *
 * With the exact flight of the coordinates between, that is Stormer and Verlet's method: of second order, and without
 * drift of the energy while the field's own frequency is resolved.
 */
#pragma once
#include "../fields/co_energy.hpp"
#include "../ports/rows.hpp"
#include "arrays.hpp"

namespace gudgeon::small {

/* Evaluate a field at the present displacements, moved on by a time [s] at the present velocities. */
inline void evaluate_ahead(const Constants& constants, const State& state, Index i, double ahead) noexcept {
    const Vec pose = state.field_pose[i];
    for (Index k = 0; k < 6; ++k) {
        pose[k] = constants.field_start(i, k);
        for (Index side = 0; side < 2; ++side) {
            const Index n = constants.field_loads(i, side, k);
            if (n < 0) continue;
            const Index p = constants.given[n];
            double position = moved(constants.rows, p, state.q) +
                              displaced(constants.residual, p, state.held, state.listed);
            position += ahead * moved(constants.rows, p, state.v);
            pose[k] += side == 0 ? position : -position;
        }
    }
    evaluate(constants.fields, i, pose, state.field_basis, state.field[i]);
}

/* Set the loads of a field at both of its ends, of one moment: as means, or at the end of the step. */
inline void put(const Constants& constants, Vec loads, Index i, CVec amounts) noexcept {
    for (Index k = 0; k < 6; ++k) {
        const Index near = constants.field_loads(i, 0, k), far = constants.field_loads(i, 1, k);
        if (near >= 0) loads[near] = amounts[1 + k];
        if (far >= 0) loads[far] = -amounts[1 + k];
    }
}

/* Set the loads of all fields in a step; false where a body leaves one. */
inline bool set_fields(const Constants& constants, const State& state, const StepLoads& loads) noexcept {
    const double dt = constants.dt[0];
    for (Index i = 0; i < constants.field_start.size(); ++i) {
        const Vec field = state.field[i];
        evaluate_ahead(constants, state, i, 0.5 * dt);
        if (field[co_energy::LEFT] != 0.0) return false;
        put(constants, loads.mean, i, field);
        put(constants, loads.end, i, field);
        evaluate_ahead(constants, state, i, dt);
        if (field[co_energy::LEFT] == 0.0) put(constants, loads.end, i, field);
        field[co_energy::LEFT] = 0.0;
    }
    return true;
}

/* What all fields store [J]; where a body has left one, what they stored before. */
inline double field_energy(const Constants& constants, const State& state) noexcept {
    double total = 0.0;
    bool left = false;
    for (Index i = 0; i < constants.field_start.size(); ++i) {
        evaluate_ahead(constants, state, i, 0.0);
        total -= state.field(i, 0);
        left = left || state.field(i, co_energy::LEFT) != 0.0;
    }
    if (!left) state.field_energy[0] = total;
    return state.field_energy[0];
}

/* Whether a body has left a field. */
inline bool field_left(const Constants& constants, const State& state) noexcept {
    bool left = false;
    for (Index i = 0; i < constants.field_start.size(); ++i) left = left || state.field(i, co_energy::LEFT) != 0.0;
    return left;
}

}  // namespace gudgeon::small
