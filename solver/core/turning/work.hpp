/* The arrays that the functions of turning bodies write, of a model. */
#pragma once
#include "../fields/co_energy.hpp"
#include "../ports/sections.hpp"
#include "owned.hpp"

namespace gudgeon::turning {

/* Times fewer products that a factor within an envelope takes than a full one, from which on it is the cheaper one: a
 * full one runs through its rows without looking where they begin. */
inline constexpr double GAIN = 4.0;

/* Whether a factor within the envelope of S takes `GAIN` times fewer products. */
inline bool is_thin(CIntMat envelope) noexcept {
    const double m = double(envelope.size());
    double squares = 0.0;
    for (Index i = 0; i < envelope.size(); ++i) squares += double((i - envelope(i, 1)) * (i - envelope(i, 1)));
    return m * m * m / 6 > GAIN * squares / 2;
}

inline Pressing pressing_of(Arrays& a, const Surfaces& surfaces) {
    const Index s = surfaces.owner.size(), p = surfaces.arm.size(), f = surfaces.outward.size();
    Pressing w{};
    w.live = a.make<Ints>(s), w.near = a.make<Ints>(p), w.arm = a.make<Cube>(p, 2, 3), w.gap = a.make<Vec>(p);
    w.slope = a.make<Mat>(p, 3), w.first = a.make<Ints>(p), w.weights = a.make<Cube>(p, 3, 16);
    w.direction = a.make<Mat>(p, 3), w.inward = a.make<Mat>(p, 3), w.moved = a.make<Mat>(p, 3);
    w.mixed = a.make<Mat>(surfaces.mixed.size() ? p : 0, f), w.force = a.make<Vec>(p), w.active = a.make<Ints>(p);
    w.pushed = a.make<Mat>(p, f), w.matrix = a.make<Mat>(p, p), w.dents = a.make<Vec>(f);
    w.loaded = a.make<Vec>(f), w.stored = a.make<Vec>(1);
    for (Index i = 0; i < p; ++i)
        for (Index k = 0; k < 3; ++k) w.inward(i, k) = -surfaces.normal(i, k);
    return w;
}

/* Numbers of a state. */
inline Index size_of(const Model& model) noexcept {
    Index coordinates = 0;
    for (Index b = 0; b < model.mass.size(); ++b) coordinates += model.elastic(b, 0);
    return WIDTH * model.mass.size() + 2 * coordinates + PUSHES * model.touch_pair.size() + SUMS;
}

/* Zeros of the shapes that a model with a number of drives has. */
inline Work work_of(Arrays& a, const Model& model, Index drives) {
    const Index n = model.mass.size(), m = model.row_terms.size(), t = model.terms.size(), size = size_of(model);
    const Index p = model.point_rows.shape[0], e = model.point_rows.shape[2], c = model.touch_pair.size();
    const Index u = model.bush_rest.size(), fields = model.fields.head.size();
    Index coefficients = 32; /* Those that a pose takes part in, at most. */
    for (Index i = 0; i < fields; ++i) coefficients = larger(coefficients, Index(1) << 2 * model.fields.head(i, 1));
    Work w{};
    w.turn = a.make<Cube>(n, 3, 3), w.omega = a.make<Mat>(n, 3), w.back = a.make<Cube>(n, 3, 3);
    w.rate = a.make<Mat>(n, 6 + e), w.push = a.make<Mat>(n, 6 + e), w.given = a.make<Mat>(drives, 3);
    w.place = a.make<Mat>(p, 3), w.arm = a.make<Mat>(p, 3), w.speed = a.make<Mat>(p, 3), w.drift = a.make<Mat>(p, 3);
    w.spin = a.make<Mat>(p, 3), w.spin_drift = a.make<Mat>(p, 3), w.axes = a.make<Cube>(p, 3, 3);
    w.point_rows = a.make<Cube>(p, 6, e), w.local = a.make<Cube>(p, 3, 6);
    w.curved = a.make<Vec>(e), w.moving = a.make<Vec>(e), w.moment = a.make<Cube>(n, CURL + 3, e);
    w.moment_rate = a.make<Cube>(n, 3, e), w.second = a.make<Mat>(n, CURL), w.coupling = a.make<Cube>(n, 3, e);
    w.root = a.make<Cube>(n, 3, 3), w.modal = a.make<Mat>(n, 3 + e), w.inner_force = a.make<Mat>(n, e);
    w.across = a.make<Mat>(n, e), w.light_error = a.make<Vec>(3 + e);
    w.value = a.make<Vec>(t), w.bend = a.make<Vec>(t), w.slope = a.make<Cube>(t, 2, 6), w.turned = a.make<Vec>(t);
    w.block_owner = a.make<IntMat>(m, 4), w.block = a.make<Cube>(m, 4, 6 + e), w.light = a.make<Cube>(m, 4, 6 + e);
    w.matrix = a.make<Mat>(m, m), w.lower = a.make<Mat>(m, m), w.small = a.make<Mat>(m, m);
    w.scale = a.make<Vec>(m), w.order = a.make<Ints>(m), w.begin = a.make<Ints>(m), w.end = a.make<Ints>(m);
    w.left = a.make<Vec>(m), w.right = a.make<Vec>(m), w.multiplier = a.make<Vec>(m), w.spare = a.make<Mat>(2, m);
    w.within = a.make<Ints>(1), w.rank = a.make<Ints>(1), w.least = a.make<Vec>(1);
    w.slopes = a.make<Mat>(STAGES, size), w.stage = a.make<Vec>(size), w.lost = a.make<Vec>(SUMS);
    w.bush = a.make<Mat>(u, 12), w.bush_push = a.make<Mat>(u, 6);
    w.field = a.make<Mat>(fields, co_energy::OUT), w.field_basis = a.make<Mat>(9, coefficients);
    w.touching = a.make<Ints>(c), w.slipping = a.make<Ints>(c), w.deflection = a.make<Mat>(c, 2);
    w.approach = a.make<Vec>(c), w.shift = a.make<Vec>(c), w.touch = a.make<Mat>(c, Touch::COLUMNS);
    w.pressing = pressing_of(a, model.surfaces);
    w.within[0] = is_thin(model.envelope);
    return w;
}

}  // namespace gudgeon::turning
