"""Pixels over a chart of contact points: values between the points, or those of the nearest one."""

from dataclasses import dataclass

import numpy as np
from matplotlib.tri import TriAnalyzer, Triangulation
from scipy.spatial import cKDTree

from gudgeon.pipeline.plots.contact.pressure import SLIVER, Chart, in_holes


@dataclass(frozen=True)
class Raster:
    """Pixels of the box around a chart's points, row by row from below."""

    extent: tuple[float, float, float, float]
    """Left, right, lower and upper border, in the chart's units."""
    inside: np.ndarray
    """Whether a pixel is between the points and not in a hole, (h, w)."""
    nearest: np.ndarray
    """Number of the point nearest to each pixel inside, (n,)."""
    corners: np.ndarray
    """Points of its triangle, (n, 3)."""
    shares: np.ndarray
    """Of these in the value of each pixel inside, (n, 3)."""

    def between(self, values: np.ndarray) -> np.ndarray:
        """Return values of points (c,) interpolated linearly; NaN outside, (h, w)."""
        return self._spread((values[self.corners] * self.shares).sum(axis=1))

    def of_nearest(self, values: np.ndarray) -> np.ndarray:
        """Return the value of the nearest of the points (c,) at each pixel; NaN outside, (h, w)."""
        return self._spread(values[self.nearest])

    def _spread(self, values: np.ndarray) -> np.ndarray:
        found = np.full(self.inside.shape, np.nan)
        found[self.inside] = values
        return found


def raster(plane: Chart, side: int) -> Raster:
    """Return the pixels of a chart, `side` of them along its longer side."""
    triangles = Triangulation(plane.metric[:, 0], plane.metric[:, 1])
    mask = TriAnalyzer(triangles).get_flat_tri_mask(SLIVER, rescale=False) | in_holes(plane, triangles.triangles)
    triangles.set_mask(mask)
    low, high = plane.metric.min(axis=0), plane.metric.max(axis=0)
    counts = np.maximum(2, np.rint(side * (high - low) / (high - low).max())).astype(int)
    across, up = (a + (b - a) * (np.arange(n) + 0.5) / n for a, b, n in zip(low, high, counts, strict=True))
    x, y = np.meshgrid(across, up)
    number = np.asarray(triangles.get_trifinder()(x, y))
    inside = number >= 0
    places = np.column_stack([x[inside], y[inside]])
    corners = triangles.triangles[number[inside]]
    a, b, c = (plane.metric[corners[:, n]] for n in range(3))
    area = _cross(b - a, c - a)
    shares = np.column_stack([_cross(b - places, c - places), _cross(c - places, a - places), np.zeros(len(area))])
    shares /= area[:, None]
    shares[:, 2] = 1.0 - shares[:, 0] - shares[:, 1]
    nearest = cKDTree(plane.metric).query(places)[1] if len(places) else np.empty(0, np.int64)
    low, high = plane.shown.min(axis=0), plane.shown.max(axis=0)
    return Raster((low[0], high[0], low[1], high[1]), inside, np.asarray(nearest), corners, shares)


def _cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
