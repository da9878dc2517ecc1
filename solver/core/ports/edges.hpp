/* Which points are beside the face that they may meet, and what a point loses that leaves its face. */
#pragma once
#include "../laws/power.hpp"
#include "../small/arrays.hpp"
#include "rows.hpp"

namespace gudgeon::small {

constexpr double FAR_BESIDE = 10.0;  /* Gap of a point that leaves its face, over what the forces of all points can move
                                      * it: it has no force. */

/* Whether the port is the first of a contact law. */
inline bool is_law(Index kind) noexcept { return kind == LAW || kind == RUBBING_LAW; }

/* Set which points are beside their faces at the start of the step.
 *
 * A point that came past an edge inside the solid stays beside until it is out of it: there, an edge of the solid has
 * touched the body between its points, which no force of a point can tell. */
inline void find_beside(const Constants& constants, const State& state) noexcept {
    const Edges& edges = constants.edges;
    const CVec q = state.before[0];
    state.inside[1] = 0.0;
    for (Index n = 0; n < edges.ports.size(); ++n) state.apart[edges.ports[n]] = false;
    for (Index n = 0; n < edges.ports.size(); ++n)
        if (edges.offset[n] + dot(edges.rows[n], q) < 0.0) state.apart[edges.ports[n]] = true;
    Index last = -1;
    for (Index n = 0; n < edges.ports.size(); ++n) {
        const Index i = edges.ports[n];
        if (i == last) continue;
        last = i;
        if (state.apart[i]) {
            state.beside[i] = true;
        } else if (state.beside[i]) {
            const double gap = constants.offset[i] + moved(constants.rows, i, q);
            state.beside[i] = gap < 0.0;
            state.inside[0] = larger(state.inside[0], -gap);
        }
    }
}

/* Set the gaps of points beside their faces so that they have no force [m]; what their laws stored is lost. */
inline void clear(const Constants& constants, const State& state, CInts ports) noexcept {
    if (!constants.edged) return;
    double total = 0.0;
    const CVec last = state.last;
    SIMD_SUM(total)
    for (Index j = 0; j < last.size(); ++j) total += std::abs(last[j]);
    for (Index a = 0; a < ports.size(); ++a) {
        const Index i = ports[a];
        if (!state.beside[i]) continue;
        const double reach = between(constants.pattern, constants.columns, i, i);
        const double far = larger(state.gap[i], FAR_BESIDE * reach * total);
        if (is_law(constants.kind[i]) && state.displacement(1, i) < 0.0) {
            state.inside[1] += law_energy(constants.law[i], -state.displacement(1, i));
            state.displacement(1, i) = far;
        }
        state.gap[i] = far;
    }
}

/* What the compliance of a point loses that leaves its face with a force [J]; of a law, beside the law. */
inline double lost_beside(const Constants& constants, const State& state, Index i) noexcept {
    const double last = state.last[i];
    if (last == 0.0 || state.unknown[i] != 0.0) return 0.0;
    state.response(0, i) = displaced(constants.residual, i, state.held, state.listed);
    if (is_law(constants.kind[i])) return 0.5 * last * (state.response(1, i) - state.response(0, i));
    double lost = -state.mean[i] * (state.displacement(0, i) - state.displacement(1, i));
    lost += state.extra[i] * (state.response(0, i) - state.response(1, i));
    return lost + 0.5 * constants.layer[i] * last * last;
}

}  // namespace gudgeon::small
