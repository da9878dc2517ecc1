"""Recognition of true surfaces: the plane, cylinder, sphere or cone through points with normals, with its residual.

Linear least squares on points and normals give a first shape: the normals of a cylinder are perpendicular to its axis,
those of a cone have one angle to it, those of a sphere meet in its centre. Gauss-Newton steps on the distances of the
points alone then make it the nearest one, as in Lukács, Martin & Marshall, ECCV 1998.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gudgeon.modaldb.records.traction import cross_axes
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, cone, cylinder, distance, plane, sphere, true_surface

ON_SHAPE = 1e-5
"""Largest residual over the extent of the points: files keep six digits, exact surfaces are at 1e-9."""
OF_BULGE = 1e-3
"""Largest residual of a round shape over the points' distance from a plane: less decides between the round shapes."""
FLATTEST = 1e3
"""Largest radius over the extent of the points."""
ALONG = 0.9
"""Least cosine between the normals that were given and those of the shape."""
AXIS_TIE = 1e-6
"""Components of an axis that are equal: the first of them counts."""
MOST_POINTS = 400
"""Points of a fit; of more, evenly chosen ones."""
STEPS, STEP_SIZE, CONVERGED = 30, 1e-6, 1e-14


class Fit(NamedTuple):
    """A recognised surface."""

    shape: SurfaceRule
    """Its true shape, empty if it is none of the four."""
    residual: float
    """Largest distance of the points from the shape [m]; of an unknown one, from the nearest plane."""


def fit_shape(points: np.ndarray, normals: np.ndarray) -> Fit:
    """Return the true surface through points (k, 3) with outward unit normals (k, 3), the simplest one that fits.

    Args:
        points: In any unit, which is then that of the shape.
        normals: Exact, or those of facets: they begin the search and tell apart what only the points have in common.
    """
    every = points
    if len(points) > MOST_POINTS:
        chosen = np.linspace(0, len(points) - 1, MOST_POINTS).astype(int)
        points, normals = points[chosen], normals[chosen]
    middle = points.mean(axis=0)
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    if len(points) < 3 or size == 0:
        return Fit({}, size)
    local = (points - middle) / size
    flat = _plane(local, normals)
    bulge = float(distance(local, flat).max())
    fitted = flat if bulge <= ON_SHAPE and _agrees(local, normals, flat) else None
    if fitted is None:
        for guess in (_cylinder, _sphere, _cone):
            shape = _nearest(local, guess(local, normals))
            if shape is not None and _fits(local, normals, shape, bulge):
                fitted = shape
                break
    shape = {} if fitted is None else _placed(fitted, middle, size)
    off = distance(every, shape or _placed(flat, middle, size))
    return Fit(shape, float(off.max()))


def _fits(points: np.ndarray, normals: np.ndarray, shape: SurfaceRule, bulge: float) -> bool:
    worst = float(distance(points, shape).max())
    small = shape.get("radius", 1.0) <= FLATTEST
    return small and worst <= min(ON_SHAPE, OF_BULGE * bulge) and _agrees(points, normals, shape)


def _agrees(points: np.ndarray, normals: np.ndarray, shape: SurfaceRule) -> bool:
    """Return whether the normals are those of the shape: corners of a hexagonal bar lie on a cylinder, too."""
    with np.errstate(invalid="ignore", divide="ignore"):
        true_normals = true_surface(points, normals, shape)[1]
    return bool((np.einsum("ki,ki->k", normals, true_normals) > ALONG).all())


def _plane(points: np.ndarray, normals: np.ndarray) -> SurfaceRule:
    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle, full_matrices=False)[2][2]
    return plane(normal * (1.0 if normal @ normals.sum(axis=0) >= 0 else -1.0), middle)


def _sphere(points: np.ndarray, normals: np.ndarray) -> SurfaceRule:
    """Return the sphere of least squares of |p|² = 2 c·p + k."""
    rows = np.column_stack([2 * points, np.ones(len(points))])
    centre, constant = np.split(np.linalg.lstsq(rows, (points**2).sum(axis=1), rcond=None)[0], [3])
    return sphere(float(np.sqrt(max(constant[0] + centre @ centre, 1e-12))), centre)


def _cylinder(points: np.ndarray, normals: np.ndarray) -> SurfaceRule:
    """Return the cylinder whose axis is perpendicular to the normals, through a circle across it."""
    axis = np.linalg.svd(normals, full_matrices=False)[2][2]
    e1, e2 = cross_axes(axis)
    flat = np.column_stack([points @ e1, points @ e2])
    rows = np.column_stack([2 * flat, np.ones(len(flat))])
    u, v, constant = np.linalg.lstsq(rows, (flat**2).sum(axis=1), rcond=None)[0]
    return cylinder(float(np.sqrt(max(constant + u * u + v * v, 1e-12))), axis, u * e1 + v * e2)


def _cone(points: np.ndarray, normals: np.ndarray) -> SurfaceRule:
    """Return the cone with its axis across the plane of the normals' tips, and its apex on all tangent planes."""
    axis = np.linalg.svd(normals - normals.mean(axis=0), full_matrices=False)[2][2]
    apex = np.linalg.lstsq(normals, np.einsum("ki,ki->k", normals, points), rcond=None)[0]
    if axis @ (points - apex).mean(axis=0) < 0:
        axis = -axis
    sine = float(np.clip(np.abs(normals @ axis).mean(), 1e-6, 1 - 1e-6))
    return cone(float(np.arcsin(sine)), axis, apex)


def _nearest(points: np.ndarray, start: SurfaceRule) -> SurfaceRule | None:
    """Return the shape of its kind with the least squares of distance; None if it runs away."""
    shape_of, p = _parameters(start)

    def signed(values: np.ndarray) -> np.ndarray:
        return signed_distance(points, shape_of(values))

    with np.errstate(all="ignore"):
        for _ in range(STEPS):
            off = signed(p)
            columns = [(signed(p + step) - signed(p - step)) / (2 * STEP_SIZE) for step in STEP_SIZE * np.eye(len(p))]
            jacobian = np.column_stack(columns)
            if not (np.isfinite(off).all() and np.isfinite(jacobian).all()):
                return None
            change = np.linalg.lstsq(jacobian, -off, rcond=1e-10)[0]
            p = p + change
            if np.abs(change).max() < CONVERGED:
                break
        return shape_of(p) if np.isfinite(signed(p)).all() else None


def _parameters(start: SurfaceRule) -> tuple[Callable[[np.ndarray], SurfaceRule], np.ndarray]:
    """Return the function from parameters to shapes of one kind, and the parameters of the first one."""
    origin = np.array(start["origin"])
    if start["kind"] == "sphere":
        return lambda p: sphere(abs(p[3]), p[:3]), np.append(origin, start["radius"])
    axis = np.array(start["axis"])
    e1, e2 = cross_axes(axis)

    def turned(p: np.ndarray) -> np.ndarray:
        moved = axis + p[0] * e1 + p[1] * e2
        return moved / np.linalg.norm(moved)

    if start["kind"] == "cylinder":
        return (
            lambda p: cylinder(abs(p[4]), turned(p), origin + p[2] * e1 + p[3] * e2),
            np.array([0.0, 0.0, 0.0, 0.0, start["radius"]]),
        )
    return lambda p: cone(p[5], turned(p), p[2:5]), np.array([0.0, 0.0, *origin, start["angle"]])


def signed_distance(points: np.ndarray, shape: SurfaceRule) -> np.ndarray:
    """Return the distance of points (k, 3) from a round shape, positive outside, (k,)."""
    arm = points - np.asarray(shape["origin"])
    if shape["kind"] == "sphere":
        return np.linalg.norm(arm, axis=1) - shape["radius"]
    height = arm @ np.asarray(shape["axis"])
    radius = np.linalg.norm(arm - np.outer(height, shape["axis"]), axis=1)
    if shape["kind"] == "cylinder":
        return radius - shape["radius"]
    return radius * np.cos(shape["angle"]) - height * np.sin(shape["angle"])


def _placed(shape: SurfaceRule, middle: np.ndarray, size: float) -> SurfaceRule:
    """Return a shape in units of `size` about `middle` in the units of the points.

    Heights along a cylinder and coordinates in a plane then begin at the points' origin: its foot on axis and plane is
    their origin. The largest component of a cylinder's axis is positive.
    """
    origin = middle + size * np.asarray(shape["origin"])
    placed = dict(shape)
    if "radius" in shape:
        placed["radius"] = float(size * shape["radius"])
    if shape["kind"] == "plane":
        normal = np.asarray(shape["normal"])
        origin = normal * (normal @ origin)
        placed["normal"] = (normal + 0.0).tolist()  # without negative zeros
    elif shape["kind"] == "cylinder":
        axis = np.asarray(shape["axis"])
        axis = axis * np.sign(axis[int(np.argmax(np.abs(axis) > np.abs(axis).max() - AXIS_TIE))])
        origin = origin - axis * (axis @ origin)
        placed["axis"] = (axis + 0.0).tolist()
    return placed | {"origin": (origin + 0.0).tolist()}


def same_surface(shape: SurfaceRule, second: SurfaceRule, size: float, relative: float = ON_SHAPE) -> bool:
    """Return whether two shapes are one true surface, but for `relative` of the part's size [m]."""
    if not shape or shape["kind"] != second.get("kind"):
        return False
    offset = np.asarray(second["origin"]) - np.asarray(shape["origin"])
    if shape["kind"] == "sphere":
        return bool(
            np.linalg.norm(offset) <= relative * size and abs(shape["radius"] - second["radius"]) <= relative * size
        )
    key = "normal" if shape["kind"] == "plane" else "axis"
    a, b = np.asarray(shape[key]), np.asarray(second[key])
    parallel = float(np.linalg.norm(np.cross(a, b))) <= relative
    if shape["kind"] == "plane":
        return bool(parallel and a @ b > 0 and abs(offset @ a) <= relative * size)
    if shape["kind"] == "cylinder":
        aside = np.linalg.norm(offset - a * (offset @ a)) <= relative * size
        return bool(parallel and aside and abs(shape["radius"] - second["radius"]) <= relative * size)
    close = np.linalg.norm(offset) <= relative * size and abs(shape["angle"] - second["angle"]) <= relative
    return bool(parallel and a @ b > 0 and close)
