"""Traction spaces: the coordinates of a point on the chart, and the splines there. Part of the record format.

A chart gives two coordinates in metres: `across`, and `along`, the direction in which bodies slide. On a cylinder
across = radius · (angle − middle) and along is the height along the axis; the angle is counted from the x axis (from
z, if the axis is x) by the right hand. On a plane they are the coordinates along two given unit vectors.
On a patch, any smooth surface, they are those of its projection along a given normal, over which its height is
a spline.
Along each of them there are uniform cubic B-splines: spline i is (1, 4, 1)/6 at its knots, centred at
start + (i − 1)·spacing, so that four splines are non-zero at any point and they add up to one.
"""

from typing import Any

import numpy as np

from gudgeon.modaldb.records.modes import SplineGrid

SUPPORT = 16
"""Functions that are non-zero at a point."""
VECTORS = ("origin", "axis", "normal", "across", "along")
"""Vectors of a chart and of a true surface."""


def chart_coordinates(chart: dict[str, Any], points: np.ndarray) -> np.ndarray:
    """Return the chart's coordinates across and along [m], (p, 2), of points (p, 3)."""
    arm = points - np.asarray(chart["origin"], float)
    if chart["kind"] != "cylinder":
        return np.column_stack([arm @ np.asarray(chart["across"], float), arm @ np.asarray(chart["along"], float)])
    axis = np.asarray(chart["axis"], float)
    e1, e2 = cross_axes(axis)
    turned = np.exp(1j * (np.arctan2(arm @ e2, arm @ e1) - chart["middle"]))
    return np.column_stack([chart["radius"] * np.angle(turned), arm @ axis])


def height_grid(chart: dict[str, Any]) -> SplineGrid:
    """Return the grid of the splines of a patch's height."""
    low, step = (np.asarray(chart[key], float) for key in ("low", "step"))
    return SplineGrid(chart, low, step, np.asarray(chart["counts"], int))


def heights(chart: dict[str, Any], coordinates: np.ndarray) -> np.ndarray:
    """Return the height of a patch along its normal [m], (p,), at coordinates across and along [m], (p, 2)."""
    numbers, values = spline_weights(height_grid(chart), coordinates)
    return np.einsum("pa,pa->p", values, np.asarray(chart["heights"], float)[numbers])


def cross_axes(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the two unit vectors across a unit axis; angles are counted from the first towards the second."""
    seed = np.array([1.0, 0, 0]) if abs(axis[0]) < 0.9 else np.array([0, 0, 1.0])
    e1 = seed - axis * (seed @ axis)
    e1 /= np.linalg.norm(e1)
    return e1, np.cross(axis, e1)


def along_direction(chart: dict[str, Any]) -> np.ndarray:
    """Return the unit vector of the coordinate `along`, (3,)."""
    return np.asarray(chart["axis" if chart["kind"] == "cylinder" else "along"], float)


def spline_weights(space: SplineGrid, coordinates: np.ndarray, *, tails: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Return numbers (p, 16) and values (p, 16) of the functions that are not zero at p points.

    Args:
        coordinates: Across and along [m], (p, 2), inside the space.
        tails: Points may lie beyond the space, where the functions next to its edges fade out.
    """
    numbers, values = [], []
    for axis in range(2):
        position = (coordinates[:, axis] - space.start[axis]) / space.spacing[axis]
        start, top = np.floor(position).astype(int), int(space.counts[axis]) - 1
        if not tails:
            start = np.clip(start, 0, top - 3)
        indices = start[:, None] + np.arange(4)
        numbers.append(np.clip(indices, 0, top))
        values.append(cubic_weights(position - start) * (indices == numbers[-1]))
    joined = numbers[0][:, :, None] * int(space.counts[1]) + numbers[1][:, None, :]
    product = values[0][:, :, None] * values[1][:, None, :]
    return joined.reshape(-1, SUPPORT), product.reshape(-1, SUPPORT)


def spread(space: SplineGrid, coordinates: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """Return the shares of all functions in the forces at p points, (p, F).

    Args:
        coordinates: As in `spline_weights`.
        forces: (p,)
    """
    numbers, values = spline_weights(space, coordinates)
    shares = np.zeros((len(forces), int(np.prod(space.counts))))
    np.put_along_axis(shares, numbers, forces[:, None] * values, axis=1)
    return shares


def cubic_weights(t: np.ndarray) -> np.ndarray:
    """Return the four uniform cubic B-splines at the share t of an interval, (p, 4)."""
    s = 1 - t
    return np.column_stack([s**3, 3 * t**3 - 6 * t**2 + 4, 3 * s**3 - 6 * s**2 + 4, t**3]) / 6


def inside(space: SplineGrid, coordinates: np.ndarray) -> np.ndarray:
    """Return which points (p, 2) lie on the space, (p,)."""
    end = space.start + space.spacing * (space.counts - 3)
    return np.all((coordinates >= space.start) & (coordinates <= end), axis=1)


def turned_chart(chart: dict[str, Any], Q: np.ndarray) -> dict[str, Any]:
    """Return a chart with its vectors turned; the angle of a cylinder is counted from the axes of the new direction."""
    turned = {key: (Q @ np.asarray(value, float)).tolist() if key in VECTORS else value for key, value in chart.items()}
    if "middle" in chart:
        e1, e2 = cross_axes(np.asarray(turned["axis"], float))
        old = Q @ cross_axes(np.asarray(chart["axis"], float))[0]
        turned["middle"] = float(chart["middle"] + np.arctan2(old @ e2, old @ e1))
    return turned
