/* Forces of points that press by flexibilities, which close their gaps.
 *
 * C lambda = -gap of the points that press, C_ij = n_i R_ij n_j + N_i R N_j and what points and functions of one body
 * couple; equations stand in `turning/touching_arrays.hpp`.
 */
#pragma once
#include "../turning/arrays.hpp"

namespace gudgeon::turning {

/* The sum of values over the functions that a point touches, weighted with N (kind 0) or one of its slopes (1, 2).
 *
 * width: functions along; zero before the ground, which has none.  values: a view or a function of the number. */
template <class Values>
    requires(!requires(const Values& values) { values.data; })
inline double over(const Work& work, Index p, Index kind, Index width, const Values& values) noexcept {
    if (width == 0) return 0.0;
    const Index first = work.pressing.first[p];
    const Vec weights = work.pressing.weights[p][kind];
    double total = 0.0;
    for (Index k = 0; k < 4; ++k)
        for (Index l = 0; l < 4; ++l) total += weights[4 * k + l] * values(first + k * width + l);
    return total;
}

inline double over(const Work& work, Index p, Index kind, Index width, CVec values) noexcept {
    return over(work, p, kind, width, [&](Index i) { return values[i]; });
}

/* How R moves point p along its direction by a unit force on point q of its body [m/N]. */
inline double between(const Model& model, const Work& work, Index p, Index q) noexcept {
    const CMat R = model.surfaces.residual[p][q];
    const Vec m = work.pressing.inward[p], n = work.pressing.inward[q];
    double total = 0.0;
    for (Index i = 0; i < 3; ++i) total += m[i] * (R(i, 0) * n[0] + R(i, 1) * n[1] + R(i, 2) * n[2]);
    return total;
}

/* Whether a body has both points and functions. */
inline bool couples(const Model& model) noexcept { return model.surfaces.mixed.size() > 0; }

/* Set the inward displacement of a point by inward forces on functions of its body. */
inline void set_mixed(const Model& model, const Work& work, Index p) noexcept {
    if (!couples(model)) return;
    const CMat by = model.surfaces.mixed[p];
    const Vec m = work.pressing.inward[p], mixed = work.pressing.mixed[p];
    for (Index b = 0; b < by.shape[1]; ++b) mixed[b] = -(m[0] * by(0, b) + m[1] * by(1, b) + m[2] * by(2, b));
}

/* Set the inward displacement of the functions of the surfaces that may be met by a unit force of a point of pair s. */
inline void push_functions(const Model& model, const Work& work, Index s, Index p) noexcept {
    const Surfaces& f = model.surfaces;
    const Pressing& found = work.pressing;
    for (Index other = 0; other < f.owner.size(); ++other) {
        if (!found.live[other]) continue;
        const bool same = f.owner(other, 1) == f.owner(s, 1);
        for (Index b = f.functions(other, 0); b < f.functions(other, 1); ++b) {
            found.pushed(p, b) = same ? over(work, p, 0, f.counts(s, 1), f.compliance[b]) : 0.0;
            if (couples(model)) found.pushed(p, b) += found.mixed(p, b);
        }
    }
}

/* Call `visit(s, p, a)` for every point that presses: its pair, its number, and its place in `active`. */
template <class Visit>
inline void for_active(const Model& model, const Work& work, Index count, Visit&& visit) noexcept {
    const CIntMat points = model.surfaces.points;
    const Ints active = work.pressing.active;
    Index a = 0;
    for (Index s = 0; s < points.size() && a < count; ++s)
        for (; a < count && points(s, 0) <= active[a] && active[a] < points(s, 1); ++a) visit(s, active[a], a);
}

/* Add to the compliance how points move by what presses on functions of their own body. */
inline void couple_functions(const Model& model, const Work& work, Index count) noexcept {
    const Pressing& found = work.pressing;
    for_active(model, work, count, [&](Index s, Index p, Index b) {
        for (Index a = b; a < count; ++a)
            found.matrix(a, b) += over(work, p, 0, model.surfaces.counts(s, 1), found.mixed[found.active[a]]);
    });
}

/* Factor the compliance of the points that press, and set their forces and the energy that they hold. */
inline void solve_forces(const Work& work, Index count) noexcept {
    const Pressing& found = work.pressing;
    const Mat A = found.matrix;
    const Ints active = found.active;
    const Vec force = found.force;
    for (Index a = 0; a < count; ++a)
        for (Index b = 0; b <= a; ++b) {
            const double total = A(a, b) - dot(A[a].slice(0, b), A[b].slice(0, b));
            if (a > b)
                A(a, b) = total / A(b, b);
            else
                A(a, b) = total > 0.0 ? std::sqrt(total) : std::numeric_limits<double>::quiet_NaN();
        }
    for (Index a = 0; a < count; ++a) {
        double total = -found.gap[active[a]];
        for (Index k = 0; k < a; ++k) total -= A(a, k) * force[active[k]];
        force[active[a]] = total / A(a, a);
    }
    for (Index a = count - 1; a >= 0; --a) {
        double total = force[active[a]];
        for (Index k = a + 1; k < count; ++k) total -= A(k, a) * force[active[k]];
        force[active[a]] = total / A(a, a);
        found.stored[0] -= 0.5 * force[active[a]] * found.gap[active[a]];
    }
}

/* Set the forces of points that press by flexibilities, which close their gaps; return how many there are.
 *
 * first: section of the first point. */
inline Index set_forces(const Model& model, const Work& work, Index first) noexcept {
    const Surfaces& f = model.surfaces;
    const Pressing& found = work.pressing;
    Index count = 0;
    found.stored[0] = 0.0;
    for (Index s = 0; s < f.owner.size(); ++s) {
        if (!found.live[s] || f.by_law[s]) continue;
        for (Index p = f.points(s, 0); p < f.points(s, 1); ++p) {
            if (!found.near[p]) continue;
            set_mixed(model, work, p);
            if (!work.touching[first + p]) continue;
            found.active[count++] = p;
            push_functions(model, work, s, p);
        }
    }
    for_active(model, work, count, [&](Index s, Index p, Index a) {
        for (Index b = 0; b <= a; ++b) {
            const Index q = found.active[b];
            found.matrix(a, b) = between(model, work, p, q) + over(work, p, 0, f.counts(s, 1), found.pushed[q]);
        }
        found.matrix(a, a) += f.layer[p];
    });
    if (couples(model)) couple_functions(model, work, count);
    solve_forces(work, count);
    return count;
}

/* Set the forces on functions [N]. */
inline void load_functions(const Model& model, const Work& work, Index count) noexcept {
    const Surfaces& f = model.surfaces;
    const Pressing& found = work.pressing;
    fill(found.loaded, 0.0);
    for_active(model, work, count, [&](Index s, Index p, Index) {
        if (f.owner(s, 1) == NONE) return;
        for (Index k = 0; k < 4; ++k)
            for (Index l = 0; l < 4; ++l) {
                const Index function = found.first[p] + k * f.counts(s, 1) + l;
                found.loaded[function] += found.force[p] * found.weights(p, 0, 4 * k + l);
            }
    });
}

/* Set how R moves a point by all forces on its body. */
inline void move_point(const Model& model, const Work& work, Index p, Index count) noexcept {
    const Surfaces& f = model.surfaces;
    const Pressing& found = work.pressing;
    for (Index i = 0; i < 3; ++i) {
        double total = 0.0;
        for (Index a = 0; a < count; ++a) {
            const Index q = found.active[a];
            const CVec R = f.residual[p][q][i];
            const Vec n = found.inward[q];
            total += (R[0] * n[0] + R[1] * n[1] + R[2] * n[2]) * found.force[q];
        }
        if (couples(model)) total -= dot(f.mixed[p][i], found.loaded);
        found.moved(p, i) = total;
    }
}

/* Set how forces move functions, and points before the ground. */
inline void set_dents(const Model& model, const Work& work, Index count) noexcept {
    const Surfaces& f = model.surfaces;
    const Pressing& found = work.pressing;
    if (couples(model)) load_functions(model, work, count);
    for (Index s = 0; s < f.owner.size(); ++s) {
        if (!found.live[s]) continue;
        for (Index b = f.functions(s, 0); b < f.functions(s, 1); ++b) {
            double total = 0.0;
            for (Index a = 0; a < count; ++a) total += found.force[found.active[a]] * found.pushed(found.active[a], b);
            found.dents[b] = total;
        }
        if (f.owner(s, 1) != NONE) continue;
        for (Index p = f.points(s, 0); p < f.points(s, 1); ++p)
            if (found.force[p] != 0.0) move_point(model, work, p, count);
    }
}

/* How forces open the gap of a point that does not press [m]. */
inline double forced_out(const Model& model, const Work& work, Index s, Index p, Index count) noexcept {
    const Pressing& found = work.pressing;
    double total = over(work, p, 0, model.surfaces.counts(s, 1), found.dents);
    for (Index k = 0; k < count; ++k)
        total += between(model, work, p, found.active[k]) * found.force[found.active[k]];
    if (couples(model)) total += dot(found.mixed[p], found.loaded);
    return total;
}

}  // namespace gudgeon::turning
