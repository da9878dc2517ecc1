/* Shapes of bearings that lessen the indentation of a journal: worn ones and elastic ones.
 *
 * Worn: cells at angles theta_i about a bearing or journal have worn depths h_i. With u_i their directions and e the
 * offset of the journal in the frame of the cells, weights p_i ~ exp((e.u_i - h_i)/tau) fall to 37 % where a cell is
 * indented by tau less: a foundation whose pressure has, in a round bearing, the standard deviation sqrt(tau/|e|) about
 * the line of contact. The averaged depth
 *
 *     H(e) = -tau log(sum exp((e.u_i - h_i)/tau) / sum exp(e.u_i/tau))
 *
 * is exactly h where all depths are h, has the gradient -sum (p_i - p0_i) u_i with p0 the weights without wear, and is
 * smooth however rough the depths are: where a groove conforms to the journal the contact is spread over the groove.
 *
 * Elastic: the potential over the offset is tabulated by `turning/touching/yielding.py` as the indentation delta of a
 * linear law that has the same energy, H(e) = |e| - c - delta(rho, theta) with rho = |e| - e0(theta).
 */
#pragma once
#include <numbers>

#include "../turning/arrays.hpp"
#include "../turning/vectors.hpp"

namespace gudgeon::turning {

/* H [m] and its gradient along the frame of the cells. */
struct Depth {
    double depth, x, y;
};

/* H of a section's bearing (side 0) or journal (1) at an offset (x, y) along the frame of its cells [m]. */
inline Depth soft_depth(const Model& model, Index i, Index side, double x, double y) noexcept {
    const double soft = model.worn_soft[i], over = 1.0 / soft;
    const Index cells = model.worn_cells(i, side);
    const CMat turn = model.worn_turn[i];
    const CVec worn_depth = model.worn_depth[i][side];
    double high = -std::numeric_limits<double>::infinity(), round_high = high;
    for (Index k = 0; k < cells; ++k) {
        const double along = x * turn(k, 0) + y * turn(k, 1);
        high = larger_or_nan(high, along - worn_depth[k]);
        round_high = larger_or_nan(round_high, along);
    }
    double worn = 0.0, wx = 0.0, wy = 0.0, bare = 0.0, bx = 0.0, by = 0.0;
    for (Index k = 0; k < cells; ++k) {
        const double c = turn(k, 0), s = turn(k, 1), along = x * c + y * s;
        const double p = std::exp((along - worn_depth[k] - high) * over), q = std::exp((along - round_high) * over);
        worn += p, wx += p * c, wy += p * s;
        bare += q, bx += q * c, by += q * s;
    }
    return {round_high - high - soft * std::log(worn / bare), bx / bare - wx / worn, by / bare - wy / worn};
}

/* A value and its slope. */
struct Slope {
    double value, slope;
};

/* A polynomial by its coefficients of falling powers, (degree + 1,). */
inline Slope polynomial(CVec coefficients, double x) noexcept {
    double value = 0.0, slope = 0.0;
    for (Index n = 0; n < coefficients.size(); ++n) {
        slope = slope * x + value;
        value = value * x + coefficients[n];
    }
    return {value, slope};
}

/* delta [m] of a table, its slopes by rho and theta, and by both. */
struct Indentation {
    double depth, by_reach, by_turn, mixed;
};

/* delta by the coefficients of a cell, of falling powers along rho and theta, (degree + 1, degree + 1). */
inline Indentation indentation(CMat coefficients, double way, double turn) noexcept {
    double depth = 0.0, by_reach = 0.0, by_turn = 0.0, mixed = 0.0;
    for (Index m = 0; m < coefficients.size(); ++m) {
        const Slope row = polynomial(coefficients[m], turn);
        by_reach = by_reach * way + depth;
        depth = depth * way + row.value;
        mixed = mixed * way + by_turn;
        by_turn = by_turn * way + row.slope;
    }
    return {depth, by_reach, by_turn, mixed};
}

/* H of a section's elastic bearing at an offset (x, y) along the bearing's frame [m]. */
inline Depth yielding_depth(const Model& model, Index i, double x, double y) noexcept {
    const Index table = model.yielding[i], around = model.yielding_touch.shape[1];
    const double size = length_of(x, y), over = size > 0.0 ? 1.0 / size : 0.0, c = x * over, s = y * over;
    const double turn = 2.0 * std::numbers::pi, step = turn / double(around), signed_angle = std::atan2(y, x);
    const double angle = signed_angle < 0.0 ? signed_angle + turn : signed_angle;
    const Index cell = larger(Index(0), lesser(Index(angle / step), around - 1));  /* NaN too has a cell. */
    const double past = angle - double(cell) * step;
    const Slope first = polynomial(model.yielding_touch[table][cell], past);
    const double along = size - first.value;
    const CVec reach = model.yielding_reach[table];
    const Index last = reach.size() - 1;
    const double inside = lesser(larger(along, reach[0]), reach[last]);
    Index low = 0, high = last;
    while (high - low > 1) {
        const Index middle = (low + high) / 2;
        (inside < reach[middle] ? high : low) = middle;
    }
    Indentation found = indentation(model.yielding_depth[table][low][cell], inside - reach[low], past);
    /* Beyond the table delta goes on along its slope. */
    found.depth += found.by_reach * (along - inside);
    found.by_turn += found.mixed * (along - inside) - found.by_reach * first.slope;
    const double radial = 1.0 - found.by_reach, across = -found.by_turn * over;
    return {size - model.touch_size(i, 0) - found.depth, radial * c - across * s, radial * s + across * c};
}

}  // namespace gudgeon::turning
