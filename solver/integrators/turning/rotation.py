"""Unit quaternions (w, x, y, z) of rotations, over many states."""

import numpy as np


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
