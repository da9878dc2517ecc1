/* Vectors of three, force and moment; products with matrices of three. */
#pragma once
#include "../view.hpp"

namespace gudgeon::turning {

struct V3 {
    double x = 0.0, y = 0.0, z = 0.0;
    double operator[](Index i) const noexcept { return i == 0 ? x : i == 1 ? y : z; }
};

/* Force and moment. */
struct Wrench {
    V3 force, moment;
};

inline V3 operator+(V3 a, V3 b) noexcept { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline V3 operator-(V3 a, V3 b) noexcept { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline V3 operator-(V3 a) noexcept { return {-a.x, -a.y, -a.z}; }
inline V3 operator*(double s, V3 a) noexcept { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(V3 a, V3 b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline V3 cross(V3 a, V3 b) noexcept { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline double length_of(V3 a) noexcept { return std::sqrt(dot(a, a)); }

/* The three numbers of a view from `first` on; column j of a matrix of three. */
inline V3 three(CVec v, Index first = 0) noexcept { return {v[first], v[first + 1], v[first + 2]}; }
inline V3 column(CMat Q, Index j) noexcept { return {Q(0, j), Q(1, j), Q(2, j)}; }

/* Set or add to the three numbers of a view from `first` on. */
inline void put(V3 a, Vec v, Index first = 0) noexcept { v[first] = a.x, v[first + 1] = a.y, v[first + 2] = a.z; }
inline void add(V3 a, Vec v, Index first = 0) noexcept { v[first] += a.x, v[first + 1] += a.y, v[first + 2] += a.z; }

/* Q v, and the transpose of Q times v. */
inline V3 rotated(CMat Q, V3 v) noexcept {
    return {Q(0, 0) * v.x + Q(0, 1) * v.y + Q(0, 2) * v.z, Q(1, 0) * v.x + Q(1, 1) * v.y + Q(1, 2) * v.z,
            Q(2, 0) * v.x + Q(2, 1) * v.y + Q(2, 2) * v.z};
}
inline V3 rotated_back(CMat Q, V3 v) noexcept {
    return {Q(0, 0) * v.x + Q(1, 0) * v.y + Q(2, 0) * v.z, Q(0, 1) * v.x + Q(1, 1) * v.y + Q(2, 1) * v.z,
            Q(0, 2) * v.x + Q(1, 2) * v.y + Q(2, 2) * v.z};
}

}  // namespace gudgeon::turning
