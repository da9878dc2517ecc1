"""Local directions that decks of Abaqus and CalculiX state: `*ORIENTATION`, and `*TRANSFORM` of cylinders."""

import numpy as np

from gudgeon.pipeline.geometry.decks.abaqus.keywords import Keyword
from gudgeon.pipeline.geometry.decks.axes import in_system
from gudgeon.pipeline.geometry.decks.model import Source


def orientation(keyword: Keyword) -> np.ndarray | None:
    """Return the directions of `*ORIENTATION` as columns, (3, 3); None of one that is not rectangular by coordinates.

    Its points are one of x, one of the plane of x and y, and the origin, that of the deck by default; then an axis and
    the angle [deg] about it.
    """
    options, rows = keyword.options, keyword.rows
    if options.get("SYSTEM", "RECTANGULAR").upper()[:1] != "R" or not rows:
        return None
    if options.get("DEFINITION", "COORDINATES").upper() != "COORDINATES" or options.keys() & {"LOCAL DIRECTIONS"}:
        return None
    values = rows[0].reals()
    if len(values) < 6:
        return None
    a, b, origin = np.array((values + [0.0] * 3)[:9]).reshape(3, 3)
    axes = in_system(origin, a, b, keyword.source)
    if len(rows) < 2:
        return axes
    axis, angle = (*rows[1].reals(), 0.0, 0.0)[:2]
    if axis not in (0.0, 1.0, 2.0, 3.0):
        return None
    c, s, k = np.cos(np.radians(angle)), np.sin(np.radians(angle)), (int(axis) or 1) - 1
    p, q = (k + 1) % 3, (k + 2) % 3
    turned = axes.copy()
    turned[:, p], turned[:, q] = c * axes[:, p] + s * axes[:, q], c * axes[:, q] - s * axes[:, p]
    return turned


def around(origin: np.ndarray, axis: np.ndarray, point: np.ndarray, source: Source) -> np.ndarray:
    """Return the radial, tangential and axial direction at a point as columns, (3, 3).

    Raises:
        InputError: the axis has no direction, or the point is on it.
    """
    length = float(np.linalg.norm(axis))
    arm = point - origin
    z = axis / (length or 1.0)
    radial = arm - (arm @ z) * z
    radius = float(np.linalg.norm(radial))
    if not length > 0 or not radius > 1e-9 * float(np.linalg.norm(arm)):
        raise source.error("a cylindrical system has no radial direction at one of its nodes")
    return np.column_stack([radial / radius, np.cross(z, radial / radius), z])
