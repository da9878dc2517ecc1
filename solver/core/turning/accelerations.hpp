/* Accelerations of bodies on joints, and projections on their constraints. */
#pragma once
#include "../ports/pressing.hpp"
#include "../ports/sections.hpp"
#include "bushings.hpp"
#include "joint_rows.hpp"
#include "multipliers.hpp"

namespace gudgeon::turning {

/* Motion of a step of Newton's method over the size of the scene, or rotation [rad], after which it ends: it converges
 * with the square; the same beyond which it ends, too, as it diverges; and its steps at most. */
inline constexpr double CLOSED = 1e-9, FARTHEST = 1.0;
inline constexpr Index NEWTON_STEPS = 12;

/* Add the forces of springs and dashpots between points. */
inline void press_springs(const Model& model, const Work& work, Vec sums) noexcept {
    for (Index k = 0; k < model.spring.size(); ++k) {
        const Index a = 2 * model.owner.size() + 2 * k, b = a + 1;
        const CVec law = model.spring[k];
        const Vec3 d = three(work.place[b]) - three(work.place[a]);
        const double size = length(d);
        if (size == 0.0) continue;
        const Vec3 n{d.x / size, d.y / size, d.z / size};
        const double rate = dot(n, three(work.speed[b]) - three(work.speed[a]));
        const double pull = law[0] * (size - law[2]) + law[1] * rate;
        sums[LOST] += law[1] * rate * rate;
        press(model, work, a, {n, {}}, pull);
        press(model, work, b, {n, {}}, -pull);
    }
}

/* Set what acts on each body but by joints, and rates of work and loss. amounts: of loads, (l,). */
inline void set_pushes(const Model& model, const Work& work, CVec amounts, Vec sums) noexcept {
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Vec push = work.push[b], inner = work.inner_force[b], modal = work.modal[b];
        for (Index i = 0; i < 3; ++i) {
            push[i] = model.mass[b] * model.gravity[i];
            push[3 + i] = 0.0;
        }
        const CVec damping = model.modal_damping[b];
        for (Index k = 0; k < model.elastic(b, 0); ++k) {
            push[6 + k] = inner[k];
            sums[LOST] += damping[k] * modal[3 + k] * modal[3 + k];
        }
    }
    press_springs(model, work, sums);
    const Index first = 2 * model.owner.size() + 2 * model.spring.size();
    for (Index k = 0; k < model.load.size(); ++k) {
        const CVec unit = model.load[k];
        press(model, work, first + k, wrench_of(unit), amounts[k]);
        const Vec v = work.speed[first + k], w = work.spin[first + k];
        for (Index i = 0; i < 3; ++i) sums[WORK] += amounts[k] * (unit[i] * v[i] + unit[3 + i] * w[i]);
    }
    press_bushings(model, work, sums);
    press_touches(model, work, sums);
    press_surfaces(model, work, sums);
}

/* What a row makes of the rates of the bodies, in `rate`. */
inline double row_rate(const Model& model, const Work& work, Index i) noexcept {
    double total = 0.0;
    for (Index p = 0; p < 4; ++p) {
        const Index b = work.block_owner(i, p);
        if (b == NONE) continue;
        const Index width = 6 + model.elastic(b, 0);
        total += row_product(work.block[i][p], work.rate[b], width);
    }
    return total;
}

/* Set the right side of S lambda: what the rows' second rates lack without multipliers. */
inline void set_right(const Model& model, const Work& work, CMat given) noexcept {
    for (Index i = 0; i < model.row_terms.size(); ++i) {
        double total = model.drive_of[i] != NONE ? given(model.drive_of[i], 2) : 0.0;
        for (Index part = 0; part < 2; ++part)
            if (model.row_terms(i, part) != NONE) total -= model.factors(i, part) * work.bend[model.row_terms(i, part)];
        work.right[i] = total - row_rate(model, work, i);
    }
}

/* Set the accelerations of unconstrained bodies, w' = I^-1 (moment - w x l). */
inline void set_free_rates(const Model& model, const Work& work, CVec y) noexcept {
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Vec rate = work.rate[b], push = work.push[b];
        for (Index i = 0; i < 3; ++i) rate[i] = push[i] / model.mass[b];
        if (model.elastic(b, 0)) {
            set_flexible_rates(model, work, y, b);
            continue;
        }
        const Vec3 lag = cross(three(work.omega[b]), three(y, WIDTH * b + SPIN));
        put(rate, rotated(work.back[b], three(push, 3) - lag), 3);
    }
}

/* Set all that the multipliers at a state follow from, and factor S. given: drives (d, 3), amounts: loads (l,).
 * factored: whether S is that of these places as it is. */
inline void prepare(const Model& model, const Work& work, CVec y, CMat given, CVec amounts, Vec sums,
                    bool factored = false) noexcept {
    set_poses_at(model, work, y, given);
    set_deflections(work, y);
    set_pressing(model, work, y);
    set_pushes(model, work, amounts, sums);
    set_free_rates(model, work, y);
    if (!model.row_terms.size()) return;
    if (factored) {
        set_blocks(model, work);
    } else {
        set_rows(model, work);
        set_matrix(model, work);
        factor(model, work);
    }
    set_right(model, work, given);
}

/* Add G^T lambda to what acts on the bodies. */
inline void add_multipliers(const Model& model, const Work& work) noexcept {
    for (Index i = 0; i < work.multiplier.size(); ++i) {
        const double amount = work.multiplier[i];
        if (amount == 0.0) continue;
        for (Index p = 0; p < 4; ++p) {
            const Index b = work.block_owner(i, p);
            if (b == NONE) continue;
            const Index width = 6 + model.elastic(b, 0);
            add_row(amount, work.block[i][p], work.push[b], width);
        }
    }
}

/* Set the rates of a state whose pushes and multipliers are set, and add to those of the sums. */
inline void set_rates(const Model& model, const Work& work, CVec y, CMat given, Vec out) noexcept {
    const Vec sums = out.slice(out.size() - SUMS, out.size());
    if (model.row_terms.size()) {
        add_multipliers(model, work);
        for (Index i = 0; i < model.row_terms.size(); ++i)
            sums[WORK] += work.multiplier[i] * rate_asked(model, work, given, i);
    }
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Index s = WIDTH * b, q = model.elastic(b, 1), momentum = model.elastic(b, 2);
        const Vec push = work.push[b], modal = work.modal[b];
        for (Index i = 0; i < 3; ++i) {
            out[s + PLACE + i] = y[s + SPEED + i];
            out[s + SPEED + i] = push[i] / model.mass[b];
            out[s + SPIN + i] = push[3 + i];
            sums[IMPULSE + i] += push[i];
        }
        const Vec3 about = cross(three(y, s + PLACE), three(push));
        for (Index i = 0; i < 3; ++i) sums[MOMENT + i] += about[i] + push[3 + i];
        for (Index k = 0; k < model.elastic(b, 0); ++k) {
            out[q + k] = modal[3 + k];
            out[momentum + k] = push[6 + k];
        }
        rate_of(y.slice(s + TURN, s + TURN + 4), work.omega[b], out.slice(s + TURN, s + TURN + 4));
    }
}

/* Set the rates of a state at a time with drives (d, 3) and loads (l,) of that time; factored as of `prepare`. */
inline void rates(const Model& model, const Work& work, CVec y, CMat given, CVec amounts, Vec out,
                  bool factored = false) noexcept {
    const Vec sums = out.slice(out.size() - SUMS, out.size());
    fill(sums, 0.0);
    prepare(model, work, y, given, amounts, sums, factored);
    set_touch_sums(model, work, out);
    if (model.row_terms.size()) solve(work);
    set_rates(model, work, y, given, out);
}

/* The largest violation of a row over its reach; all are left in `right`, negative. */
inline double worst_violation(const Model& model, const Work& work, CMat given) noexcept {
    double worst = 0.0;
    for (Index i = 0; i < model.row_terms.size(); ++i) {
        const double lack = violation(model, work, given, i);
        work.right[i] = -lack;
        worst = larger_or_nan(worst, std::abs(lack) / model.reach[i]);
    }
    return worst;
}

/* Set `rate` to the sum of the rows of the bodies times their multipliers. */
inline void gather(const Model& model, const Work& work) noexcept {
    for (Index b = 0; b < model.mass.size(); ++b)
        for (Index k = 0; k < 6 + model.elastic(b, 0); ++k) work.rate(b, k) = 0.0;
    for (Index i = 0; i < model.row_terms.size(); ++i)
        for (Index p = 0; p < 4; ++p) {
            const Index b = work.block_owner(i, p);
            if (b == NONE) continue;
            const Index width = 6 + model.elastic(b, 0);
            add_row(work.multiplier[i], work.block[i][p], work.rate[b], width);
        }
}

/* Set `rate` to the inverse of the inertia times this sum. */
inline void gather_motions(const Model& model, const Work& work) noexcept {
    gather(model, work);
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Vec rate = work.rate[b];
        for (Index k = 0; k < 3; ++k) rate[k] /= model.mass[b];
        if (const Index m = model.elastic(b, 0))
            solve_inertia(model, work, b, rate.slice(3, 6 + m));
        else
            put(rate, rotated(work.back[b], three(rate, 3)), 3);
    }
}

/* Move the bodies by M^-1 G^T lambda; returns the largest motion over the size of the scene, or rotation [rad]. */
inline double move(const Model& model, const Work& work, Vec y) noexcept {
    gather_motions(model, work);
    double largest = 0.0;
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Index s = WIDTH * b, q = model.elastic(b, 1);
        const Vec motion = work.rate[b];
        for (Index k = 0; k < 3; ++k) {
            y[s + PLACE + k] += motion[k];
            largest = larger_or_nan(largest, std::abs(motion[k]) / model.size);
            largest = larger_or_nan(largest, std::abs(motion[3 + k]));
        }
        for (Index k = 0; k < model.elastic(b, 0); ++k) y[q + k] += motion[6 + k];
        turn_by(y.slice(s + TURN, s + TURN + 4), three(motion, 3));
    }
    return largest;
}

/* Move the bodies onto their constraints by Newton's method, by least kinetic energy.
 *
 * It ends with the first motion whose square is round-off; near positions in which rows depend on each other, what
 * remains of the violation says less than the motion. Returns this motion, over the size of the scene. */
inline double project_places(const Model& model, const Work& work, Vec y, CMat given) noexcept {
    double moved = std::numeric_limits<double>::infinity();
    for (Index step = 0; step < NEWTON_STEPS; ++step) {
        set_poses_at(model, work, y, given);
        set_rows(model, work);
        worst_violation(model, work, given);
        set_matrix(model, work);
        factor(model, work);
        solve(work);
        const double before = moved;
        moved = move(model, work, y);
        if (moved <= CLOSED || !(moved < FARTHEST) || (step > 3 && moved > 0.5 * before)) break;
    }
    return moved;
}

/* Set what the rate of each row lacks, in `right`; rows are set. */
inline void set_speed_lacks(const Model& model, const Work& work, CVec y, CMat given) noexcept {
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Vec rate = work.rate[b];
        put(rate, three(y, WIDTH * b + SPEED));
        put(rate, three(work.omega[b]), 3);
        for (Index k = 0; k < model.elastic(b, 0); ++k) rate[6 + k] = work.modal(b, 3 + k);
    }
    for (Index i = 0; i < model.row_terms.size(); ++i)
        work.right[i] = rate_asked(model, work, given, i) - row_rate(model, work, i);
}

/* Add `rate` to the velocities, spins and modal momenta of a state. */
inline void add_rates(const Model& model, const Work& work, Vec y) noexcept {
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Index s = WIDTH * b, momentum = model.elastic(b, 2);
        const Vec rate = work.rate[b];
        for (Index k = 0; k < 3; ++k) {
            y[s + SPEED + k] += rate[k];
            y[s + SPIN + k] += rate[3 + k];
        }
        for (Index k = 0; k < model.elastic(b, 0); ++k) y[momentum + k] += rate[6 + k];
    }
}

/* Change velocities so that no row's rate is violated, by least kinetic energy. */
inline void project_speeds(const Model& model, const Work& work, Vec y, CMat given) noexcept {
    set_poses_at(model, work, y, given);
    set_rows(model, work);
    set_matrix(model, work);
    factor(model, work);
    set_speed_lacks(model, work, y, given);
    solve(work);
    gather(model, work);
    for (Index b = 0; b < model.mass.size(); ++b)
        for (Index k = 0; k < 3; ++k) work.rate(b, k) /= model.mass[b];
    add_rates(model, work, y);
}

/* Take from a difference of velocities, angular velocities and modal rates what violates the rows' rates, by least
 * kinetic energy; S is factored. */
inline void remove_speed_lacks(const Model& model, const Work& work, Vec apart) noexcept {
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Index s = WIDTH * b, momentum = model.elastic(b, 2);
        const Vec rate = work.rate[b];
        put(rate, three(apart, s + SPEED));
        put(rate, three(apart, s + SPIN), 3);
        for (Index k = 0; k < model.elastic(b, 0); ++k) rate[6 + k] = apart[momentum + k];
    }
    for (Index i = 0; i < model.row_terms.size(); ++i) work.right[i] = -row_rate(model, work, i);
    solve(work);
    gather_motions(model, work);
    add_rates(model, work, apart);
}

}  // namespace gudgeon::turning
