/* One implicit step: collocation at the points of Lobatto with the joints held at each stage.
 *
 * Each stage obeys the equations of motion and the rates of the joints' rows (index 2), so that multipliers are
 * unknowns beside the state. Places drift by the error of the step alone and are projected at its end, as of explicit
 * steps; the projection takes stiff modes as they resist over the step, so that it does not let them vibrate.
 */
#pragma once
#include "collocation.hpp"
#include "stage_equations.hpp"

namespace gudgeon::turning {

/* Iterations of Newton's method at most. */
constexpr Index ITERATIONS = 10;

/* Of a step: estimated error, last motion of Newton's method at the projection, whether the stages converged. */
struct ImplicitResult {
    double error, left;
    bool converged;
};

/* Set rates of all stages and lacks of their rows. */
inline void set_stages(const Model& model, const Work& work, const Newton& newton, const ImplicitCourse& course,
                       CVec y) noexcept {
    const Vec state = newton.state;
    for (Index i = 0; i < newton.stages.size(); ++i) {
        const Vec increment = newton.stages[i];
        for (Index j = 0; j < y.size(); ++j) state[j] = y[j] + increment[j];
        copy(newton.multipliers[i], work.multiplier);
        set_stage(model, work, state, course.given[1 + i], course.amounts[1 + i], newton.slopes[i]);
        copy(work.right, newton.lacks[i]);
    }
}

/* The larger part of a complex number. */
inline double larger_part(Complex z) noexcept {
    const double real = std::abs(z.real()), imaginary = std::abs(z.imag());
    return larger_or_nan(real, imaginary);
}

/* The largest weighted change in an eigenvector; of momenta as that of velocities. */
inline double weighted_change(const Model& model, const Newton& newton, CVec weight) noexcept {
    double worst = 0.0;
    const auto note = [&](Complex z, Index place) { worst = larger_or_nan(worst, larger_part(z) * weight[place]); };
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Index s = WIDTH * b, q = model.elastic(b, 1), momentum = model.elastic(b, 2);
        for (Index i = 0; i < 3; ++i) {
            note(newton.change[s + PLACE + i], s + PLACE + i);
            note(newton.moved(b, i), s + SPEED + i);
            note(newton.moved(b, 3 + i), s + SPIN + i);
        }
        for (Index i = 0; i < 4; ++i) note(newton.change[s + TURN + i], s + TURN + i);
        for (Index k = 0; k < model.elastic(b, 0); ++k) {
            note(newton.change[q + k], q + k);
            note(newton.moved(b, 6 + k), momentum + k);
        }
    }
    return worst;
}

/* Set the residuals of the stages in eigenvector k, `right` and `lack`. */
inline void set_residual(const Newton& newton, const ImplicitCourse& course, Index k) noexcept {
    const Complexes<1> right = newton.right, lack = newton.lack;
    fill(right, 0.0);
    fill(lack, 0.0);
    for (Index i = 0; i < newton.stages.size(); ++i) {
        const Complex share = course.there(k, i), inverse = course.times[k] * share;
        const double start = course.start[i];
        const Vec slope = newton.slopes[i], stage = newton.stages[i], rows = newton.lacks[i];
        for (Index j = 0; j < right.size(); ++j)
            right[j] += share * (slope[j] + start * newton.begin[j]) - inverse * stage[j];
        for (Index j = 0; j < lack.size(); ++j) lack[j] += share * rows[j];
    }
}

/* Change stages and multipliers by a step of Newton's method; return its size. */
inline double change_stages(const Model& model, const Newton& newton, const ImplicitCourse& course, CVec y) noexcept {
    double worst = 0.0;
    fill(newton.step, 0.0);
    fill(newton.multiplier_step, 0.0);
    const auto take = [](Complex share, Complexes<1> change, Vec into) {
        for (Index j = 0; j < into.size(); ++j)
            into[j] += share.real() * change[j].real() - share.imag() * change[j].imag();
    };
    for (Index k = 0; k < course.times.size(); ++k) {
        set_residual(newton, course, k);
        solve_system(model, newton, y, k, course.times[k]);
        const double size = weighted_change(model, newton, course.weight);
        for (Index i = 0; i < newton.stages.size(); ++i) {
            const Complex share = course.back(i, k);
            worst = larger_or_nan(worst, length_of(share.real(), share.imag()) * size);
            take(share, newton.change, newton.step[i]);
            take(share, newton.multiplier, newton.multiplier_step[i]);
        }
    }
    for (Index i = 0; i < newton.stages.size(); ++i) {
        add(1.0, newton.step[i], newton.stages[i]);
        add(1.0, newton.multiplier_step[i], newton.multipliers[i]);
    }
    return worst;
}

/* Solve the equations of the stages by Newton's method with the matrix of the start; false where it fails. */
inline bool solve_stages(const Model& model, const Work& work, const Newton& newton, const ImplicitCourse& course,
                         CVec y) noexcept {
    double before = std::numeric_limits<double>::infinity();
    for (Index iteration = 0; iteration < ITERATIONS; ++iteration) {
        set_stages(model, work, newton, course, y);
        const double change = change_stages(model, newton, course, y);
        const Verdict found = verdict(newton.rate, change, before, course.limits, course.tolerance);
        if (found != Verdict::open) return found == Verdict::found;
        before = change;
    }
    return false;
}

/* The largest weighted difference to the embedded method, which is left in `change`. */
inline double estimate(const Model& model, const Newton& newton, const ImplicitCourse& course, CVec y,
                       CVec slope) noexcept {
    for (Index j = 0; j < y.size(); ++j) {
        double total = course.error_start * slope[j];
        for (Index i = 0; i < newton.stages.size(); ++i) total += course.error[i] * newton.stages(i, j);
        newton.right[j] = total;
    }
    fill(newton.lack, 0.0);
    solve_system(model, newton, y, 0, course.times[0]);
    return weighted_change(model, newton, course.weight);
}

/* The estimated error of a step. One above what is asked for is estimated again with the slope beside the start, in
 * which stiff modes have lost their own part (Hairer, Wanner, Solving ODE II, IV.8). */
inline double error_of(const Model& model, const Work& work, const Newton& newton, const ImplicitCourse& course,
                       CVec y) noexcept {
    const double error = estimate(model, newton, course, y, newton.begin);
    if (!(error > course.asked)) return error;
    for (Index j = 0; j < y.size(); ++j) newton.state[j] = y[j] + newton.change[j].real();
    copy(newton.held, work.multiplier);
    set_stage(model, work, newton.state, course.given[0], course.amounts[0], newton.slopes[0]);
    return estimate(model, newton, course, y, newton.slopes[0]);
}

/* Set a modal inertia `root` that is the diagonal of M + g D + g^2 K, in which stiff modes hardly move. */
inline void stiffen(const Model& model, Cube root, double g) noexcept {
    for (Index b = 0; b < model.mass.size(); ++b)
        for (Index k = 0; k < model.elastic(b, 0); ++k) {
            const double free = model.modal_root(b, k, k);
            const double added = g * (model.modal_damping(b, k) + g * model.modal_stiffness(b, k));
            root(b, k, k) = std::sqrt(free * free + added);
        }
}

/* Guess the stages and multipliers of a step by the slope at its start. */
inline void begin_stages(const Newton& newton, CVec first) noexcept {
    for (Index i = 0; i < newton.stages.size(); ++i) {
        copy(newton.held, newton.multipliers[i]);
        for (Index j = 0; j < newton.begin.size(); ++j) newton.stages(i, j) = first[i] * newton.begin[j];
    }
}

/* Set the state `out` after a step from y; `stages` and `multipliers` have what is guessed of them.
 *
 * stiff: the model with the modal inertia `root`, for projections of places. */
inline ImplicitResult implicit_step(const Model& model, const Model& stiff, Cube root, const Work& work, const Newton& newton,
                             const ImplicitCourse& course, CVec y, Vec out) noexcept {
    rates(model, work, y, course.given[0], course.amounts[0], newton.begin);
    copy(work.multiplier, newton.held);
    const EnergyBalance before = balance(model, work, y);
    newton.energy[0] = before.kinetic;
    keep_start(model, work, newton);
    if (course.fresh) begin_stages(newton, course.first);
    set_systems(model, newton, course.times);
    if (!solve_stages(model, work, newton, course, y)) return {std::numeric_limits<double>::infinity(), 0.0, false};
    const Index last = newton.stages.size() - 1;
    for (Index j = 0; j < y.size(); ++j) out[j] = y[j] + newton.stages(last, j);
    const double error = error_of(model, work, newton, course, y);
    for (Index b = 0; b < model.mass.size(); ++b) normalise(out.slice(WIDTH * b + TURN, WIDTH * b + TURN + 4));
    double left = 0.0;
    if (model.row_terms.size()) {
        stiffen(model, root, 1.0 / course.times[0].real());
        left = project_places(stiff, work, out, course.given[last + 1]);
        project_speeds(model, work, out, course.given[last + 1]);
    }
    set_poses(model, work, out);
    set_bushings(model, work);
    const EnergyBalance after = balance(model, work, out);
    return {larger_or_nan(error, imbalance(before.total, after.total, after.size) * course.energy), left, true};
}

}  // namespace gudgeon::turning
