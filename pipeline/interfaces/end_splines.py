"""Splines at the ends of a surface: tractions of unit force that act at the centres of their splines.

A force at s is spread over the splines by their values N_a(s), which add up to one and, as Σ N_a(s) ξ_a = s with the
centres ξ_a, keep its place. The traction N_a/∫ N_a dA of a spline that the end of the surface cuts off acts further
inside than ξ_a. With its neighbours, by amounts D_ab of least change,

    t_a = Σ_b D_ab N_b/∫ N_b dA,   Σ_b D_ab = 1,   Σ_b D_ab c_b = ξ_a,

c_b the centroids of the cut tractions, so that force and place are kept up to the end. Inside D is 1.
"""

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.modes import SplineGrid

INSIDE = 1e-3
"""Distance of a centroid from the centre of its spline over the spacing that is that of the quadrature."""
REACH = 3
"""Neighbours of a spline along each axis by which its traction is moved."""


def spline_centres(grid: SplineGrid) -> np.ndarray:
    """Return the coordinates of the centres of all splines on the chart [m], (f, 2)."""
    axes = [
        start + (np.arange(count) - 1) * step
        for start, step, count in zip(grid.start, grid.spacing, grid.counts, strict=True)
    ]
    return np.column_stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")])


def placed_tractions(grid: SplineGrid, centroids: np.ndarray, active: np.ndarray) -> sparse.csr_matrix:
    """Return D, (f, f).

    Args:
        centroids: Of the tractions as the surface cuts them [m], (f, 2); NaN of those that find no surface.
        active: The spline in the place of each one, (f,): itself, or the nearest that finds surface.
    """
    centres, on_surface = spline_centres(grid), np.isfinite(centroids).all(axis=1)
    numbers = np.column_stack(np.divmod(np.arange(grid.size), int(grid.counts[1])))
    off = np.abs(centroids[active] - centres).max(axis=1) > INSIDE * grid.spacing.min()
    D = sparse.lil_matrix((grid.size, grid.size))
    D[np.arange(grid.size), active] = 1.0
    for a in np.flatnonzero(off):
        within_reach = on_surface & (np.abs(numbers - numbers[active[a]]).max(axis=1) <= REACH)
        neighbours = np.flatnonzero(within_reach)
        arms = (centroids[neighbours] - centres[a]) / grid.spacing
        moments = np.vstack([np.ones(len(neighbours)), arms.T])
        lacking = -moments @ (neighbours == active[a]) + np.array([1.0, 0.0, 0.0])
        change = np.linalg.lstsq(moments, lacking, rcond=1e-9)[0]
        D[a, neighbours] = D[a, neighbours].toarray()[0] + change
    return sparse.csr_matrix(D)
