/* The explicit time loop: exact modal motion between contact impulses, one at the middle of each step.
 *
 * A contact of several coupled points is a linear complementarity problem; where C is diagonal each point has its own
 * spring, x = <-g/C - d dg/dt>, with an optional dashpot d that is implicit in its own row. Energy is computed at half
 * an impulse, where position and velocity are synchronous.
 */
#pragma once
#include "../log/impacts.hpp"
#include "../response/complementarity.hpp"
#include "../log/extremes.hpp"

namespace gudgeon::explicitly {

constexpr double GAP_TOLERANCE = 1e-12;  /* Violation of a gap, over the largest overlap without forces. */
constexpr Index WIDE = 16;               /* Contact rows from which gaps are summed column by column. */
constexpr Index SINGULAR_AT = 3;         /* Entry of `State::counts`. */

/* Constants of a run. Shapes: m coordinates, c contact rows, r rigid coordinates. */
struct Constants {
    GUDGEON_SHAPES("flight 4 m, half 4 m, stiffness m, rows c m, span c 2, columns m c, reach m, gap c, "
                   "compliance c c, dashpot c, normals c 3, contact c, rigid r")
    double dt;           /* [s] */
    CMat flight, half;   /* Propagator entries q<-q, q<-v, v<-q, v<-v over dt and over dt/2, (4, m). */
    CVec stiffness;      /* [rad^2/s^2], (m,) */
    CMat rows;           /* dg/dq, (c, m). */
    CIntMat span;        /* First and last + 1 coordinate on which each row depends, (c, 2). */
    bool narrow;         /* Whether rows depend on few of the coordinates, so that columns are not used. */
    CMat columns;        /* dg/dq by coordinate, (m, c). */
    CVec reach;          /* Largest |dg/dq| of any row, (m,). */
    CVec gap;            /* g0 [m], (c,). */
    CMat compliance;     /* C [m/N], (c, c); only its diagonal is used where `coupled` is false. */
    Compliance matrix;   /* C, for the contact problem of coupled points. */
    bool coupled;
    CVec dashpot;        /* d [N s/m], (c,). */
    CMat normals;        /* Direction of each row's force on its body, (c, 3). */
    CInts contact;       /* Contact number of each row, (c,). */
    CInts rigid;         /* Numbers of the rigid coordinates, (r,). */
    GUDGEON_FIELDS(dt, flight, half, stiffness, rows, span, narrow, columns, reach, gap, compliance, matrix, coupled,
                   dashpot, normals, contact, rigid)
};

/* Variables of a run, updated in place. */
struct State {
    GUDGEON_SHAPES("q m, v m, multipliers c, gaps c, free c, jump m, carried 2, ends 2 m, impulses c, work r+1, "
                   "energy 4, counts 4, extreme 4")
    Vec q, v;
    ActiveSet active;
    Vec multipliers;  /* Of the last impulse [N], (c,). */
    Vec gaps;         /* g + C x of the last impulse [m], (c,). */
    Vec free;         /* Gaps without the forces of an impulse [m], (c,). */
    Vec jump;         /* Change of velocities by an impulse, (m,). */
    Vec carried;      /* Gap [m] of the only point at the next impulse and its rate [m/s], where the last one acted;
                       * else NaN, (2,). */
    Mat ends;         /* q and its rate at the end of a sample, half a step before the next impulse, (2, m). */
    Vec impulses;     /* Of each row [N s], (c,). */
    Vec work;         /* Of contacts on each rigid coordinate, then on all together [J], (r + 1,). */
    Vec energy;       /* By `Part`, at the last impulse [J], (4,). */
    Ints counts;      /* Active rows, impulses in contact, pivots, number of a singular impulse, (4,). */
    Vec extreme;      /* By `Extreme`, (4,). */
    ImpactLog log;
    GUDGEON_FIELDS(q, v, active, multipliers, gaps, free, jump, carried, ends, impulses, work, energy, counts, extreme, log)
};

/* The product of a row with coordinates or their rates. */
inline double along(const Constants& constants, Index i, CVec q) noexcept {
    const Index first = constants.span(i, 0), last = constants.span(i, 1);
    return dot(constants.rows[i].slice(first, last), q.slice(first, last));
}

/* Move all coordinates to the next impulse. */
inline void fly(CMat flight, Vec q, Vec v) noexcept {
    const CVec qq = flight[0], qv = flight[1], vq = flight[2], vv = flight[3];
    SIMD
    for (Index k = 0; k < q.size(); ++k) {
        const double place = q[k], fast = v[k];
        q[k] = qq[k] * place + qv[k] * fast;
        v[k] = vq[k] * place + vv[k] * fast;
    }
}

/* Set the gaps g = g0 + rows q [m], row by row where they are few or short, else four columns at once. */
inline void free_gaps(const Constants& constants, CVec q, Vec gap) noexcept {
    if (gap.size() < WIDE || constants.narrow) {
        for (Index i = 0; i < gap.size(); ++i) gap[i] = constants.gap[i] + along(constants, i, q);
        return;
    }
    copy(constants.gap, gap);
    const CMat columns = constants.columns;
    Index k = 0;
    for (; k + 4 <= q.size(); k += 4) {
        const double amounts[] = {q[k], q[k + 1], q[k + 2], q[k + 3]};
        add_four(gap, amounts, columns[k], columns[k + 1], columns[k + 2], columns[k + 3]);
    }
    for (; k < q.size(); ++k) add(q[k], columns[k], gap);
}

/* The number of steps in which no gap can close: speeds stay below (v^2 + w^2 q^2)^1/2, the least gap is given. */
inline Index clear_steps(const Constants& constants, const State& state, double lowest) noexcept {
    double speed = 0.0;
    SIMD_SUM(speed)
    for (Index k = 0; k < state.q.size(); ++k)
        speed += constants.reach[k] *
                 std::sqrt(state.v[k] * state.v[k] + constants.stiffness[k] * state.q[k] * state.q[k]);
    if (speed * constants.dt * 1e9 <= lowest) return 1'000'000'000;
    return Index(lowest / (speed * constants.dt));
}

/* Find multipliers [N] and gaps [m] of coupled points; false where their compliance is singular. */
inline bool coupled_forces(const Constants& constants, const State& state, Vec gap, double tolerance) noexcept {
    const Index pivots = solve_lcp(constants.matrix, gap, state.active, state.multipliers, state.gaps, tolerance);
    state.counts[ACTIVE] = state.active.size[0];
    if (pivots < 0) return false;
    state.counts[PIVOTS] += pivots;
    state.energy[CONTACT] = -0.5 * dot(state.multipliers, gap);  /* On the active set C x = -g. */
    return true;
}

struct Damped {
    double force;  /* [N] */
    double taken;  /* By the dashpot [J]. */
};

/* Force of a spring and a dashpot [N s/m] side by side.
 *
 * elastic: of the spring [N].  rate: of the gap before the impulse [m/s].  mobility: its change per impulse [1/kg]. */
inline Damped damped_force(double elastic, double dashpot, double rate, double mobility, double dt) noexcept {
    const double force = larger(0.0, (elastic - dashpot * rate) / (1.0 + 0.5 * dt * dashpot * mobility));
    return {force, -dt * (force - elastic) * (rate + 0.5 * dt * mobility * force)};
}

/* Find the multipliers [N] of points that do not couple. */
inline void springs(const Constants& constants, const State& state, CVec gap) noexcept {
    double stored = 0.0, lost = 0.0;
    Index closed = 0;
    for (Index i = 0; i < gap.size(); ++i) {
        state.multipliers[i] = 0.0, state.gaps[i] = gap[i];
        if (!(gap[i] < 0.0)) continue;
        closed += 1;
        const double elastic = -gap[i] / constants.compliance(i, i);
        double force = elastic;
        if (constants.dashpot[i] > 0.0) {
            const auto damped = damped_force(elastic, constants.dashpot[i], along(constants, i, state.v),
                                             along(constants, i, constants.rows[i]), constants.dt);
            force = damped.force, lost += damped.taken;
        }
        state.multipliers[i] = force;
        stored += 0.5 * elastic * -gap[i];
    }
    state.counts[ACTIVE] = closed;
    state.energy[CONTACT] = stored;
    state.energy[DISSIPATED] += lost;
}

/* Update the largest error of the energy balance [J], the largest exchange [J], and count the impulse. */
inline void keep_balance(const State& state) noexcept {
    const Vec energy = state.energy, extreme = state.extreme;
    note_exchange(state.work, energy[CONTACT], extreme);
    const double total = energy[KINETIC] + energy[STRAIN] + energy[CONTACT] + energy[DISSIPATED];
    extreme[ENERGY_ERROR] = larger(extreme[ENERGY_ERROR], std::abs(total - extreme[START_ENERGY]));
    state.counts[CONTACT_STEPS] += 1;
}

/* Apply the multipliers [N] to the velocities, with energies and work in the middle of the impulse [J]. */
inline void push(const Constants& constants, const State& state) noexcept {
    const Vec q = state.q, v = state.v, jump = state.jump;
    const CVec stiffness = constants.stiffness;
    const CInts rigid = constants.rigid;
    fill(jump, 0.0);
    double deepest = state.extreme[DEEPEST];
    for (Index i = 0; i < state.gaps.size(); ++i) {
        const double impulse = constants.dt * state.multipliers[i];
        if (impulse != 0.0) {
            state.impulses[i] += impulse;
            const Index first = constants.span(i, 0), last = constants.span(i, 1);
            add(impulse, constants.rows[i].slice(first, last), jump.slice(first, last));
        }
        deepest = larger(deepest, -state.gaps[i]);
    }
    state.extreme[DEEPEST] = deepest;
    for (Index n = 0; n < rigid.size(); ++n) state.work[n] += jump[rigid[n]] * (v[rigid[n]] + 0.5 * jump[rigid[n]]);
    double total = 0.0, strain = 0.0, kinetic = 0.0;
    SIMD_SUM(total, strain, kinetic)
    for (Index k = 0; k < q.size(); ++k) {
        const double middle = v[k] + 0.5 * jump[k];
        total += jump[k] * middle;
        kinetic += middle * middle;
        strain += stiffness[k] * q[k] * q[k];
        v[k] = middle + 0.5 * jump[k];
    }
    state.work[rigid.size()] += total;
    state.energy[KINETIC] = 0.5 * kinetic, state.energy[STRAIN] = 0.5 * strain;
    keep_balance(state);
}

/* Set kinetic and strain energy [J] without contact, and update the largest error of the energy balance [J]. */
inline void flight_energies(const Constants& constants, const State& state) noexcept {
    const Vec energy = state.energy, extreme = state.extreme;
    const CVec q = state.q, v = state.v, stiffness = constants.stiffness;
    double kinetic = 0.0, strain = 0.0;
    SIMD_SUM(kinetic, strain)
    for (Index k = 0; k < q.size(); ++k) kinetic += v[k] * v[k], strain += stiffness[k] * q[k] * q[k];
    energy[KINETIC] = 0.5 * kinetic, energy[STRAIN] = 0.5 * strain;
    const double total = energy[KINETIC] + energy[STRAIN] + energy[DISSIPATED];
    extreme[ENERGY_ERROR] = larger(extreme[ENERGY_ERROR], std::abs(total - extreme[START_ENERGY]));
}

/* Set the resultant of each contact [N], and add it to the mean of its sample. */
inline void resultants(const Constants& constants, const State& state, Mat forces, double stride) noexcept {
    const ImpactLog& log = state.log;
    for (Index i = 0; i < state.multipliers.size(); ++i) {
        if (state.multipliers[i] == 0.0) continue;
        const Index k = constants.contact[i];
        for (Index axis = 0; axis < 3; ++axis) log.force(k, axis) += state.multipliers[i] * constants.normals(i, axis);
        if (state.multipliers[i] > state.multipliers[log.steps(k, ROW)]) log.steps(k, ROW) = i;
    }
    for (Index k = 0; k < log.force.size(); ++k)
        for (Index axis = 0; axis < 3; ++axis) forces(k, axis) += log.force(k, axis) / stride;
}

/* Tell the log which contacts touch and which part, by gaps without the force of the step [m] at a time [s]. */
inline void note_changes(const Constants& constants, const State& state, CVec gap, double time) noexcept {
    for (Index k = 0; k < state.log.force.size(); ++k) {
        const bool acts = pressed(state.log, k);
        if (!changes(state.log, k, acts)) continue;
        const Index i = state.log.steps(k, ROW);
        note_change(state.log, k, acts, time, gap[i], along(constants, i, state.v));
    }
}

/* Keep what is recorded at the end of a sample, half a step before the next impulse, where the state is.
 *
 * done: Number of samples to its end. */
inline void keep_ends(const Constants& constants, const State& state, const Samples& out, Index sample,
                      Index done) noexcept {
    const CVec q = state.q, v = state.v;
    const CVec qq = constants.half[0], qv = constants.half[1], vq = constants.half[2], vv = constants.half[3];
    const Vec place = state.ends[0], rate = state.ends[1];
    for (Index k = 0; k < q.size(); ++k) {
        place[k] = vv[k] * q[k] - qv[k] * v[k];
        rate[k] = qq[k] * v[k] - vq[k] * q[k];
    }
    keep_paths(out.paths, sample, place, state.multipliers);
    keep_peaks(out.peaks, out.forces[sample], done, place, rate, state.multipliers, state.multipliers.slice(0, 0));
}

/* Advance as many samples as `out` has of `stride` steps each; false where the contact rows are linearly dependent.
 *
 * first: Number of the first impulse since the start of the run.  out: forces, peaks, and energies but for the work are
 * filled, those of a sample's last impulse. */
inline bool march(const Constants& constants, const State& state, Index first, Index stride,
                  const Samples& out) noexcept {
    const double dt = constants.dt;
    const Vec gap = state.free;
    Index number = first, clear = 0;
    for (Index sample = 0; sample < out.forces.size(); ++sample) {
        fill(out.forces[sample], 0.0);
        for (Index step = 0; step < stride; ++step) {
            double lowest = std::numeric_limits<double>::infinity();
            if (--clear < 0) {
                free_gaps(constants, state.q, gap);
                lowest = least(gap);
            }
            if (lowest < 0.0) {
                if (!constants.coupled) {
                    springs(constants, state, gap);
                } else if (!coupled_forces(constants, state, gap, -GAP_TOLERANCE * lowest)) {
                    state.counts[SINGULAR_AT] = number;
                    return false;
                }
                resultants(constants, state, out.forces[sample], double(stride));
                note_changes(constants, state, gap, (double(number) + 0.5) * dt);
                push(constants, state);
                log_step(state.log, number);
            } else {
                if (clear < 0) {
                    fill(state.multipliers, 0.0);
                    state.counts[ACTIVE] = 0;
                    state.active.size[0] = state.active.size[1] = 0;
                    state.energy[CONTACT] = 0.0;
                    clear = clear_steps(constants, state, lowest);
                }
                if (state.log.counts[GOING] > 0) {
                    note_changes(constants, state, gap, (double(number) + 0.5) * dt);
                    log_step(state.log, number);
                }
            }
            if (step == stride - 1) {
                if (state.counts[ACTIVE] == 0) flight_energies(constants, state);
                copy(state.energy, out.energies[sample].slice(0, 4));
            }
            fly(constants.flight, state.q, state.v);
            number += 1;
        }
        keep_ends(constants, state, out, sample, number / stride);
    }
    return true;
}

}  // namespace gudgeon::explicitly
