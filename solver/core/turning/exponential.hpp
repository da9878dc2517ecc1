/* One exponential step: collocation in which vibrations of modes are exact.
 *
 * The slopes less what vibrates by itself, of modes z' = lambda z + n(t), are interpolated by polynomials at the points
 * of Lobatto, and the equations are integrated exactly with them (exponential methods of collocation; Hochbruck,
 * Ostermann, Exponential integrators, Acta Numerica 2010, 2.1). With phi_0 = exp and phi_k+1(z) = (phi_k(z) - 1/k!)/z
 *
 *   z(t) = exp(lambda t) z(0) + sum_k n_k k! t^(k+1) phi_k+1(lambda t),  n(t) = sum_k n_k t^k.
 *
 * What remains in n couples modes by rotation alone, so that stages are found by substitution.
 */
#pragma once
#include "collocation.hpp"
#include "explicit.hpp"

namespace gudgeon::turning {

/* Of the stages at most. */
inline constexpr Index SUBSTITUTIONS = 12;
/* |z| below which phi are summed as series; above, they follow from each other without loss of digits. */
inline constexpr double NEAR_ZERO = 4.0;
/* Of the series, with which the last one is round-off. */
inline constexpr Index SERIES_TERMS = 26;

/* Set phi_k(z) for k from 0 on. */
inline void set_series(Complex z, Complexes<1> out) noexcept {
    const Index last = out.size() - 1;
    double inverse = 1.0;
    if (std::norm(z) >= NEAR_ZERO * NEAR_ZERO) {
        const Complex over = 1.0 / z;
        out[0] = std::exp(z);
        for (Index k = 0; k < last; ++k) {
            out[k + 1] = (out[k] - inverse) * over;
            inverse *= 1.0 / double(k + 1);
        }
        return;
    }
    for (Index k = 0; k < last; ++k) inverse *= 1.0 / double(k + 1);
    Complex term = inverse + 0.0 * z;
    out[last] = term;
    for (Index n = 0; n < SERIES_TERMS; ++n) {
        term *= z * (1.0 / double(last + n + 1));
        out[last] += term;
    }
    for (Index k = last; k > 0; --k) {
        inverse *= double(k);
        out[k - 1] = z * out[k] + inverse;
    }
}

/* Set the weights of mode k of body b over a step. */
inline void set_mode_weights(const Waves& waves, const ExponentialCourse& course, Index b, Index k) noexcept {
    const Nodes& nodes = course.nodes;
    const Complexes<1> series = waves.series;
    const Index stages = nodes.points.size();
    for (Index i = 0; i < stages; ++i) {
        double t = course.h * nodes.points[i];
        set_series(waves.root(b, k) * t, series);
        waves.kept(b, k, i) = series[0];
        for (Index p = 0; p <= stages; ++p) {
            series[p + 1] *= t;
            t *= nodes.points[i];
        }
        const Complexes<1> weights = waves.weights[b][k][i];
        for (Index l = 0; l <= stages; ++l) {
            Complex total = 0.0;
            for (Index p = 0; p <= stages; ++p) total += nodes.powers(l, p) * series[p + 1];
            weights[l] = total;
        }
    }
    /* The last stage is the end. */
    Complex total = 0.0;
    for (Index p = 0; p <= stages; ++p) total += nodes.missed[p] * series[p + 1];
    waves.missed(b, k) = total;
}

/* Mass of mode k of body b, whose L is a diagonal. */
inline double modal_mass(const Model& model, Index b, Index k) noexcept {
    const double root = model.modal_root(b, k, k);
    return root * root;
}

/* Set the slope at a state, of modes without lambda z. */
inline void set_wave_slope(const Model& model, const Work& work, const Waves& waves, const ExponentialCourse& course,
                           CVec y, Index i) noexcept {
    const Vec out = waves.slopes[i];
    set_stage(model, work, y, course.given[i], course.amounts[i], out);
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Index m = model.elastic(b, 0), q = model.elastic(b, 1), momentum = model.elastic(b, 2);
        for (Index k = 0; k < m; ++k) {
            const double mass = modal_mass(model, b, k), v = y[momentum + k] / mass, slope = out[q + k] - v;
            const Complex root = waves.root(b, k);
            const double elastic = model.modal_stiffness(b, k) * y[q + k] + model.modal_damping(b, k) * v;
            const double push = out[momentum + k] + elastic;
            out[momentum + k] = push / mass - root.real() * slope;
            out[q + k] = root.imag() * slope;
        }
    }
}

/* Set displacement and momentum of a mode by z. */
inline void set_mode(const Model& model, const Waves& waves, Index b, Index k, Complex z, Vec out) noexcept {
    const Complex root = waves.root(b, k);
    const double place = z.imag() / root.imag();
    out[model.elastic(b, 1) + k] = place;
    out[model.elastic(b, 2) + k] = modal_mass(model, b, k) * (z.real() + root.real() * place);
}

/* z of a mode at a state. */
inline Complex start_of(const Model& model, const Waves& waves, CVec y, Index b, Index k) noexcept {
    const Complex root = waves.root(b, k);
    const double place = y[model.elastic(b, 1) + k], v = y[model.elastic(b, 2) + k] / modal_mass(model, b, k);
    return {v - root.real() * place, root.imag() * place};
}

/* Add a slope of a weight to a state, but for its modes. */
inline void add_slope(const Model& model, CVec slope, double weight, Vec out) noexcept {
    const Index bodies = WIDTH * model.mass.size(), size = out.size();
    add(weight, slope.slice(0, bodies), out.slice(0, bodies));
    add(weight, slope.slice(size - SUMS, size), out.slice(size - SUMS, size));
}

/* Set the state of a stage by the slopes. */
inline void set_wave_state(const Model& model, const Waves& waves, const ExponentialCourse& course, CVec y, Index i,
                           Vec out) noexcept {
    const Mat slopes = waves.slopes;
    copy(y, out);
    for (Index l = 0; l < slopes.size(); ++l) add_slope(model, slopes[l], course.h * course.nodes.weights(i, l), out);
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Index q = model.elastic(b, 1), momentum = model.elastic(b, 2);
        for (Index k = 0; k < model.elastic(b, 0); ++k) {
            const Complexes<1> weights = waves.weights[b][k][i];
            Complex z = waves.kept(b, k, i) * start_of(model, waves, y, b, k);
            for (Index l = 0; l < slopes.size(); ++l)
                z += weights[l] * Complex(slopes(l, momentum + k), slopes(l, q + k));
            set_mode(model, waves, b, k, z, out);
        }
    }
}

/* Set slopes of all stages by their states, and these anew; returns the largest weighted change. */
inline double improve(const Model& model, const Work& work, const Waves& waves, const ExponentialCourse& course,
                      CVec y) noexcept {
    double worst = 0.0;
    for (Index i = 0; i < waves.states.size(); ++i) set_wave_slope(model, work, waves, course, waves.states[i], 1 + i);
    for (Index i = 0; i < waves.states.size(); ++i) {
        const Vec state = waves.states[i];
        set_wave_state(model, waves, course, y, i, waves.other);
        for (Index j = 0; j < y.size(); ++j) {
            waves.apart[j] = waves.other[j] - state[j];
            state[j] = waves.other[j];
        }
        worst = larger_or_nan(worst, largest(model, work, waves.apart, course.weight));
    }
    return worst;
}

/* Find the stages by substitution; false where it does not converge. */
inline bool substitute(const Model& model, const Work& work, const Waves& waves, const ExponentialCourse& course,
                       CVec y) noexcept {
    double before = std::numeric_limits<double>::infinity();
    for (Index round = 0; round < SUBSTITUTIONS; ++round) {
        const double change = improve(model, work, waves, course, y);
        const Verdict outcome = verdict(waves.rate, change, before, course.limits, course.tolerance);
        if (outcome != Verdict::open) return outcome == Verdict::found;
        before = change;
    }
    return false;
}

/* The largest weighted difference to the method without the slope at the start. */
inline double wave_error(const Model& model, const Work& work, const Waves& waves,
                         const ExponentialCourse& course) noexcept {
    const Vec apart = waves.apart;
    const Nodes& nodes = course.nodes;
    fill(apart, 0.0);
    for (Index l = 0; l < waves.slopes.size(); ++l) add(nodes.leading[l], waves.slopes[l], apart);
    const Index bodies = WIDTH * model.mass.size();
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Index q = model.elastic(b, 1), momentum = model.elastic(b, 2);
        for (Index k = 0; k < model.elastic(b, 0); ++k) {
            const Complex z = waves.missed(b, k) * Complex(apart[momentum + k], apart[q + k]);
            set_mode(model, waves, b, k, z, apart);
        }
    }
    for (Index j = 0; j < bodies; ++j) apart[j] *= course.h * nodes.lost;
    for (Index j = apart.size() - SUMS; j < apart.size(); ++j) apart[j] *= course.h * nodes.lost;
    return largest(model, work, apart, course.weight);
}

/* The estimated error of a step, and whether its stages converged. */
struct WaveResult {
    double error;
    bool converged;
};

/* Set the state after a step from y; `slopes` of the stages have what is guessed of them. */
inline WaveResult exponential_step(const Model& model, const Work& work, const Waves& waves,
                                   const ExponentialCourse& course, CVec y, Vec out) noexcept {
    if (course.renew)
        for (Index b = 0; b < model.mass.size(); ++b)
            for (Index k = 0; k < model.elastic(b, 0); ++k) set_mode_weights(waves, course, b, k);
    set_wave_slope(model, work, waves, course, y, 0);
    const auto start = balance(model, work, y);
    waves.energy[0] = start.kinetic;
    const Index stages = waves.states.size();
    if (course.fresh)
        for (Index i = 0; i < stages; ++i) copy(waves.slopes[0], waves.slopes[1 + i]);
    for (Index i = 0; i < stages; ++i) set_wave_state(model, waves, course, y, i, waves.states[i]);
    if (!substitute(model, work, waves, course, y)) return {std::numeric_limits<double>::infinity(), false};
    const double error = wave_error(model, work, waves, course);
    copy(waves.states[stages - 1], out);
    for (Index b = 0; b < model.mass.size(); ++b) normalise(out.slice(WIDTH * b + TURN, WIDTH * b + TURN + 4));
    set_poses(model, work, out);
    set_bushings(model, work);
    const auto end = balance(model, work, out);
    return {larger_or_nan(error, imbalance(start.total, end.total, end.size) * course.energy), true};
}

/* Set the state at a place within a step from y; `slopes` are those of the step. */
inline void state_within(const Model& model, const Waves& waves, const Inside& inside, CVec y, Vec out) noexcept {
    const Nodes& nodes = inside.nodes;
    const double h = inside.h, x = inside.at;
    const Mat slopes = waves.slopes;
    const Index count = slopes.size();
    copy(y, out);
    for (Index l = 0; l < count; ++l) {
        double weight = 0.0, power = h * x, factorial = 1.0;
        for (Index p = 0; p < count; ++p) {
            factorial *= double(p + 1);
            weight += nodes.powers(l, p) * power / factorial;
            power *= x;
        }
        add_slope(model, slopes[l], weight, out);
    }
    for (Index b = 0; b < model.mass.size(); ++b) {
        const Index q = model.elastic(b, 1), momentum = model.elastic(b, 2);
        for (Index k = 0; k < model.elastic(b, 0); ++k) {
            set_series(waves.root(b, k) * h * x, waves.series);
            Complex z = waves.series[0] * start_of(model, waves, y, b, k);
            for (Index l = 0; l < count; ++l) {
                Complex total = 0.0;
                double power = h * x;
                for (Index p = 0; p < count; ++p) {
                    total += nodes.powers(l, p) * power * waves.series[p + 1];
                    power *= x;
                }
                z += total * Complex(slopes(l, momentum + k), slopes(l, q + k));
            }
            set_mode(model, waves, b, k, z, out);
        }
    }
}

}  // namespace gudgeon::turning
