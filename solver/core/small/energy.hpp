/* The energy balance of the loop over ports. */
#pragma once
#include "../log/extremes.hpp"
#include "../ports/edges.hpp"
#include "../response/blocks.hpp"
#include "fields.hpp"

namespace gudgeon::small {

/* Displacement of a port in the step [m]. */
inline double step_of(const State& state, Index i) noexcept {
    return state.displacement(0, i) - state.displacement(1, i);
}

/* The same by the residual flexibility. */
inline double response_of(const State& state, Index i) noexcept { return state.response(0, i) - state.response(1, i); }

/* Add the energy [J] that friction takes at a tangential port. */
inline void rub(const Constants& constants, const State& state, Index i, double energy) noexcept {
    state.parts[DISSIPATED] += energy;
    state.rubbed[constants.contact[i]] += energy;
}

/* Add what an impact of rigid contact loses, p 1/2 (u'- + u'+) when it closes, and what a moving obstacle gives [J]. */
inline void account_impact(const Constants& constants, const State& state, Index i) noexcept {
    const Index block = constants.block[i];
    const double mean = state.mean[i], dt = constants.dt[0], belt = constants.belt[i], rate = state.rate[i];
    const double before = moved(constants.rows, i, state.before[1]), after = moved(constants.rows, i, state.v);
    const double hit = before + state.closing[block] * (rate - before), sudden = state.sudden[block];
    const double left = hit + sudden * (after - rate);
    const double middle = sudden * 0.5 * (hit + left) + (1.0 - sudden) * 0.5 * (left + after) - belt;
    if (block != i)
        rub(constants, state, i, -mean * dt * middle);
    else if (constants.restitution[i] < 1.0)
        state.parts[DISSIPATED] -= mean * dt * middle;
    state.parts[WORK] += mean * dt * belt;
}

/* Add the work of a joint or a drive in the step [J]. */
inline void work_of_held(const Constants& constants, const State& state, Index i) noexcept {
    state.parts[WORK] += state.mean[i] * step_of(state, i);
    if (!(constants.bounces && constants.level[constants.block[i]] == STABILISED)) return;
    /* An impulse acts at the velocity of its time, not at the mean one of the step. */
    const double gained = moved(constants.rows, i, state.v) - moved(constants.rows, i, state.before[1]);
    const double sudden = state.unknown[i] - state.foreseen[i];
    state.parts[WORK] -= state.average[0] * constants.dt[0] * sudden * gained;
}

/* Add what the dashpot of a spring takes in the step [J]. */
inline void account_spring(const Constants& constants, const State& state, Index i) noexcept {
    const CVec law = constants.law[i];
    if (!(law[1] > 0.0)) return;
    const CMat knots = knots_of(constants, i);
    const double stored =
        spring_energy(law, knots, state.displacement(0, i)) - spring_energy(law, knots, state.displacement(1, i));
    state.parts[DISSIPATED] += -state.mean[i] * step_of(state, i) - stored;
}

/* Add what a contact law stores and loses in the step [J]. */
inline void account_law(const Constants& constants, const State& state, Index i) noexcept {
    const CVec law = constants.law[i];
    const double before = -state.displacement(1, i), after = -state.displacement(0, i);
    state.parts[CONTACT] += law_energy(law, after);
    state.extreme[DEEPEST] = larger(state.extreme[DEEPEST], after);
    if (!(law[2] > 0.0 || law[3] > 0.0)) return;
    const double lost = (state.mean[i] - quotient(law, before, after)) * (after - before);
    if (lost > 0.0) state.parts[DISSIPATED] += lost; /* No law creates energy: that of a wrong force shall be drift. */
}

/* Add what the layer of a port stores [J]. */
inline void account_layer(const Constants& constants, const State& state, Index i) noexcept {
    const double layer = constants.layer[i], force = state.unknown[i];
    state.parts[CONTACT] += 0.5 * layer * force * force;
    state.extreme[DEEPEST] = larger(state.extreme[DEEPEST], layer * force);
}

/* Add what one port stores, loses and is given in the step [J]. */
inline void port_energy(const Constants& constants, const State& state, Index i) noexcept {
    const Index kind = constants.kind[i], block = constants.block[i];
    const double mean = state.mean[i], step = step_of(state, i);
    if (kind == BILATERAL || kind == DRIVEN) return work_of_held(constants, state, i);
    if (kind == SPRING) return account_spring(constants, state, i);
    if (mean == 0.0 && state.unknown[i] == 0.0 && (block != i || kind == UNILATERAL || kind == CONE)) return;
    if (state.closing[block] >= 0.0) return account_impact(constants, state, i);
    if (block != i) {
        const double belt = constants.belt[i] * constants.dt[0];
        rub(constants, state, i, state.extra[i] * response_of(state, i) - mean * (step - belt));
        state.parts[WORK] += mean * belt;
    } else if (constants.level[i] == VELOCITY) {
        if (constants.restitution[i] < 1.0 && mean * step < 0.0) state.parts[DISSIPATED] -= mean * step;
    } else if (is_law(kind)) {
        account_law(constants, state, i);
    } else {
        account_layer(constants, state, i);
    }
}

/* Add what a port of a unilateral contact or a cone over a compliance stores, loses and is given in the step [J]. */
inline void pressed_energy(const Constants& constants, const State& state, Index i) noexcept {
    if (constants.block[i] == i) return account_layer(constants, state, i);
    const double belt = constants.belt[i] * constants.dt[0], mean = state.mean[i];
    double lost = -mean * (step_of(state, i) - belt);
    if (state.extra[i] != 0.0) {
        if (state.unknown[i] == 0.0)
            state.response(0, i) = displaced(constants.residual, i, state.held, state.listed);
        lost += state.extra[i] * response_of(state, i);
    }
    rub(constants, state, i, lost);
    state.parts[WORK] += mean * belt;
}

/* Add what all ports store, lose and are given in the step [J]; returns what springs store. */
inline double ports_energy(const Constants& constants, const State& state, const Problem& problem) noexcept {
    double springs = 0.0;
    /* Of unilateral contact alone, ports without a force store and lose nothing. */
    const CInts listed =
        constants.plain ? state.forced.slice(1, state.forced[0] + 1) : problem.ports.slice(0, problem.size[0]);
    for (Index a = 0; a < listed.size(); ++a) {
        const Index i = listed[a], kind = constants.kind[i];
        if (constants.edged && state.beside[i]) {
            state.parts[DISSIPATED] += lost_beside(constants, state, i);
        } else if ((kind == UNILATERAL || kind == CONE) && !constants.bounces) {
            pressed_energy(constants, state, i);
        } else {
            port_energy(constants, state, i);
            if (kind == SPRING)
                springs += spring_energy(constants.law[i], knots_of(constants, i), state.displacement(0, i));
        }
    }
    for (Index n = 0; n < constants.given.size(); ++n) {
        const Index i = constants.given[n];
        if (constants.stored[n]) continue;
        if (state.unknown[i] == 0.0 && state.last[i] == 0.0 && state.mean[i] == 0.0) continue;
        state.parts[WORK] += state.mean[i] * step_of(state, i);
        state.parts[WORK] -= state.extra[i] * response_of(state, i);
    }
    return springs;
}

/* What the residual flexibility stores [J]. */
inline double residual_energy(const Constants& constants, const State& state) noexcept {
    const CMat held = state.held, values = constants.residual.values;
    const CIntMat sides = constants.sides;
    const CInts ports = state.listed.slice(1, state.listed[0] + 1);
    double total = 0.0;
    if (held.size() == 0) return total;
    if (constants.sparse) { /* Displacements of these ports are known, and what coordinates have of them. */
        for (Index n = 0; n < ports.size(); ++n)
            total += 0.5 * held(0, ports[n]) * (state.displacement(0, ports[n]) - constants.offset[ports[n]]);
        return total - dot(state.half[0], state.q);
    }
    if (held.size() == 1) {
        for (Index n = 0; n < ports.size(); ++n) total += 0.5 * held(0, ports[n]) * state.response(0, ports[n]);
        return total;
    }
    for (Index s = 0; s < held.size(); ++s)
        for (Index n = 0; n < ports.size(); ++n)
            for (Index b = 0; b < ports.size(); ++b) {
                const Index j = ports[n], i = ports[b], other = sides(i, 0) == sides(j, s) ? 0 : 1;
                total += 0.5 * held(other, i) * between(constants.pattern, values[s], i, j) * held(s, j);
            }
    return total;
}

/* Add the contacts' work [J] in the step on each rigid coordinate and on all, and update the largest exchange. */
inline void exchange(const Constants& constants, const State& state) noexcept {
    const Vec work = state.work;
    const CVec q = state.q, before = state.before[0], pressed = state.pressed;
    const Index count = constants.rigid.size();
    for (Index n = 0; n < count; ++n) {
        const Index k = constants.rigid[n];
        work[n] += pressed[k] * (q[k] - before[k]);
    }
    double total = 0.0;
    SIMD_SUM(total)
    for (Index k = 0; k < q.size(); ++k) total += pressed[k] * (q[k] - before[k]);
    work[count] += total;
    if (constants.divides) {
        /* Bodies at rest exchange round-off: it is compared with what their contact takes up in a step. */
        const double dt = constants.dt[0];
        double taken = 0.0;
        SIMD_SUM(taken)
        for (Index k = 0; k < q.size(); ++k) taken += (dt * pressed[k]) * (dt * pressed[k]);
        state.extreme[EXCHANGED] = larger(state.extreme[EXCHANGED], 0.5 * taken);
    }
    note_exchange(work, state.parts[CONTACT], state.extreme);
}

/* Energies of the coordinates in a step [J]: twice the kinetic and the strain energy, work of gravity, losses. */
struct Motion {
    double kinetic = 0.0, strain = 0.0, work = 0.0, lost = 0.0;
};

inline Motion motion_energy(const Constants& constants, const State& state) noexcept {
    const CVec q = state.q, v = state.v, q0 = state.before[0], v0 = state.before[1], force = state.force;
    const CVec stiffness = constants.stiffness, gravity = constants.gravity;
    const CMat loss = constants.loss;
    const CVec a = loss[0], b = loss[1], c = loss[2], d = loss[3], e = loss[4], f = loss[5];
    double kinetic = 0.0, strain = 0.0, work = 0.0, lost = 0.0;
    SIMD_SUM(kinetic, strain)
    for (Index k = 0; k < q.size(); ++k) {
        kinetic += v[k] * v[k];
        strain += stiffness[k] * q[k] * q[k];
    }
    SIMD_SUM(work)
    for (Index k = 0; k < q.size(); ++k) work += gravity[k] * (q[k] - q0[k]);
    if (!constants.lossy) return {kinetic, strain, work, lost};
    SIMD_SUM(lost)
    for (Index k = 0; k < q.size(); ++k) lost += a[k] * q0[k] * q0[k] + b[k] * q0[k] * v0[k] + c[k] * v0[k] * v0[k];
    SIMD_SUM(lost)
    for (Index k = 0; k < q.size(); ++k) lost += (d[k] * q0[k] + e[k] * v0[k] + f[k] * force[k]) * force[k];
    return {kinetic, strain, work, lost};
}

/* Set kinetic and strain energy [J] at the end of the step, and update the largest error of the balance.
 *
 * stored: by residual flexibility, springs and fields [J]. */
inline void balance_motion(const Constants& constants, const State& state, double stored) noexcept {
    const Vec parts = state.parts;
    const auto [kinetic, strain, work, lost] = motion_energy(constants, state);
    parts[KINETIC] = 0.5 * kinetic;
    parts[STRAIN] = 0.5 * strain + stored;
    parts[DISSIPATED] += lost;
    parts[WORK] += work;
    note_energies(parts, state.extreme);
}

/* Set the energies [J] at the end of the step, and update the largest error of their balance. */
inline void balance(const Constants& constants, const State& state, const Problem& problem) noexcept {
    const Vec parts = state.parts;
    parts[CONTACT] = 0.0;
    const double springs = ports_energy(constants, state, problem), residual = residual_energy(constants, state);
    if (constants.damped) {
        double given = 0.0;
        for (Index i = 0; i < state.mean.size(); ++i)
            given += (state.mean[i] - state.extra[i]) * response_of(state, i);
        parts[DISSIPATED] += given - (residual - state.stored[0]);
    }
    state.stored[0] = residual;
    double stored = residual + springs;
    if (constants.field_start.size() > 0) stored += field_energy(constants, state);
    parts[DISSIPATED] += state.inside[1];
    balance_motion(constants, state, stored);
    exchange(constants, state);
}

}  // namespace gudgeon::small
