/* Integrals of 1/R over pairs of panels: analytic over the source, by a rule on the target.
 *
 * The potential of a flat facet of unit density is the integral of 1/R dS = sum over edges e of
 * t_e ln((R1 + R2 + l)/(R1 + R2 - l)), less |z| Omega, with the distance t_e of the point's foot from edge e of length
 * l, R1 and R2 those from its ends, height z and solid angle Omega (Wilton, Rao, Glisson, Schaubert, Al-Bundak, Butler,
 * IEEE Trans. Antennas Propag. 32, 1984; Omega by Van Oosterom, Strackee, IEEE Trans. Biomed. Eng. 30, 1983). It is
 * exact at any distance, so thin gaps need no rule of their own. Over the target panel, the smaller of the two, near
 * pairs use a rule of seven points that divides facets until it agrees with itself; far pairs use the second moments of
 * both panels.
 */
#include <nanobind/stl/optional.h>

#include "../../../solver/core/python/read.hpp"

using namespace gudgeon;

namespace {

/* Distance of centres over the sum of the radii from which two panels interact by their moments. */
constexpr double FAR = 3.0;
/* The same ratio from which a facet's rule of seven points is not divided. */
constexpr double MIDDLE = 1.2;
/* Difference of the rule on a facet and on its four parts, relative to the pair's integral, at which it is accepted. */
constexpr double AGREEMENT = 1e-5;
/* Most divisions of a facet. */
constexpr int DEEPEST = 6;
/* Two area coordinates of a triangle, and a weight; seven points are exact to degree five, the weights' sum is 1. */
struct RulePoint {
    double a, b, weight;
};
constexpr double ROOT = 3.872983346207417; /* of 15 */
constexpr double INNER = (6 - ROOT) / 21, OUTER = (6 + ROOT) / 21;
constexpr double LIGHT = (155 - ROOT) / 1200, HEAVY = (155 + ROOT) / 1200;
constexpr RulePoint RULE[7] = {{1.0 / 3, 1.0 / 3, 9.0 / 40},
                               {INNER, INNER, LIGHT},
                               {1 - 2 * INNER, INNER, LIGHT},
                               {INNER, 1 - 2 * INNER, LIGHT},
                               {OUTER, OUTER, HEAVY},
                               {1 - 2 * OUTER, OUTER, HEAVY},
                               {OUTER, 1 - 2 * OUTER, HEAVY}};

/* Panels as the Python tuple has them. */
struct Group {
    GUDGEON_SHAPES("facets * 9, first p+1, areas p, centres p 3, moments p 6, radii p")
    CMat facets;  /* corners of the flat facets [m], (facets, 9) */
    CInts first;  /* first facet of each panel and the end, (panels + 1,) */
    CVec areas;   /* [m^2], (panels,) */
    CMat centres; /* [m], (panels, 3) */
    CMat moments; /* mean squares about the centre, xx, yy, zz, xy, xz, yz [m^2], (panels, 6) */
    CVec radii;   /* largest distance of a corner from the centre [m], (panels,) */
    GUDGEON_FIELDS(facets, first, areas, centres, moments, radii)
};

struct Point {
    double x, y, z;
};

inline Point operator-(Point a, Point b) noexcept { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline double dot(Point a, Point b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline double length_of(Point a) noexcept { return std::sqrt(dot(a, a)); }
inline Point cross(Point a, Point b) noexcept {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

struct Triangle {
    Point a, b, c;
};

inline Triangle triangle_of(CVec corners) noexcept {
    return {{corners[0], corners[1], corners[2]},
            {corners[3], corners[4], corners[5]},
            {corners[6], corners[7], corners[8]}};
}

/* t ln((R1 + R2 + l)/(R1 + R2 - l)) of the edge from a to b; 0 for a point on it. */
inline double edge_term(Point a, Point b, Point normal, double ra, double rb) noexcept {
    const Point edge = b - a;
    const double length = length_of(edge), rest = ra + rb - length;
    if (rest <= 1e-15 * length) return 0.0;
    return dot(a, cross(edge, normal)) / length * std::log((ra + rb + length) / rest);
}

/* The integral of 1/R dS [m] of a flat facet at a point. */
inline double facet_potential(Point point, const Triangle& facet) noexcept {
    const Point a = facet.a - point, b = facet.b - point, c = facet.c - point;
    const Point area = cross(b - a, c - a);
    const double size = length_of(area);
    const Point normal = {area.x / size, area.y / size, area.z / size};
    const double ra = length_of(a), rb = length_of(b), rc = length_of(c);
    const double total =
        edge_term(a, b, normal, ra, rb) + edge_term(b, c, normal, rb, rc) + edge_term(c, a, normal, rc, ra);
    const double height = std::abs(dot(a, normal));
    const double across = ra * rb * rc + dot(a, b) * rc + dot(b, c) * ra + dot(c, a) * rb;
    return total - height * 2.0 * std::atan2(height * size, across);
}

/* The integral of 1/R dS [m] of panel j at a point. */
inline double panel_potential(Point point, const Group& source, Index j) noexcept {
    double total = 0.0;
    for (Index f = source.first[j]; f < source.first[j + 1]; ++f) {
        total += facet_potential(point, triangle_of(source.facets[f]));
    }
    return total;
}

/* The seven-point rule of a panel's potential on a triangle, times its area. */
inline double rule(const Triangle& t, const Group& source, Index j) noexcept {
    const Point u = t.b - t.a, v = t.c - t.a;
    double total = 0.0;
    for (const auto& [a, b, weight] : RULE) {
        const Point point = {t.a.x + a * u.x + b * v.x, t.a.y + a * u.y + b * v.y, t.a.z + a * u.z + b * v.z};
        total += weight * panel_potential(point, source, j);
    }
    return 0.5 * length_of(cross(u, v)) * total;
}

inline Point middle_of(Point a, Point b) noexcept {
    return {0.5 * (a.x + b.x), 0.5 * (a.y + b.y), 0.5 * (a.z + b.z)};
}

/* A triangle of the stack of `divided`: the rule's integral over it, and how often the facet was divided for it. */
struct Part {
    Triangle triangle;
    double integral;
    int depth;
};

/* The integral over a facet by a rule that divides it where the rule and its parts disagree.
 *
 * `limit`: difference that is allowed on the facet [m^3]; half of it at each division, since the parts along a source's
 * side, where rules are poor, double in number.
 */
inline double divided(const Triangle& facet, const Group& source, Index j, double limit) noexcept {
    Part stack[4 * (DEEPEST + 2)];
    stack[0] = {facet, rule(facet, source, j), 0};
    int top = 1;
    double total = 0.0;
    while (top > 0) {
        --top;
        const auto [t, coarse, depth] = stack[top];
        const Point d = middle_of(t.a, t.b), e = middle_of(t.b, t.c), f = middle_of(t.c, t.a);
        const Triangle parts[4] = {{t.a, d, f}, {d, t.b, e}, {f, e, t.c}, {e, f, d}};
        double fine = 0.0;
        for (int k = 0; k < 4; ++k) {
            stack[top + k] = {parts[k], rule(parts[k], source, j), depth + 1};
            fine += stack[top + k].integral;
        }
        if (std::abs(fine - coarse) <= std::ldexp(limit, -depth) || depth + 1 >= DEEPEST) {
            total += fine;
        } else {
            top += 4;
        }
    }
    return total;
}

/* The pair's integral from areas and second moments: 1/r and half their sum with its second gradient. */
inline double far_pair(const Group& target, Index i, const Group& source, Index j, Point away) noexcept {
    const double r2 = dot(away, away), r = std::sqrt(r2);
    const CVec m = target.moments[i], n = source.moments[j];
    const double trace = m[0] + n[0] + m[1] + n[1] + m[2] + n[2];
    double along = (m[0] + n[0]) * away.x * away.x + (m[1] + n[1]) * away.y * away.y + (m[2] + n[2]) * away.z * away.z;
    const double xy = m[3] + n[3], xz = m[4] + n[4], yz = m[5] + n[5];
    along += 2.0 * (xy * away.x * away.y + xz * away.x * away.z + yz * away.y * away.z);
    return target.areas[i] * source.areas[j] / r * (1.0 + 0.5 * (3.0 * along / r2 - trace) / r2);
}

/* As `pair`, by a rule on panel i of the target. */
inline double ordered_pair(const Group& target, Index i, const Group& source, Index j) noexcept {
    const CVec here = target.centres[i], there = source.centres[j];
    const Point away = {here[0] - there[0], here[1] - there[1], here[2] - there[2]};
    const double reach = target.radii[i] + source.radii[j], distance2 = dot(away, away);
    if (distance2 >= FAR * FAR * reach * reach) return far_pair(target, i, source, j, away);
    const bool near = distance2 < MIDDLE * MIDDLE * reach * reach;
    const double limit = AGREEMENT * target.areas[i] * source.areas[j] / reach;
    double total = 0.0;
    for (Index f = target.first[i]; f < target.first[i + 1]; ++f) {
        const Triangle facet = triangle_of(target.facets[f]);
        total += near ? divided(facet, source, j, limit) : rule(facet, source, j);
    }
    return total;
}

/* The integral of 1/R dS dS [m^3] of two panels. */
inline double pair(const Group& target, Index i, const Group& source, Index j) noexcept {
    if (source.areas[j] < target.areas[i]) return ordered_pair(source, j, target, i);
    return ordered_pair(target, i, source, j);
}

/* Six times the signed volume of a tetrahedron [m^3]. */
inline double volume(Point a, Point b, Point c, Point d) noexcept { return dot(cross(b - a, c - a), d - a); }

/* Whether a side of a triangle meets a facet, by the signs of five volumes. */
inline bool pierces(const Triangle& sides, const Triangle& facet) noexcept {
    const auto& [a, b, c] = facet;
    const Point ends[4] = {sides.a, sides.b, sides.c, sides.a};
    for (int k = 0; k < 3; ++k) {
        const Point p = ends[k], q = ends[k + 1];
        if (volume(a, b, c, p) * volume(a, b, c, q) > 0.0) continue;
        const double ab = volume(p, q, a, b), bc = volume(p, q, b, c), ca = volume(p, q, c, a);
        const bool same_sign = (ab >= 0.0 && bc >= 0.0 && ca >= 0.0) || (ab <= 0.0 && bc <= 0.0 && ca <= 0.0);
        if (same_sign && (ab != 0.0 || bc != 0.0 || ca != 0.0)) return true;
    }
    return false;
}

/* Whether a facet of panel i and one of panel j cross. */
inline bool panels_cross(const Group& first, Index i, const Group& second, Index j) noexcept {
    for (Index f = first.first[i]; f < first.first[i + 1]; ++f) {
        for (Index g = second.first[j]; g < second.first[j + 1]; ++g) {
            const Triangle a = triangle_of(first.facets[f]), b = triangle_of(second.facets[g]);
            if (pierces(a, b) || pierces(b, a)) return true;
        }
    }
    return false;
}

void fill_symmetric_panels(nb::handle target, nb::handle source, double factor, Index start, Index end,
                           nb::handle out) {
    const auto targets = read<Group>(target, "target"), sources = read<Group>(source, "source");
    const auto matrix = read<Mat>(out, "matrix");
    const nb::gil_scoped_release released;
    for (Index i = start; i < end; ++i) {
        for (Index j = 0; j <= i; ++j) {
            const double value = factor * pair(targets, i, sources, j);
            matrix(i, j) += value;
            if (j < i) matrix(j, i) += value;
        }
    }
}

void fill_panels(nb::handle target, nb::handle source, double factor, nb::handle out) {
    const auto targets = read<Group>(target, "target"), sources = read<Group>(source, "source");
    const auto matrix = read<Mat>(out, "matrix");
    const nb::gil_scoped_release released;
    for (Index i = 0; i < targets.areas.size(); ++i) {
        for (Index j = 0; j < sources.areas.size(); ++j) matrix(i, j) += factor * pair(targets, i, sources, j);
    }
}

std::optional<nb::tuple> crossing_panels(nb::handle first, nb::handle second) {
    const auto firsts = read<Group>(first, "first"), seconds = read<Group>(second, "second");
    for (Index i = 0; i < firsts.areas.size(); ++i) {
        for (Index j = 0; j < seconds.areas.size(); ++j) {
            const CVec a = firsts.centres[i], b = seconds.centres[j];
            const Point away = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
            const double reach = firsts.radii[i] + seconds.radii[j];
            if (dot(away, away) > reach * reach) continue;
            if (panels_cross(firsts, i, seconds, j)) return nb::make_tuple(i, j);
        }
    }
    return std::nullopt;
}

}  // namespace

void bind_panels(nb::module_& module) {
    nb::module_ m = module.def_submodule("panels", "Integrals of 1/R over pairs of panels.");
    m.def("fill_symmetric", &fill_symmetric_panels, nb::arg("target"), nb::arg("source"), nb::arg("factor"),
          nb::arg("start"), nb::arg("end"), nb::arg("matrix"),
          "Add a factor times the integrals of a group and itself, or its image, to rows of a symmetric matrix.");
    m.def("fill", &fill_panels, nb::arg("target"), nb::arg("source"), nb::arg("factor"), nb::arg("matrix"),
          "Add a factor times the integrals of two groups to a matrix [m^3], (target's panels, source's panels).");
    m.def("crossing", &crossing_panels, nb::arg("first"), nb::arg("second"),
          "Numbers of two panels of which a side of one goes through the other; None where there are none.");
}
