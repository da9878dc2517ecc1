/* One step of Dormand and Prince's method of order 8 with projection, its estimated error, and its interpolation;
 * starts and readings of a state.
 *
 * Coefficients are those of DOP853 (Hairer, Norsett, Wanner, Solving ODE I, II.5 and II.10), which come as a `Tableau`.
 */
#pragma once
#include "accelerations.hpp"
#include "step_arrays.hpp"

namespace gudgeon::turning {

/* Stages of a step; the next one is the first of the step that follows. */
inline constexpr Index MAIN = 12;

/* Set the slope of a stage. Where stages are projected, rates are those of the nearest state that obeys the joints: a
 * smooth function of the state, with the same values on the constraints, so that the order stays. */
inline void set_slope(const Model& model, const Work& work, const ExplicitCourse& course, CVec y, double h,
                      Index s) noexcept {
    const Mat K = work.slopes;
    const Vec stage = work.stage;
    copy(y, stage);
    for (Index k = 0; k < s; ++k) {
        const double weight = h * course.table.inner(s, k);
        if (weight != 0.0) add(weight, K[k], stage);
    }
    const bool projected = course.project && model.row_terms.size();
    if (projected) {
        project_places(model, work, stage, course.given[s]);
        project_speeds(model, work, stage, course.given[s]);
    }
    rates(model, work, stage, course.given[s], course.amounts[s], K[s], projected);
}

/* Turn differences of spins into those of angular velocity, and of modal momenta into modal rates; poses are set. */
inline void as_velocities(const Model& model, const Work& work, Vec apart) noexcept {
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Index s = WIDTH * b + SPIN, m = model.elastic(b, 0), momentum = model.elastic(b, 2);
        if (!m) {
            put(apart, rotated(work.back[b], three(apart, s)), s);
            continue;
        }
        const Vec values = work.light_error.slice(0, 3 + m);
        put(values, three(apart, s));
        for (Index k = 0; k < m; ++k) values[3 + k] = apart[momentum + k];
        solve_inertia(model, work, b, values);
        put(apart, three(values), s);
        for (Index k = 0; k < m; ++k) apart[momentum + k] = values[3 + k];
    }
}

/* The largest weighted number, NaN where there is one. */
inline double largest_weighted(CVec apart, CVec weight) noexcept {
    double worst = 0.0;
    for (Index i = 0; i < apart.size(); ++i) worst = larger_or_nan(worst, std::abs(apart[i] * weight[i]));
    return worst;
}

/* The largest weighted difference of a state, of spins as angular velocity and of modal momenta as rates, in which it
 * leaves them; poses are set. */
inline double largest(const Model& model, const Work& work, Vec apart, CVec weight) noexcept {
    as_velocities(model, work, apart);
    return largest_weighted(apart, weight);
}

/* The largest weighted difference to an embedded method at the end of a step, where S is factored.
 *
 * Rates across the constraints do not count, which the projection at the end takes: those of a light body that holds a
 * heavy one have the round-off of its reactions, in proportion to the step, so that no step were short enough. */
inline double embedded_error(const Model& model, const Work& work, const ExplicitCourse& course, CVec coefficients,
                             double h) noexcept {
    const Mat K = work.slopes;
    const Vec apart = work.stage;
    fill(apart, 0.0);
    for (Index k = 0; k <= MAIN; ++k) add(coefficients[k], K[k], apart);
    for (Index i = 0; i < apart.size(); ++i) apart[i] *= h;
    as_velocities(model, work, apart);
    if (model.row_terms.size()) remove_speed_lacks(model, work, apart);
    return largest_weighted(apart, course.weight);
}

/* The estimated error of a step, the last motion of Newton's method, and whether the error and the state are finite. */
struct StepResult {
    double error, residual;
    bool finite;
};

/* Set the state after a step h [s] from y, whose slope is the first of `slopes`. */
inline StepResult step(const Model& model, const Work& work, const ExplicitCourse& course, CVec y, double h,
                       Vec out) noexcept {
    const Mat K = work.slopes;
    const Tableau& table = course.table;
    for (Index s = 1; s < MAIN; ++s) set_slope(model, work, course, y, h, s);
    fill(out, 0.0);
    for (Index k = 0; k < MAIN; ++k) add(table.end[k], K[k], out);
    for (Index i = 0; i < out.size(); ++i) out[i] = y[i] + h * out[i];
    for (Index b = 0; b < model.mass.size(); ++b) normalise(out.slice(WIDTH * b + TURN, WIDTH * b + TURN + 4));
    double residual = 0.0;
    if (model.row_terms.size()) {
        residual = project_places(model, work, out, course.given[MAIN]);
        project_speeds(model, work, out, course.given[MAIN]);
    }
    rates(model, work, out, course.given[MAIN], course.amounts[MAIN], K[MAIN], model.row_terms.size() > 0);
    const double fifth = embedded_error(model, work, course, table.fifth, h);
    const double third = embedded_error(model, work, course, table.third, h);
    double error = 0.0;
    if (fifth != 0.0) {
        const double share = third / fifth; /* Squares of either may underflow. */
        error = fifth / std::sqrt(1.0 + 0.01 * share * share);
    }
    bool finite = std::isfinite(error);
    for (Index i = 0; i < out.size(); ++i) finite = finite && std::isfinite(out[i]);
    return {error, residual, finite};
}

/* Set the slopes of the three further stages of an accepted step from y. */
inline void interpolation(const Model& model, const Work& work, const ExplicitCourse& course, CVec y,
                          double h) noexcept {
    for (Index s = MAIN + 1; s < work.slopes.size(); ++s) set_slope(model, work, course, y, h, s);
}

/* Set the first slope of a step, at a state y. */
inline void begin(const Model& model, const Work& work, CVec y, CMat given, CVec amounts) noexcept {
    rates(model, work, y, given, amounts, work.slopes[0]);
}

/* Squares of the largest velocity and angular velocity of a body. */
struct Fastest {
    double speed, turning;
};

/* Take the angles of an accepted state, from which later ones are continued. */
inline Fastest keep_angles(const Model& model, const Work& work, CVec y) noexcept {
    set_poses(model, work, y);
    set_rows(model, work);
    for (Index t = 0; t < model.terms.size(); ++t)
        if (model.terms(t, 0) == ANGLE) work.turned[t] = work.value[t];
    Fastest fastest{0.0, 0.0};
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Vec3 v = three(y, WIDTH * b + SPEED), w = three(work.omega[b]);
        fastest = {larger_or_nan(fastest.speed, dot(v, v)), larger_or_nan(fastest.turning, dot(w, w))};
    }
    return fastest;
}

/* Move bodies onto their constraints; returns the violation left over its reach. */
inline double close(const Model& model, const Work& work, Vec y, CMat given) noexcept {
    project_places(model, work, y, given);
    set_poses_at(model, work, y, given);
    set_rows(model, work);
    return worst_violation(model, work, given);
}

/* Change velocities so that they obey the constraints. */
inline void match(const Model& model, const Work& work, Vec y, CMat given) noexcept {
    project_speeds(model, work, y, given);
}

/* Set angular velocities and modal rates of a state, in `omega` and `modal`, all points, bushings and sections. */
inline void observe(const Model& model, const Work& work, CVec y) noexcept {
    set_poses(model, work, y);
    set_bushings(model, work);
    set_deflections(work, y);
    set_touches(model, work);
    set_pressing(model, work, y);
}

}  // namespace gudgeon::turning
