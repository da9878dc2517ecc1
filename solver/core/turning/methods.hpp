/* The methods of steps of bodies on joints, members of one family: explicit, implicit and exponential.
 *
 *     power      of the step in its estimated error
 *     cost       CPU time of a step over that of an explicit one
 *     bound      size of explicit steps times the highest frequency of a body, from which on it is tried instead
 *     holds      growth below which the next step keeps the size of the last one, where another size costs
 *     compute    sets the state after a step h [s] from y at a time
 *     restart    lets steps begin from a state: the first one, or one that an event changed
 *     accept     lets steps begin from the end of the step that was computed last
 *     span       makes the interpolation of this step ready, before it is accepted
 *     within     sets the state at a place x within it, over the step
 */
#pragma once
#include "exponential.hpp"
#include "implicit.hpp"
#include "owned.hpp"

namespace gudgeon::turning {

inline constexpr Index EXPLICIT = 1, IMPLICIT = 2, EXPONENTIAL = 4; /* Of `Settings.methods`. */
/* Last motion of Newton's method over the size of the scene; a step with more is repeated shorter. */
inline constexpr double LEFT_OPEN = 1e-8;

/* Sets drives (t, d, 3) and loads (t, l) at times [s], (t,); it may throw. */
struct Loads {
    void* owner;
    void (*set)(void* owner, CVec times, Cube drives, Mat amounts);
    Index drives, amounts;

    void at(CVec times, Cube driven, Mat loads) const {
        if (drives || amounts) set(owner, times, driven, loads);
    }
};

/* What all methods of a run have in common. */
struct Problem {
    const Model& model;
    const Work& work;
    const Settings& settings;
    Loads loads;
};

/* A step that was computed. */
struct Tried {
    double h;           /* [s] */
    double error;       /* Over what is asked for. */
    double least;       /* Pivot. */
    bool sound;         /* Whether Newton's method converged and all is finite. */
    bool project;       /* Whether stages were projected on the joints, too. */
    bool good() const noexcept { return sound && error <= 1.0; }
};

inline bool finite(CVec values) noexcept {
    for (Index i = 0; i < values.size(); ++i)
        if (!std::isfinite(values[i])) return false;
    return true;
}

/* Drives and loads at the stages of a step. */
struct Stages {
    Vec times;          /* [s], (t,). */
    Cube given;         /* (t, d, 3) */
    Mat amounts;        /* (t, l) */

    Stages(Arrays& arrays, const Problem& run, Index count)
        : times(arrays.make<Vec>(count)), given(arrays.make<Cube>(count, run.loads.drives, 3)),
          amounts(arrays.make<Mat>(count, run.loads.amounts)) {}

    /* Set those at the start and at points of a step. */
    void set(const Problem& run, double time, double h, CVec points) const {
        run.work.least[0] = 1.0;
        for (Index i = 0; i < run.work.field.size(); ++i) run.work.field(i, co_energy::LEFT) = 0.0;
        const Index start = times.size() - points.size();
        if (start) times[0] = time;
        for (Index i = 0; i < points.size(); ++i) times[start + i] = time + h * points[i];
        run.loads.at(times, given, amounts);
    }
};

/* Steps of Dormand and Prince's method of order 8. */
class Explicit {
public:
    static constexpr double power = 8.0, cost = 1.0, bound = 0.0, holds = 1.0;
    static constexpr Index kind = EXPLICIT;

    Explicit(Arrays& arrays, const Problem& run)
        : run_(run), stages_(arrays, run, run.settings.times.size()),
          course_{run.settings.tableau, stages_.given, stages_.amounts, {}, false},
          dense_(arrays.make<Mat>(7, run.work.stage.size())) {}

    Tried compute(CVec y, double time, double h, bool project, CVec weight, Vec out) {
        stages_.set(run_, time, h, run_.settings.times);
        course_.weight = weight, course_.project = project, h_ = h;
        const StepResult result = step(run_.model, run_.work, course_, y, h, out);
        return {h, result.error / run_.settings.tolerance, run_.work.least[0],
                result.finite && result.residual <= LEFT_OPEN, project};
    }

    void restart(CVec y, double time) {
        stages_.set(run_, time, 0.0, run_.settings.times);
        begin(run_.model, run_.work, y, stages_.given[0], stages_.amounts[0]);
    }

    void accept() noexcept { copy(run_.work.slopes[MAIN], run_.work.slopes[0]); }

    void span(CVec y, CVec end) noexcept {
        const Mat K = run_.work.slopes, D = dense_;
        interpolation(run_.model, run_.work, course_, y, h_);
        for (Index i = 0; i < y.size(); ++i) {
            const double change = end[i] - y[i];
            D(0, i) = change;
            D(1, i) = h_ * K(0, i) - change;
            D(2, i) = 2 * change - h_ * (K(MAIN, i) + K(0, i));
        }
        for (Index r = 0; r < 4; ++r) {
            const Vec row = D[3 + r];
            fill(row, 0.0);
            for (Index k = 0; k < K.size(); ++k) add(h_ * course_.table.dense(r, k), K[k], row);
        }
    }

    void within(CVec y, double x, Vec out) const noexcept {
        for (Index i = 0; i < y.size(); ++i) {
            double value = 0.0;
            for (Index k = 0; k < 7; ++k) value = (value + dense_(6 - k, i)) * (k % 2 ? 1.0 - x : x);
            out[i] = value + y[i];
        }
    }

private:
    Problem run_;
    Stages stages_;
    ExplicitCourse course_;
    Mat dense_;
    double h_ = 0.0;
};

/* The value at x of a sum of powers of coefficients from the constant on. */
inline double power_sum(CVec coefficients, double x) noexcept {
    double value = 0.0;
    for (Index k = coefficients.size(); k-- > 0;) value = value * x + coefficients[k];
    return value;
}

/* What steps by collocation begin with and keep. */
struct Continued {
    double h = 0.0;     /* Of the last step [s]. */
    double kinetic;     /* Largest kinetic energy so far, by which the error of the energy balance is measured [J]. */
    bool fresh = true;  /* Whether nothing is known of a step before. */
};

/* Steps by collocation at the points of Lobatto, whose stages obey the joints, by Newton's method. */
class Implicit {
public:
    static constexpr double power = 6.0, cost = 1.5, bound = 3.0, holds = 1.0;
    static constexpr Index kind = IMPLICIT;
    /* Tolerance of Newton's method over that of a step, and at most: what is left violates balances of momentum. */
    static constexpr double NEWTON = 0.03, MOST = 1e-13;
    static constexpr Limits limits{0.9, 1e-3};

    Implicit(Arrays& arrays, const Problem& run)
        : run_(run), stages_(arrays, run, 1 + run.settings.table.points.size()),
          times_(arrays.make<Complexes<1>>(run.settings.table.eigenvalues.size())),
          first_(arrays.make<Vec>(run.settings.table.points.size())),
          error_(arrays.make<Vec>(run.settings.table.points.size())), newton_(newton_of(arrays, run)),
          root_(arrays.copy_of(run.model.modal_root)), stiff_(run.model),
          increments_(arrays.copy_of(newton_.stages)), multipliers_(arrays.copy_of(newton_.multipliers)),
          before_{0.0, run.settings.kinetic} {
        stiff_.modal_root = root_;
    }

    Tried compute(CVec y, double time, double h, bool, CVec weight, Vec out) {
        const Table& table = run_.settings.table;
        stages_.set(run_, time, h, table.points);
        for (Index k = 0; k < times_.size(); ++k) times_[k] = table.eigenvalues[k] / h;
        for (Index i = 0; i < first_.size(); ++i) first_[i] = h * table.points[i], error_[i] = table.error[i] / h;
        const double asked = run_.settings.longer_tolerance;
        const ImplicitCourse course{times_, first_, table.start, table.there, table.back, table.error_start, error_,
                                    stages_.given, stages_.amounts, weight, 1.0 / before_.kinetic, before_.fresh,
                                    lesser(NEWTON * asked, MOST), limits, asked};
        if (!before_.fresh) guess(h);
        const auto result = implicit_step(run_.model, stiff_, root_, run_.work, newton_, course, y, out);
        const Vec last = newton_.stages[first_.size() - 1];
        for (Index i = 0; i < y.size(); ++i) last[i] = out[i] - y[i];
        h_ = h;
        const bool sound = result.converged && result.left <= LEFT_OPEN && std::isfinite(result.error) && finite(out);
        return {h, result.error / asked, run_.work.least[0], sound, false};
    }

    void restart(CVec, double) noexcept { before_.fresh = true; }

    void accept() noexcept {
        std::copy_n(newton_.stages.data, newton_.stages.shape[0] * newton_.stages.shape[1], increments_.data);
        std::copy_n(newton_.multipliers.data, multipliers_.shape[0] * multipliers_.shape[1], multipliers_.data);
        before_ = {h_, larger(before_.kinetic, newton_.energy[0]), false};
    }

    void span(CVec, CVec) noexcept {}

    void within(CVec y, double x, Vec out) const noexcept {
        copy(y, out);
        for (Index l = 0; l < newton_.stages.size(); ++l)
            add(power_sum(run_.settings.table.polynomials[1 + l], x), newton_.stages[l], out);
    }

private:
    /* Set increments and multipliers of stages by the polynomials of the last step, continued. */
    void guess(double h) noexcept {
        const Table& table = run_.settings.table;
        const Index count = table.points.size();
        for (Index i = 0; i < count; ++i) {
            const double x = 1.0 + table.points[i] * (h / before_.h);
            fill(newton_.stages[i], 0.0);
            fill(newton_.multipliers[i], 0.0);
            for (Index l = 0; l < count; ++l) {
                const double share = power_sum(table.polynomials[1 + l], x) - (l == count - 1 ? 1.0 : 0.0);
                add(share, increments_[l], newton_.stages[i]);
                add(power_sum(table.outer[l], x), multipliers_[l], newton_.multipliers[i]);
            }
        }
    }

    static Newton newton_of(Arrays& arrays, const Problem& run) {
        const Index n = run.model.mass.size(), m = run.model.row_terms.size(), e = run.model.point_rows.shape[2];
        const Index s = run.settings.table.points.size(), k = run.settings.table.eigenvalues.size();
        const Index size = run.work.stage.size();
        Newton w{};
        w.begin = arrays.make<Vec>(size), w.held = arrays.make<Vec>(m);
        w.stages = arrays.make<Mat>(s, size), w.slopes = arrays.make<Mat>(s, size);
        w.multipliers = arrays.make<Mat>(s, m), w.lacks = arrays.make<Mat>(s, m);
        w.step = arrays.make<Mat>(s, size), w.multiplier_step = arrays.make<Mat>(s, m);
        w.state = arrays.make<Vec>(size);
        w.rows = arrays.make<Ints>(m), w.first = arrays.make<Ints>(m), w.end = arrays.make<Ints>(m);
        w.place = arrays.make<Ints>(m), w.rank = arrays.make<Ints>(1);
        w.part = arrays.make<IntMat>(4 * m, 3), w.parts = arrays.make<Ints>(1), w.owner = arrays.make<IntMat>(m, 4);
        w.block = arrays.make<Cube>(m, 4, 6 + e), w.turn = arrays.make<Cube>(n, 3, 3);
        w.coupling = arrays.make<Cube>(n, 3, e), w.inertia = arrays.make<Cube>(n, 3, 3);
        w.back = arrays.make<Complexes<3>>(k, n, e), w.core = arrays.make<Complexes<4>>(k, n, 3, 3);
        w.light = arrays.make<Complexes<3>>(m, 4, 6 + e), w.lower = arrays.make<Complexes<3>>(k, m, m);
        w.right = arrays.make<Complexes<1>>(size), w.change = arrays.make<Complexes<1>>(size);
        w.push = arrays.make<Complexes<2>>(n, 6 + e), w.moved = arrays.make<Complexes<2>>(n, 6 + e);
        w.lack = arrays.make<Complexes<1>>(m), w.multiplier = arrays.make<Complexes<1>>(m);
        w.spare = arrays.make<Complexes<1>>(m);
        w.rate = arrays.make<Vec>(1), w.energy = arrays.make<Vec>(1);
        w.rate[0] = 0.5;
        return w;
    }

    Problem run_;
    Stages stages_;
    Complexes<1> times_;
    Vec first_, error_;
    Newton newton_;
    Cube root_;
    Model stiff_;
    Mat increments_, multipliers_; /* Of the last step. */
    Continued before_;
    double h_ = 0.0;
};

/* Steps of bodies without joints in which vibrations of modes are exact: the slopes beside them are polynomials. */
class Exponential {
public:
    static constexpr double power = 6.0, cost = 1.0, bound = 0.5, holds = 1.2;
    static constexpr Index kind = EXPONENTIAL;
    static constexpr double SUBSTITUTION = 3e-3; /* Tolerance of the stages over that of a step. */
    /* Ratio of changes beyond which a shorter step is the better one, and the least that is believed. */
    static constexpr Limits limits{0.5, 1e-4};

    Exponential(Arrays& arrays, const Problem& run)
        : run_(run), stages_(arrays, run, 1 + run.settings.table.points.size()), waves_(waves_of(arrays, run)),
          slopes_(arrays.copy_of(waves_.slopes)), before_{0.0, run.settings.kinetic} {}

    Tried compute(CVec y, double time, double h, bool, CVec weight, Vec out) {
        const double asked = run_.settings.longer_tolerance;
        stages_.set(run_, time, h, run_.settings.table.points);
        const ExponentialCourse course{run_.settings.nodes, h, stages_.given, stages_.amounts, weight,
                                       1.0 / before_.kinetic, before_.fresh, h != h_, SUBSTITUTION * asked, limits};
        if (!before_.fresh) guess(h);
        const auto result = exponential_step(run_.model, run_.work, waves_, course, y, out);
        h_ = h;
        return {h, result.error / asked, 1.0, result.converged && std::isfinite(result.error) && finite(out), false};
    }

    void restart(CVec, double) noexcept { before_.fresh = true; }

    void accept() noexcept {
        std::copy_n(waves_.slopes.data, slopes_.shape[0] * slopes_.shape[1], slopes_.data);
        before_ = {h_, larger(before_.kinetic, waves_.energy[0]), false};
    }

    void span(CVec, CVec) noexcept {}

    void within(CVec y, double x, Vec out) const noexcept {
        state_within(run_.model, waves_, {run_.settings.nodes, h_, x}, y, out);
    }

private:
    /* Set the slopes of the stages by the polynomials of the last step, continued. */
    void guess(double h) noexcept {
        const Table& table = run_.settings.table;
        for (Index i = 0; i < table.points.size(); ++i) {
            const double x = 1.0 + table.points[i] * (h / before_.h);
            const Vec slope = waves_.slopes[1 + i];
            fill(slope, 0.0);
            for (Index l = 0; l < slopes_.size(); ++l) add(power_sum(table.polynomials[l], x), slopes_[l], slope);
        }
    }

    static Waves waves_of(Arrays& arrays, const Problem& run) {
        const Index n = run.settings.roots.shape[0], e = run.settings.roots.shape[1];
        const Index s = run.settings.table.points.size(), size = run.work.stage.size();
        Waves w{};
        w.root = run.settings.roots;
        w.kept = arrays.make<Complexes<3>>(n, e, s), w.weights = arrays.make<Complexes<4>>(n, e, s, 1 + s);
        w.missed = arrays.make<Complexes<2>>(n, e), w.series = arrays.make<Complexes<1>>(s + 2);
        w.slopes = arrays.make<Mat>(1 + s, size), w.states = arrays.make<Mat>(s, size);
        w.other = arrays.make<Vec>(size), w.apart = arrays.make<Vec>(size);
        w.rate = arrays.make<Vec>(1), w.energy = arrays.make<Vec>(1);
        w.rate[0] = 0.1;
        return w;
    }

    Problem run_;
    Stages stages_;
    Waves waves_;
    Mat slopes_;        /* Of the last step. */
    Continued before_;
    double h_ = 0.0;
};

}  // namespace gudgeon::turning
