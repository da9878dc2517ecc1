/* Derivatives of the forces of ports, and of their extra means where contact closes or opens within a step. */
#pragma once
#include "closing.hpp"

namespace gudgeon::small {

/* A number with its derivatives by the six arguments of an extra mean. */
struct Dual {
    static constexpr Index COUNT = 6;
    double value = 0.0;
    double slope[COUNT] = {};

    static Dual argument(double value, Index number) noexcept {
        Dual made{value};
        made.slope[number] = 1.0;
        return made;
    }
    /* f(value) with f' = by. */
    Dual chained(double f, double by) const noexcept {
        Dual made{f};
        for (Index k = 0; k < COUNT; ++k) made.slope[k] = by * slope[k];
        return made;
    }
};

inline Dual combined(double value, const Dual& a, double by_a, const Dual& b, double by_b) noexcept {
    Dual made{value};
    for (Index k = 0; k < Dual::COUNT; ++k) made.slope[k] = by_a * a.slope[k] + by_b * b.slope[k];
    return made;
}
inline Dual operator+(const Dual& a, const Dual& b) noexcept { return combined(a.value + b.value, a, 1.0, b, 1.0); }
inline Dual operator-(const Dual& a, const Dual& b) noexcept { return combined(a.value - b.value, a, 1.0, b, -1.0); }
inline Dual operator*(const Dual& a, const Dual& b) noexcept {
    return combined(a.value * b.value, a, b.value, b, a.value);
}
inline Dual operator/(const Dual& a, const Dual& b) noexcept {
    const double ratio = a.value / b.value;
    return combined(ratio, a, 1.0 / b.value, b, -ratio / b.value);
}
inline Dual operator*(double factor, const Dual& a) noexcept { return a.chained(factor * a.value, factor); }
inline Dual root_of(const Dual& a) noexcept {
    const double root = std::sqrt(larger(0.0, a.value));
    return a.chained(root, root > 0.0 ? 0.5 / root : 0.0);
}

/* Arguments of an extra mean, by which `Dual` has derivatives. */
enum Argument { FORCE, PLACE, WAY, INERTIA, EXTRA, YIELD };

/* What an extra mean depends on: the force of the port at the end of the step where it closes, at its start where it
 * opens [N]; its gap at the start where it closes, its measure at the end where it opens [m]; the way of its compliance
 * [m]; the inertia and the compliance of the port [m/N]; the extra mean itself [N]. */
struct Closure {
    double force, place, way, inertia, extra, yield;
};

/* The extra mean [N] of a port that closes, -(1 - share) force, by `closed_share`. */
inline Dual closing_extra(const Closure& at, double share) noexcept {
    const Dual now = Dual::argument(at.force, FORCE), begin = Dual::argument(at.place, PLACE);
    const Dual inertia = Dual::argument(at.inertia, INERTIA), extra = Dual::argument(at.extra, EXTRA);
    const Dual force = share * now;
    if (at.place <= 0.0 || at.yield <= 0.0) return {};
    const Dual way = at.way > 0.0 ? Dual::argument(at.way, WAY) : Dual::argument(at.yield, YIELD) * now;
    const Dual depth = way + inertia * (force + extra), one = Dual{1.0} + inertia * force / way;
    const Dual less = depth - begin, root = root_of(less * less + 4.0 * (one * depth * begin));
    const Dual end = 0.5 * ((less + root) / one);
    return (end / (end + begin) - Dual{1.0}) * (force * end / way);
}

/* The same of a port that opens. */
inline Dual opening_extra(const Closure& at, double share) noexcept {
    const Dual last = Dual::argument(at.force, FORCE), measure = Dual::argument(at.place, PLACE);
    const Dual inertia = Dual::argument(at.inertia, INERTIA), extra = Dual::argument(at.extra, EXTRA);
    const Dual open = measure - inertia * extra, force = (1.0 - share) * last;
    if (open.value <= 0.0 || at.yield <= 0.0) return {};
    const Dual way = at.way < 0.0 ? Dual::argument(at.way, WAY) : -1.0 * (Dual::argument(at.yield, YIELD) * last);
    const Dual less = open + way - force * inertia;
    const Dual end = 0.5 * (less + root_of(less * less - 4.0 * (open * way)));
    return (way / (way - end) - Dual{1.0}) * force;
}

/* Derivatives of the force of a law or a spring: by the displacements at the start and at the end of a step [N/m], and
 * by the first, second and fourth coefficient of its law. */
struct Slopes {
    double before, after, first, second, last;
};

/* d K d^n / dn [N], and the same of what it stores [J]. */
inline double by_exponent(CVec law, double d) noexcept {
    return d > 0.0 ? law[0] * power_of(d, law[1]) * std::log(d) : 0.0;
}
inline double stored_by_exponent(CVec law, double d) noexcept {
    return d > 0.0 ? law_energy(law, d) * (std::log(d) - 1.0 / (law[1] + 1.0)) : 0.0;
}

/* Of the mean elastic force between two depths [m], which `quotient` gives. */
inline Slopes quotient_slopes(CVec law, double before, double after) noexcept {
    const double width = after - before, mean = quotient(law, before, after);
    Slopes found{0.0, 0.0, mean / law[0], 0.0, 0.0};
    if (before > 0.0 && after > 0.0 && std::abs(width) < CLOSE_DEPTHS * larger(before, after)) {
        for (int point = 0; point < 4; ++point) {
            const double share = GAUSS_POINTS[point], d = before + share * width;
            const double slope = GAUSS_WEIGHTS[point] * law_force(law, d, 0.0, 1.0).stiffness;
            found.before += (1.0 - share) * slope;
            found.after += share * slope;
            found.second += GAUSS_WEIGHTS[point] * by_exponent(law, d);
        }
        return found;
    }
    found.before = (mean - law_force(law, before, 0.0, 1.0).force) / width;
    found.after = (law_force(law, after, 0.0, 1.0).force - mean) / width;
    found.second = (stored_by_exponent(law, after) - stored_by_exponent(law, before)) / width;
    return found;
}

/* Of the force of a law without loss by the speed of approach that presses.
 *
 * ends: whether it is that at the end of the step, else its mean.  before, after: displacements [m].  dt: step [s]. */
inline Slopes law_slopes(CVec law, bool ends, double before, double after, double dt) noexcept {
    const double per_rate = law[3] / dt;
    Slopes found{0.0, 0.0, 0.0, 0.0, 0.0};
    if (ends) {
        const double d = -after;
        found = {0.0, law_force(law, d, 0.0, 1.0).stiffness, power_of(d, law[1]), by_exponent(law, d), 0.0};
    } else {
        found = quotient_slopes(law, -before, -after);
    }
    /* By depths, which are displacements of the other sign. */
    found.before = -(found.before - per_rate), found.after = -(found.after + per_rate);
    found.last = (before - after) / dt;
    return found;
}

/* Of a linear spring: its stiffness is the first coefficient, its dashpot the second. */
inline Slopes spring_slopes(CVec law, bool ends, double before, double after, double dt) noexcept {
    const double share = ends ? 1.0 : 0.5, rate = law[1] / dt;
    return {-(1.0 - share) * law[0] + rate, -share * law[0] - rate, -((1.0 - share) * before + share * after),
            -(after - before) / dt, 0.0};
}

}  // namespace gudgeon::small
