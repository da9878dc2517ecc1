/* Energies and work of the implicit loop at every step. */
#pragma once
#include "../log/extremes.hpp"
#include "sliding.hpp"

namespace gudgeon::implicit {

/* Relax the rows of one contact; returns the energy that their damping took [J]. */
inline double relax_rows(const Points& points, const Loads& loads, Index first, Index last) noexcept {
    const auto rows_of = [&](auto view) { return view.slice(first, last); };
    const CVec now = rows_of(points.multipliers), then = rows_of(points.last);
    const CVec decay = rows_of(points.memory[0]), start = rows_of(points.memory[1]), end = rows_of(points.memory[2]);
    const Vec by_contact = rows_of(points.residual_displacement), response = rows_of(points.response);
    const Vec force = rows_of(points.residual_force), before = rows_of(points.total_displacement);
    const Vec total = rows_of(points.end_total_displacement);
    fill(response, 0.0);
    combine(points.residual, listed(points, 1), 1.0, first, last, points.response);
    for (Index i = 0; i < by_contact.size(); ++i) {
        by_contact[i] += end[i] * response[i];
        total[i] = by_contact[i];
    }
    combine(loads.to_gap, listed(loads, loads.residual_force), 1.0, first, last, points.end_total_displacement);
    double lost = 0.0;
    SIMD_SUM(lost)
    for (Index i = 0; i < force.size(); ++i) {
        const double end_force = decay[i] * force[i] + start[i] * then[i] + end[i] * now[i];
        lost += 0.5 * (then[i] + now[i] - force[i] - end_force) * (total[i] - before[i]);
        force[i] = end_force;
        before[i] = total[i];
    }
    return lost;
}

/* Bring residual forces [N] and displacements [m] of the points to the end of the step.
 *
 * The energy that their damping took [J] and the impulses of the rows [N s] grow by the step's. Displacements of a
 * contact that is no candidate and without residual forces are followed no longer. */
inline void relax(const Arrays& arrays) noexcept {
    const auto& [dt, modes, points, masters, matrix, loads, bounds, energy, log] = arrays;
    double lost = 0.0;
    for (Index k = 0; k < matrix.block.size(); ++k)
        if (matrix.candidate[k] || bounds.held(0, k) > 0.0)
            lost += relax_rows(points, loads, matrix.block(k, 0), matrix.block(k, 1));
        else
            points.followed[k] = false;
    for (Index moment = 0; moment < 2; ++moment) {
        const auto [numbers, amounts, count] = listed(points, moment);
        for (Index n = 0; n < count; ++n) points.impulses[numbers[n]] += 0.5 * dt * amounts[n];
    }
    energy.parts[DISSIPATED] += lost;
}

/* Set the residual displacements [m] of rows at the start of the step, and without the forces of its end. */
inline void follow_residual(const Points& points, const Loads& loads, Index first, Index last) noexcept {
    const Vec free = points.residual_displacement.slice(first, last);
    const Vec before = points.total_displacement.slice(first, last), response = points.response.slice(first, last);
    fill(free, 0.0);
    fill(before, 0.0);
    fill(response, 0.0);
    for (Index j = 0; j < points.residual_force.size(); ++j) {
        const double force = points.residual_force[j], now = points.last[j];
        if (force == 0.0 && now == 0.0) continue;
        const CVec row = points.residual[j].slice(first, last);
        const double flown = points.memory(0, j) * force + points.memory(1, j) * now;
        for (Index i = 0; i < row.size(); ++i) {
            before[i] += row[i] * force;
            free[i] += row[i] * flown;
            response[i] += row[i] * now;
        }
    }
    combine(loads.to_gap, listed(loads, loads.last_residual_force), 1.0, first, last, points.total_displacement);
}

/* Do as `relax` does for the functions of the traction spaces. */
inline void relax_masters(const Masters& masters, const Energy& energy, double dt) noexcept {
    const CVec first = masters.function_forces[0], second = masters.function_forces[1];
    const CVec now = masters.residual_displacement;
    const CVec decay = masters.memory[0], start = masters.memory[1], end = masters.memory[2];
    const Vec force = masters.residual_force, before = masters.last_displacement;
    double lost = 0.0;
    SIMD_SUM(lost)
    for (Index f = 0; f < force.size(); ++f) {
        const double end_force = decay[f] * force[f] + 2 * (start[f] * first[f] + end[f] * second[f]);
        lost += (first[f] + second[f] - 0.5 * (force[f] + end_force)) * (now[f] - before[f]);
        masters.impulses[f] += dt * (first[f] + second[f]);
        force[f] = end_force;
        before[f] = now[f];
    }
    energy.parts[DISSIPATED] += lost;
}

/* Add the work of loads and joints in the step [J]; returns twice the energy of their residual displacement [J]. */
inline double load_work(const Modes& modes, const Points& points, const Loads& loads, const Energy& energy) noexcept {
    double held = 0.0;
    for (Index i = 0; i < loads.amount.size(); ++i) {
        const double moved = dot(loads.rows[i], modes.q);
        const double residual =
            dot(loads.residual[i], loads.residual_force) + dot(loads.to_gap[i], points.residual_force);
        held += loads.residual_force[i] * residual;
        energy.parts[WORK] += loads.amount[i] * (moved + residual - loads.displacement[i]);
        const double middle = 0.5 * (loads.residual_force[i] + loads.last_residual_force[i]);
        energy.parts[DISSIPATED] += (loads.amount[i] - middle) * (residual - loads.residual_displacement[i]);
        loads.displacement[i] = moved + residual;
        loads.residual_displacement[i] = residual;
        loads.last_residual_force[i] = loads.residual_force[i];
    }
    return held;
}

/* Set the energies [J] at the end of the step, and update the largest error of their balance.
 *
 * held: Twice the energy of the loads' residual displacement [J]. */
inline void balance(const Arrays& arrays, double held) noexcept {
    const auto& [dt, modes, points, masters, matrix, loads, bounds, energy, log] = arrays;
    const CVec q = modes.q, v = modes.v, q0 = modes.before[0], v0 = modes.before[1], force = modes.force;
    const CVec stiffness = modes.stiffness, gravity = modes.gravity;
    const CVec a = modes.loss[0], b = modes.loss[1], c = modes.loss[2];
    const CVec d = modes.loss[3], e = modes.loss[4], f = modes.loss[5];
    const Vec moved = modes.moved, parts = energy.parts, extreme = energy.extreme;
    double kinetic = 0.0, strain = 0.0, work = 0.0, lost = 0.0, layer = 0.0;
    SIMD_SUM(kinetic, strain, work, lost)
    for (Index k = 0; k < q.size(); ++k) {
        moved[k] = q[k] - q0[k];
        kinetic += v[k] * v[k];
        strain += stiffness[k] * q[k] * q[k];
        work += gravity[k] * moved[k];
        lost += a[k] * q0[k] * q0[k] + b[k] * q0[k] * v0[k] + c[k] * v0[k] * v0[k] +
                (d[k] * q0[k] + e[k] * v0[k] + f[k] * force[k]) * force[k];
    }
    held += dot(points.residual_force, points.total_displacement);
    held += dot(masters.residual_force, masters.residual_displacement);
    const auto [numbers, amounts, count] = listed(points, 1);
    for (Index n = 0; n < count; ++n) layer += points.layer[numbers[n]] * amounts[n] * amounts[n];
    for (Index k = 0; k < matrix.block.size(); ++k)
        if (matrix.candidate[k])
            extreme[DEEPEST] =
                larger(extreme[DEEPEST], -least(points.gaps.slice(matrix.block(k, 0), matrix.block(k, 1))));
    parts[KINETIC] = 0.5 * kinetic, parts[STRAIN] = 0.5 * (strain + held), parts[CONTACT] = 0.5 * layer;
    parts[DISSIPATED] += lost;
    parts[WORK] += work;
    note_energies(parts, extreme);
}

/* Add the contacts' work [J] in the step on each rigid coordinate and on all, and update the largest exchange. */
inline void exchange(const Modes& modes, const Points& points, const Energy& energy) noexcept {
    const Index first = points.span[0], last = points.span[1], count = energy.rigid.size();
    const CVec moved = modes.moved, distance = modes.moved.slice(first, last);
    for (Index moment = 0; moment < 2; ++moment) {
        const auto [numbers, amounts, size] = listed(points, moment);
        for (Index n = 0; n < size; ++n) {
            const CVec row = points.rows[numbers[n]];
            const double amount = 0.5 * amounts[n];
            for (Index r = 0; r < count; ++r) energy.work[r] += amount * row[energy.rigid[r]] * moved[energy.rigid[r]];
            energy.work[count] += amount * dot(row.slice(first, last), distance);
        }
    }
    note_exchange(energy.work, energy.parts[CONTACT], energy.extreme);
}

}  // namespace gudgeon::implicit
