"""True surfaces: cylinders and planes that points are put on."""

from typing import Any

import numpy as np

from gudgeon.modaldb.traction import cross_axes


def cylindrical(points: np.ndarray, shape: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return radius [m], angle [rad] and height [m] of points (k, 3) about a shape's axis.

    The angle is counted from the x axis (from z, if the axis is x) by the right hand.
    """
    axis = np.asarray(shape["axis"], float)
    axis = axis / np.linalg.norm(axis)
    first, second = cross_axes(axis)
    arm = points - np.asarray(shape["origin"], float)
    a, b = arm @ first, arm @ second
    return np.hypot(a, b), np.arctan2(b, a), arm @ axis


def radial_directions(points: np.ndarray, shape: dict[str, Any]) -> np.ndarray:
    """Return unit vectors (k, 3) from a shape's axis to the points."""
    axis = np.asarray(shape["axis"], float)
    axis = axis / np.linalg.norm(axis)
    arm = points - np.asarray(shape["origin"], float)
    radial = arm - np.outer(arm @ axis, axis)
    return radial / np.linalg.norm(radial, axis=1, keepdims=True)


def true_surface(points: np.ndarray, outward: np.ndarray, shape: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Move points (k, 3) onto a surface's true shape and return them with its normals on the `outward` side.

    Nodes of a surface that a profile moved stand on their true surface already.
    """
    origin = np.asarray(shape["origin"], float)
    if shape["kind"] == "plane":
        normal = np.asarray(shape["normal"], float) / np.linalg.norm(shape["normal"])
        moved = points - np.outer((points - origin) @ normal, normal)
        normals = np.broadcast_to(normal, points.shape).copy()
    elif shape["kind"] == "sphere":
        normals = (points - origin) / np.linalg.norm(points - origin, axis=1, keepdims=True)
        moved = origin + shape["radius"] * normals
    else:
        radial = radial_directions(points, shape)
        radius, _, _ = cylindrical(points, shape)
        moved = points if shape.get("profiled") else points + radial * (shape["radius"] - radius)[:, None]
        normals = radial
    side = np.sign(np.einsum("ki,ki->k", normals, outward))
    return moved, normals * side[:, None]
