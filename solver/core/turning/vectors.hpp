/* Vectors of three, and their products with rows and columns of views. */
#pragma once
#include <cmath>

#include "../view.hpp"

namespace gudgeon::turning {

struct Vec3 {
    double x = 0.0, y = 0.0, z = 0.0;
    double operator[](Index i) const noexcept { return i == 0 ? x : i == 1 ? y : z; }
};

inline Vec3 operator+(Vec3 a, Vec3 b) noexcept { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(Vec3 a, Vec3 b) noexcept { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator-(Vec3 a) noexcept { return {-a.x, -a.y, -a.z}; }
inline Vec3 operator*(double s, Vec3 a) noexcept { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(Vec3 a, Vec3 b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline double length(Vec3 a) noexcept { return std::sqrt(dot(a, a)); }
inline Vec3 cross(Vec3 a, Vec3 b) noexcept {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/* Three numbers of a vector, from a place on; and these set. */
inline Vec3 three(CVec v, Index first = 0) noexcept { return {v[first], v[first + 1], v[first + 2]}; }
inline void put(Vec v, Vec3 a, Index first = 0) noexcept { v[first] = a.x, v[first + 1] = a.y, v[first + 2] = a.z; }

/* Three numbers of a column of a matrix, from a row on; and these set. */
inline Vec3 column(CMat m, Index j, Index first = 0) noexcept {
    return {m(first, j), m(first + 1, j), m(first + 2, j)};
}
inline void put_column(Mat m, Index j, Vec3 a, Index first = 0) noexcept {
    m(first, j) = a.x, m(first + 1, j) = a.y, m(first + 2, j) = a.z;
}

/* Q v and Q^T v, of a matrix and a vector of three. */
inline Vec3 rotated(CMat Q, Vec3 v) noexcept {
    return {Q(0, 0) * v.x + Q(0, 1) * v.y + Q(0, 2) * v.z, Q(1, 0) * v.x + Q(1, 1) * v.y + Q(1, 2) * v.z,
            Q(2, 0) * v.x + Q(2, 1) * v.y + Q(2, 2) * v.z};
}
inline Vec3 rotated_back(CMat Q, Vec3 v) noexcept {
    return {Q(0, 0) * v.x + Q(1, 0) * v.y + Q(2, 0) * v.z, Q(0, 1) * v.x + Q(1, 1) * v.y + Q(2, 1) * v.z,
            Q(0, 2) * v.x + Q(1, 2) * v.y + Q(2, 2) * v.z};
}

/* a . b, and y += p x, of `width` numbers of a body: six of one that does not deform. */
inline double row_product(CVec a, CVec b, Index width) noexcept {
    if (width == 6) return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + (a[3] * b[3] + a[4] * b[4] + a[5] * b[5]);
    return dot(a.slice(0, width), b.slice(0, width));
}
inline void add_row(double p, CVec x, Vec y, Index width) noexcept {
    if (width == 6)
        for (Index i = 0; i < 6; ++i) y[i] += p * x[i];
    else
        add(p, x.slice(0, width), y.slice(0, width));
}

/* The larger of two numbers, NaN if either is: `larger` may lose it. */
inline double larger_or_nan(double a, double b) noexcept { return b > a || std::isnan(b) ? b : a; }

}  // namespace gudgeon::turning
