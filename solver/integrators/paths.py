"""Displacements of single contact points, which every integrator records at the end of each sample."""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.compiled import inner


class Paths(NamedTuple):
    """Shapes: P points, m coordinates, c contact rows, s samples."""

    rows: np.ndarray
    """Displacement along the force on the contact's first body per coordinate, (P, m)."""
    residual: np.ndarray
    """The same per contact force, by R [m/N], (P, c)."""
    values: np.ndarray
    """Displacement at the end of each sample [m], (s, P)."""

    def fill(self, here: slice, q: np.ndarray, multipliers: np.ndarray) -> None:
        """Fill samples from their last coordinates (t, m) and contact forces [N], (t, c)."""
        if len(self.rows):
            self.values[here] = q @ self.rows.T + multipliers @ self.residual.T


NO_PATHS = Paths(np.zeros((0, 0)), np.zeros((0, 0)), np.zeros((0, 0)))


@inner
def keep_paths(paths, sample, q, multipliers):  # type: ignore[no-untyped-def]
    """Fill one sample from the coordinates and contact forces [N] at its end."""
    for p in range(len(paths.rows)):
        total = 0.0
        for k in range(len(q)):
            total += paths.rows[p, k] * q[k]
        for i in range(len(multipliers)):
            total += paths.residual[p, i] * multipliers[i]
        paths.values[sample, p] = total
