"""Unit quaternions (w, x, y, z) of rotations, in compiled functions and over many states."""

import numpy as np

from gudgeon.solver.compiled import inner


@inner
def matrix_of(e, Q):  # type: ignore[no-untyped-def]
    """Set the rotation matrix Q of a quaternion, divided by its square; of zero NaN."""
    w, x, y, z = e[0], e[1], e[2], e[3]
    square = w * w + x * x + y * y + z * z
    s = 1.0 / square if square > 0.0 else np.nan
    Q[0, 0] = s * (w * w + x * x - y * y - z * z)
    Q[0, 1] = 2 * s * (x * y - w * z)
    Q[0, 2] = 2 * s * (x * z + w * y)
    Q[1, 0] = 2 * s * (x * y + w * z)
    Q[1, 1] = s * (w * w - x * x + y * y - z * z)
    Q[1, 2] = 2 * s * (y * z - w * x)
    Q[2, 0] = 2 * s * (x * z - w * y)
    Q[2, 1] = 2 * s * (y * z + w * x)
    Q[2, 2] = s * (w * w - x * x - y * y + z * z)


@inner
def rate_of(e, omega, out):  # type: ignore[no-untyped-def]
    """Set the rate ½ ω e of a quaternion; ω along the scene's axes [rad/s]."""
    a, b, c = 0.5 * omega[0], 0.5 * omega[1], 0.5 * omega[2]
    out[0] = -a * e[1] - b * e[2] - c * e[3]
    out[1] = a * e[0] + b * e[3] - c * e[2]
    out[2] = b * e[0] + c * e[1] - a * e[3]
    out[3] = c * e[0] + a * e[2] - b * e[1]


@inner
def normalise(e):  # type: ignore[no-untyped-def]
    """Divide a quaternion by its length; NaN of zero."""
    size = np.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3])
    s = 1.0 / size if size > 0.0 else np.nan
    for i in range(4):
        e[i] *= s


@inner
def turn_by(e, a, b, c):  # type: ignore[no-untyped-def]
    """Turn a quaternion by a rotation vector along the scene's axes [rad]."""
    angle = np.sqrt(a * a + b * b + c * c)
    s = 0.5 - angle * angle / 48.0
    if angle > 1e-4:
        s = np.sin(0.5 * angle) / angle
    w, x, y, z = np.cos(0.5 * angle), s * a, s * b, s * c
    e0, e1, e2, e3 = e[0], e[1], e[2], e[3]
    e[0] = w * e0 - x * e1 - y * e2 - z * e3
    e[1] = w * e1 + x * e0 + y * e3 - z * e2
    e[2] = w * e2 + y * e0 + z * e1 - x * e3
    e[3] = w * e3 + z * e0 + x * e2 - y * e1
    normalise(e)


def matrices(e: np.ndarray) -> np.ndarray:
    """Return the rotation matrices of unit quaternions (..., 4), (..., 3, 3)."""
    w, x, y, z = np.moveaxis(e, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def rotation_vectors(e: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Return the rotation vectors of unit quaternions (..., 4) that are nearest to earlier ones [rad], (..., 3).

    Angles continue beyond π: a rotation vector and the ones longer or shorter by full turns mean the same rotation.
    """
    w, v = e[..., :1], e[..., 1:]
    length = np.sqrt((v * v).sum(axis=-1, keepdims=True))
    size = np.sqrt((before * before).sum(axis=-1, keepdims=True))
    angle, turned = 2 * np.arctan2(length, w), length > 1e-12
    axis = np.where(turned, v / np.where(turned, length, 1.0), before / np.where(size > 0, size, 1.0))
    turns = np.round(((axis * before).sum(axis=-1, keepdims=True) - angle) / (2 * np.pi))
    return np.where(turned | (size > 0), (angle + 2 * np.pi * turns) * axis, 2 * v)
