"""Contact pressure as a mean over patches of a stated area, so that no single point with a sliver of area sets it."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

PATCH_SHARE = 0.01
"""Area of a patch, of the whole contact surface."""
PATCH_POINTS = 4.0
"""Least area of a patch, in median areas of a point."""
SLIVER = 0.1
"""Area of a point, of the median one, below which its own pressure is no result: the border cuts its facets off."""


@dataclass(frozen=True)
class Patches:
    """For each of c points, the nearest points that together have the patch area, itself first."""

    area: float
    """Least area of each patch [m^2]."""
    members: sparse.csr_matrix
    """1 where a point (column) belongs to the patch of a point (row), (c, c)."""
    areas: np.ndarray
    """Of each patch [m^2], (c,)."""
    slivers: np.ndarray
    """Whether a point's own area is a sliver, (c,)."""

    def mean(self, multipliers: np.ndarray) -> np.ndarray:
        """Return the mean pressure over the patch of each point [Pa], (f, c), of forces [N], (f, c)."""
        return np.asarray((self.members @ multipliers.T).T) / self.areas


@dataclass(frozen=True)
class PressurePeak:
    """The largest mean pressure over a patch."""

    pressure: float
    """[Pa]"""
    frame: int
    point: int
    """In the middle of the patch."""
    area: float
    """Of the patch [m^2]."""


def patches(points: np.ndarray, areas: np.ndarray) -> Patches:
    """Return the patches of contact points (c, 3) with tributary areas [m^2], (c,)."""
    from scipy.spatial import KDTree

    count, median = len(points), float(np.median(areas))
    target = min(max(PATCH_SHARE * float(areas.sum()), PATCH_POINTS * median), float(areas.sum()))
    tree, neighbours = KDTree(points), min(count, 8)
    while True:
        order = tree.query(points, k=[*range(1, neighbours + 1)])[1]
        reached = np.cumsum(areas[order], axis=1)
        if neighbours == count or (reached[:, -1] >= target).all():
            break
        neighbours = min(count, 2 * neighbours)
    taken = np.minimum((reached < target * (1 - 1e-12)).sum(axis=1) + 1, neighbours)
    within = np.arange(neighbours) < taken[:, None]
    rows = np.repeat(np.arange(count), taken)
    members = sparse.csr_matrix((np.ones(len(rows)), (rows, order[within])), (count, count))
    return Patches(target, members, members @ areas, areas < SLIVER * median)


def pressure_peak(surface: Patches, multipliers: np.ndarray) -> PressurePeak:
    """Return the largest mean pressure over any patch in any frame, of forces [N], (f, c)."""
    mean = surface.mean(multipliers)
    frame, point = map(int, np.unravel_index(mean.argmax(), mean.shape))
    return PressurePeak(float(mean[frame, point]), frame, point, float(surface.areas[point]))
