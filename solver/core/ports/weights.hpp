/* Weights of points along the cubic splines of a traction space over which they slide. */
#pragma once
#include "../view.hpp"

namespace gudgeon {

constexpr double SHORT_SLIDE = 1e-7;  /* Distance slid in a step over the spacing below which the change of weights is
                                       * round-off: their slopes tell it. */

/* Where points stand on a traction space. */
struct Places {
    CVec height;   /* Coordinate along of each point at sigma = 0 [m], (c,). */
    double sigma;  /* Distance slid [m]. */
    CInts start;   /* First function across that each touches in the first line along, -1 beside the space, (c,). */
};

/* The lines of functions of a traction space. */
struct Chart {
    double start, spacing;  /* Along [m]. */
    double highest;         /* Number of the last line that is the first of four. */
    Index width;            /* Functions across. */
};

/* Set the first function that each point touches, -1 beside the space, (c,), and the four weights along, (c,) each. */
inline void weigh(const Places& places, const Chart& chart, Ints corner, Vec p, Vec q, Vec r, Vec s) noexcept {
    const auto [height, sigma, start] = places;
    const double shift = sigma - chart.start, scale = 1 / chart.spacing, highest = chart.highest;
    for (Index i = 0; i < height.size(); ++i) {
        const double where = (height[i] + shift) * scale;
        const double line = lesser(larger(std::floor(where), 0.0), highest);
        const bool inside = start[i] >= 0 && where >= -1e-9 && where <= highest + 1 + 1e-9;
        const double t = where - line, u = 1 - t;
        corner[i] = inside ? start[i] + Index(line) * chart.width : -1;
        p[i] = u * u * u / 6;
        q[i] = (3 * t * t * t - 6 * t * t + 4) / 6;
        r[i] = (3 * u * u * u - 6 * u * u + 4) / 6;
        s[i] = t * t * t / 6;
    }
}

/* How the weight b of four changes along, times the spacing, where the last one is given. */
inline double slope(double last, Index b) noexcept {
    const double t = std::cbrt(6.0 * larger(last, 0.0)), u = 1.0 - t;
    switch (b) {
        case 0: return -0.5 * u * u;
        case 1: return 0.5 * t * (3.0 * t - 4.0);
        case 2: return 0.5 * u * (4.0 - 3.0 * u);
        default: return 0.5 * t * t;
    }
}

}  // namespace gudgeon
