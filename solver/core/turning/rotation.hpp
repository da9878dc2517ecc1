/* Unit quaternions (w, x, y, z) of rotations. */
#pragma once
#include <limits>

#include "vectors.hpp"

namespace gudgeon::turning {

inline constexpr double NOT_A_NUMBER = std::numeric_limits<double>::quiet_NaN();

/* Set the rotation matrix Q of a quaternion, divided by its square; of zero NaN. */
inline void matrix_of(CVec e, Mat Q) noexcept {
    const double w = e[0], x = e[1], y = e[2], z = e[3];
    const double square = w * w + x * x + y * y + z * z;
    const double s = square > 0.0 ? 1.0 / square : NOT_A_NUMBER;
    Q(0, 0) = s * (w * w + x * x - y * y - z * z);
    Q(0, 1) = 2 * s * (x * y - w * z);
    Q(0, 2) = 2 * s * (x * z + w * y);
    Q(1, 0) = 2 * s * (x * y + w * z);
    Q(1, 1) = s * (w * w - x * x + y * y - z * z);
    Q(1, 2) = 2 * s * (y * z - w * x);
    Q(2, 0) = 2 * s * (x * z - w * y);
    Q(2, 1) = 2 * s * (y * z + w * x);
    Q(2, 2) = s * (w * w - x * x - y * y + z * z);
}

/* Set the rate 1/2 omega e of a quaternion; omega along the scene's axes [rad/s]. */
inline void rate_of(CVec e, CVec omega, Vec out) noexcept {
    const double a = 0.5 * omega[0], b = 0.5 * omega[1], c = 0.5 * omega[2];
    out[0] = -a * e[1] - b * e[2] - c * e[3];
    out[1] = a * e[0] + b * e[3] - c * e[2];
    out[2] = b * e[0] + c * e[1] - a * e[3];
    out[3] = c * e[0] + a * e[2] - b * e[1];
}

/* Divide a quaternion by its length; NaN of zero. */
inline void normalise(Vec e) noexcept {
    const double size = std::sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]);
    const double s = size > 0.0 ? 1.0 / size : NOT_A_NUMBER;
    for (Index i = 0; i < 4; ++i) e[i] *= s;
}

/* Turn a quaternion by a rotation vector along the scene's axes [rad]. */
inline void turn_by(Vec e, Vec3 rotation) noexcept {
    const double angle = length(rotation);
    const double s = angle > 1e-4 ? std::sin(0.5 * angle) / angle : 0.5 - angle * angle / 48.0;
    const double w = std::cos(0.5 * angle), x = s * rotation.x, y = s * rotation.y, z = s * rotation.z;
    const double e0 = e[0], e1 = e[1], e2 = e[2], e3 = e[3];
    e[0] = w * e0 - x * e1 - y * e2 - z * e3;
    e[1] = w * e1 + x * e0 + y * e3 - z * e2;
    e[2] = w * e2 + y * e0 + z * e1 - x * e3;
    e[3] = w * e3 + z * e0 + x * e2 - y * e1;
    normalise(e);
}

}  // namespace gudgeon::turning
