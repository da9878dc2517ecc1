"""Tangents of contact points, across their outward normals. Part of the record format.

On a cylinder the first tangent is the axis, so that the frames turn with the part. On other surfaces one frame at the
mean normal is carried to each point by the smallest rotation between the two normals, which is smooth over any surface
but at points that face against the mean. The first tangent at the mean normal is the coordinate axis least aligned with
it, made perpendicular.
"""

import numpy as np

ROUNDED = 6
"""Decimals of a normal by which the least aligned axis is chosen, so that round-off does not choose it."""
CLOSED = 0.1
"""Length of the mean of unit normals below which a surface has no side: the z axis takes its place."""
AGAINST = 1e-6
"""1 + cosine between a normal and the mean below which the smallest rotation between them is not determined."""


def tangents(normals: np.ndarray, axis: np.ndarray | None = None) -> np.ndarray:
    """Return two unit tangents t1, t2 at each point, (c, 2, 3); normal, t1, t2 are right-handed.

    Args:
        normals: Outward unit normals, (c, 3).
        axis: Of the cylinder on which the points lie, (3,).
    """
    if axis is not None and len(normals):
        along = _across(np.broadcast_to(axis, normals.shape), normals)
        if np.linalg.norm(along, axis=1).min() > AGAINST:
            return _completed(along, normals)
    mean = normals.mean(axis=0) if len(normals) else np.zeros(3)
    size = float(np.linalg.norm(mean))
    mean = mean / size if size > CLOSED else np.array([0.0, 0.0, 1.0])
    seed = np.eye(3)[int(np.abs(mean).round(ROUNDED).argmin())]
    t1 = _across(seed[None], mean[None])[0]
    t1 /= np.linalg.norm(t1)
    facing = 1 + normals @ mean
    turned = t1 - ((normals @ t1) / np.maximum(facing, AGAINST))[:, None] * (mean + normals)
    return _completed(np.where(facing[:, None] > AGAINST, turned, t1), normals)


def _completed(along: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return unit tangents nearest to vectors (c, 3), and those across them, (c, 2, 3)."""
    t1 = _across(along, normals)
    t1 /= np.linalg.norm(t1, axis=1, keepdims=True)
    return np.stack([t1, np.cross(normals, t1)], axis=1)


def _across(vectors: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the part of vectors (c, 3) across unit normals (c, 3), (c, 3)."""
    return vectors - np.einsum("ci,ci->c", vectors, normals)[:, None] * normals
