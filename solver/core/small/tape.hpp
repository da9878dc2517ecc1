/* The states of a run at the ends of all its steps, from which its derivatives are found. */
#pragma once
#include "march.hpp"

namespace gudgeon::small {

/* Of S steps, the start included where there is one row more. */
struct Tape {
    GUDGEON_SHAPES("q S+1 m, v S+1 m, unknown S+1 p, held S+1 s p, mean S p")
    Mat q, v;         /* (S + 1, m) */
    Mat unknown;      /* As in `State` [N], (S + 1, p). */
    Cube held;  /* r: forces in the residual flexibility [N], (S + 1, s, p). */
    Mat mean;         /* Mean forces of the steps [N], (S, p). */
    GUDGEON_FIELDS(q, v, unknown, held, mean)
};

/* Keep the state after so many steps. */
inline void keep_state(const State& state, const Tape& tape, Index steps) noexcept {
    copy(state.q, tape.q[steps]);
    copy(state.v, tape.v[steps]);
    copy(state.unknown, tape.unknown[steps]);
    for (Index s = 0; s < state.held.size(); ++s) copy(state.held[s], tape.held[steps][s]);
    if (steps > 0) copy(state.mean, tape.mean[steps - 1]);
}

/* Take the steps of a tape from the start; false where one failed.  found: histories of a single sample. */
inline bool march_kept(const Loop& loop, const Given& given, const Found& found, const Tape& tape) noexcept {
    const State& state = loop.whole.state;
    keep_state(state, tape, 0);
    for (Index step = 0; step < tape.mean.size(); ++step) {
        const StepLoads loads{given.loads[0][step], given.loads[1][step]};
        fill(found.forces, 0.0);
        fill(state.mean, 0.0); /* Steps of motion alone leave those of the last one with forces. */
        if (!take_step(loop, loads, given.crank[step], step, 1, found.forces[0])) return false;
        keep_state(state, tape, step + 1);
    }
    return true;
}

}  // namespace gudgeon::small
