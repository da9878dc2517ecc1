/* The response of a port or of a block of ports to its own displacement, with the forces of all others as they are. */
#pragma once
#include "../laws/power.hpp"
#include "../small/arrays.hpp"

namespace gudgeon::small {

constexpr int BISECTIONS = 200;

/* Whether ports of a kind only press. */
inline bool presses(Index kind) noexcept {
    return kind == UNILATERAL || kind == CONE || kind == LAW || kind == RUBBING_LAW;
}

/* The table of a spring, elongation [m] and tension [N], none where it is linear, (n, 2). */
inline CMat knots_of(const Constants& constants, Index i) noexcept {
    const Index begin = constants.table(i, 0), end = constants.table(i, 1);
    return {constants.knots.data + 2 * begin, {end - begin, 2}};
}

/* Two friction forces [N] and whether they slip. */
struct Friction {
    double first, second;
    bool slips;
};

/* Largest static and kinetic friction force [N]. */
struct Limit {
    double rest, slip;
};

/* limit: largest friction.  slipping: whether the point slipped a step ago.  trial, across: forces that would hold
 * it [N]. */
inline Friction rubbed(Limit limit, bool slipping, double trial, double across) noexcept {
    const double size = std::sqrt(trial * trial + across * across);
    if (size <= (slipping ? limit.slip : limit.rest)) return {trial, across, false};
    const double scale = size > 0.0 ? limit.slip / size : 0.0;
    return {trial * scale, across * scale, true};
}

/* What a port responds to. */
struct Pressing {
    double before;  /* Displacement a step ago [m]. */
    double free;    /* The same at the end of the step without the force [m]. */
    double reach;   /* Displacement per unit of the force [m/N]. */
    double dt;      /* [s] */
    bool ends;      /* Whether the force is that at the end of the step, else its mean. */
};

/* Force [N] of a linear spring.  law: stiffness [N/m] and damping [N s/m] first. */
inline double spring_force(CVec law, const Pressing& pressing) noexcept {
    const auto [before, free, reach, dt, ends] = pressing;
    const double rate = law[1] / dt;
    if (ends) return -(law[0] * free + rate * (free - before)) / (1.0 + reach * (law[0] + rate));
    return -(0.5 * law[0] * (before + free) + rate * (free - before)) / (1.0 + reach * (0.5 * law[0] + rate));
}

/* Tension [N] of a table of knots, (n, 2), continued with the slopes of its ends. */
inline double tension_at(CMat knots, double elongation) noexcept {
    Index last = 1;
    while (last < knots.size() - 1 && elongation > knots(last, 0)) ++last;
    const double slope = (knots(last, 1) - knots(last - 1, 1)) / (knots(last, 0) - knots(last - 1, 0));
    return knots(last - 1, 1) + slope * (elongation - knots(last - 1, 0));
}

/* Integral of a table's tension from one elongation [m] to another [J], without cancellation. */
inline double stored_between(CMat knots, double from, double to) noexcept {
    const double low = lesser(from, to), high = larger(from, to);
    double begin = low, total = 0.0;
    for (Index n = 0; n < knots.size(); ++n)
        if (low < knots(n, 0) && knots(n, 0) < high) {
            total += 0.5 * (knots(n, 0) - begin) * (tension_at(knots, begin) + knots(n, 1));
            begin = knots(n, 0);
        }
    total += 0.5 * (high - begin) * (tension_at(knots, begin) + tension_at(knots, high));
    return to >= from ? total : -total;
}

/* What a spring stores [J]: with its stiffness, or with its table where it has knots. */
inline double spring_energy(CVec law, CMat knots, double elongation) noexcept {
    if (knots.size() > 0) return stored_between(knots, 0.0, elongation);
    return 0.5 * law[0] * elongation * elongation;
}

/* Tension [N] of a spring with a table whose elongation at the end of the step is `after` [m]. */
inline double tabled_tension(CVec law, CMat knots, const Pressing& pressing, double after) noexcept {
    const double before = pressing.before;
    const double tension = pressing.ends || after == before
                               ? tension_at(knots, after)
                               : stored_between(knots, before, after) / (after - before);
    return tension + law[1] * (after - before) / pressing.dt;
}

/* Force [N] of a spring with a table, by false position.  law: damping [N s/m] second.
 *
 * The tension does not decrease with the elongation: the zero of T - tension(T) is between 0 and the first tension. */
inline double tabled_force(CVec law, CMat knots, const Pressing& pressing) noexcept {
    const double free = pressing.free, reach = pressing.reach;
    const double limit = tabled_tension(law, knots, pressing, free);
    double low = 0.0, high = limit;
    double wrong_low = -tabled_tension(law, knots, pressing, free - reach * low);
    double wrong_high = limit - tabled_tension(law, knots, pressing, free - reach * limit);
    if (wrong_low == 0.0 || wrong_high == 0.0) return wrong_low == 0.0 ? -low : -high;
    int side = 0;
    const double size = std::abs(limit);
    for (int turn = 0; turn < BISECTIONS; ++turn) {
        const double tension = (low * wrong_high - high * wrong_low) / (wrong_high - wrong_low);
        const double wrong = tension - tabled_tension(law, knots, pressing, free - reach * tension);
        if (std::abs(wrong) <= 1e-15 * size || std::abs(high - low) <= 1e-15 * size) return -tension;
        if ((wrong > 0.0) == (wrong_high > 0.0)) {
            high = tension, wrong_high = wrong;
            wrong_low *= side == 1 ? 0.5 : 1.0;
            side = 1;
        } else {
            low = tension, wrong_low = wrong;
            wrong_high *= side == -1 ? 0.5 : 1.0;
            side = -1;
        }
    }
    return -0.5 * (low + high);
}

/* Mean force [N] between two depths [m], with the losses of the law.  approach: v- [m/s]. */
inline double mean_law(CVec law, double before, double after, double approach, double dt) noexcept {
    if (before <= 0.0 && after <= 0.0) return 0.0;
    const double elastic = quotient(law, before, after), rate = (after - before) / dt;
    const double per_rate = approach > 0.0 ? law[2] / approach : 0.0;
    return larger(0.0, elastic * (1.0 + per_rate * rate) + law[3] * rate);
}

/* Force [N] of a law whose depth at the end of the step is `after` [m]; depths are those of `pressing`. */
inline double law_at(CVec law, const Pressing& pressing, double after, double approach) noexcept {
    const double before = pressing.before, dt = pressing.dt;
    if (pressing.ends) return law_force(law, after, (after - before) / dt, approach).force;
    return mean_law(law, before, after, approach, dt);
}

/* Force [N] of a contact law, by false position.
 *
 * approach: v- [m/s].  pressing: depths instead of displacements, and the depth that a unit of the force takes away.
 * The force falls with itself: a zero of force - law(depth(force)) lies between 0 and that without it. */
inline double pressed_law(CVec law, double approach, const Pressing& pressing) noexcept {
    const double free = pressing.free, reach = pressing.reach;
    double low = 0.0, high = law_at(law, pressing, free, approach);
    if (high <= 0.0) return 0.0;
    double wrong_low = -high, wrong_high = high - law_at(law, pressing, free - reach * high, approach);
    if (wrong_high <= 0.0) return high;
    int side = 0;
    for (int turn = 0; turn < BISECTIONS; ++turn) {
        double force = (low * wrong_high - high * wrong_low) / (wrong_high - wrong_low);
        if (!(low < force && force < high)) force = 0.5 * (low + high);
        const double wrong = force - law_at(law, pressing, free - reach * force, approach);
        if (std::abs(wrong) <= 1e-15 * high || high - low <= 1e-15 * high) return force;
        if (wrong > 0.0) {
            high = force, wrong_high = wrong;
            if (side == 1) wrong_low *= 0.5;
            side = 1;
        } else {
            low = force, wrong_low = wrong;
            if (side == -1) wrong_high *= 0.5;
            side = -1;
        }
    }
    return 0.5 * (low + high);
}

/* Force [N] of the spring or contact law of port i: the mean of the step, or that at its end.
 *
 * free: displacement at the end of the step without the force [m].  reach: displacement per unit of the force [m/N]. */
inline double compliant_force(const Constants& constants, const State& state, Index i, double free,
                              double reach) noexcept {
    const CVec law = constants.law[i];
    const bool ends = constants.share[i] < 1.0;
    const double before = state.displacement(1, i), dt = constants.dt[0];
    if (constants.kind[i] != SPRING) return pressed_law(law, state.approach[i], {-before, -free, reach, dt, ends});
    const CMat knots = knots_of(constants, i);
    if (knots.size() > 0) return tabled_force(law, knots, {before, free, reach, dt, ends});
    return spring_force(law, {before, free, reach, dt, ends});
}

/* The inverse of what a unit force of candidate a moves it by [N/m]; 0 where nothing moves.
 *
 * size: 2 for the first of two tangents, whose larger eigenvalue keeps the projection of its step a contraction. */
inline double stiffness(CMat columns, Index a, int size) noexcept {
    double reach = columns(a, a);
    if (size == 2) {
        const double p = reach, r = columns(a + 1, a + 1), s = 0.5 * (columns(a, a + 1) + columns(a + 1, a));
        reach = 0.5 * (p + r) + std::sqrt(0.25 * ((p - r) * (p - r)) + s * s);
    }
    return reach <= 0.0 ? 0.0 : 1.0 / reach;
}

/* The response of the two tangents of a cone.
 *
 * stiff: as `stiffness` returns it [N/m].  first, second, y_first, y_second: forces [N] and measures [m]. */
inline Friction held_or_rubbed(double stiff, Limit limit, bool slides, double first, double second, double y_first,
                               double y_second) noexcept {
    if (limit.rest <= 0.0) return {0.0, 0.0, false};
    return rubbed(limit, slides, first - stiff * y_first, second - stiff * y_second);
}

}  // namespace gudgeon::small
