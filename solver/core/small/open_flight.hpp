/* Steps in which no force acts and no point can close: motion alone, as a whole step would find it.
 *
 * After a step without forces, the least margin of all points is a distance that bodies may move before any point can
 * touch; each step takes what its path is at most worth of it.
 */
#pragma once
#include "../response/margins.hpp"
#include "energy.hpp"
#include "flight.hpp"

namespace gudgeon::small {

/* Share by which the sum of the paths' bounds may be less than they are by round-off. */
constexpr double PATH_MARGIN = 1e-9;

/* Set the distance that bodies may move after a step before any point can touch [m]; zero where forces act. */
inline void keep_clearance(const Constants& constants, const State& state, const Problem& problem) noexcept {
    double clearance = std::numeric_limits<double>::infinity();
    bool idle = problem.size[0] == 0 && state.forced[0] == 0 && state.listed[0] == 0;
    for (Index part = 0; part < state.travel.size(); ++part) idle = idle && state.lead(0, part) == 0.0;
    if (idle)
        for (Index n = 0; n < constants.touching.size(); ++n) {
            const Index i = constants.touching[n];
            clearance = lesser(clearance, state.margin[i] * (1.0 - SCRATCH) - state.way[i]);
        }
    state.clearance[0] = idle ? clearance : 0.0;
}

/* Take a step of motion alone; false, and nothing has changed but the clearance, where a point may close in it. */
inline bool fly_open(const Constants& constants, const State& state) noexcept {
    const Mat motion = constants.motion, pushes = constants.push;
    copy(state.q, state.before[0]);
    copy(state.v, state.before[1]);
    propagate(motion[0], motion[1], pushes[0], state.before, constants.gravity, state.q);
    fill(state.lead[1], 0.0);
    look_ahead(constants.parts, state.q, state.before[0], state.travel, state.lead[1], state.ahead);
    double path = 0.0;
    for (Index part = 0; part < constants.parts.size(); ++part)
        path += constants.widest[part] * (state.ahead[part] - state.travel[part]);
    state.clearance[0] -= path * (1.0 + PATH_MARGIN);
    if (!(state.clearance[0] > 0.0)) {
        copy(state.before[0], state.q);
        return false;
    }
    propagate(motion[2], motion[3], pushes[1], state.before, constants.gravity, state.v);
    copy(state.ahead, state.travel);
    copy(constants.gravity, state.force);
    balance_motion(constants, state, 0.0);
    return true;
}

}  // namespace gudgeon::small
