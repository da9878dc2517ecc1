"""Displacements of single contact points and deflections of bodies, which every integrator records at each sample."""

from typing import NamedTuple

import numpy as np


class Paths(NamedTuple):
    """Shapes: P points, b bodies, m coordinates, c contact rows, s samples."""

    rows: np.ndarray
    """Displacement along the force on the contact's first body per coordinate, (P, m)."""
    residual: np.ndarray
    """The same per contact force, by R [m/N], (P, c)."""
    values: np.ndarray
    """Displacement at the end of each sample [m], (s, P)."""
    elastic: np.ndarray
    """First and last + 1 elastic coordinate of each body, (b, 2)."""
    squares: np.ndarray
    """Sum of the squares of the elastic coordinates at the end of each sample [kg m^2], (s, b)."""

    def fill(self, here: slice, q: np.ndarray, multipliers: np.ndarray) -> None:
        """Fill samples from their last coordinates (t, m) and contact forces [N], (t, c)."""
        if len(self.rows):
            self.values[here] = q @ self.rows.T + multipliers @ self.residual.T
        for body, (first, last) in enumerate(self.elastic):
            self.squares[here, body] = (q[:, first:last] ** 2).sum(axis=1)

    def part(self, here: slice) -> "Paths":
        """Return a range of the samples."""
        return self._replace(values=self.values[here], squares=self.squares[here])


NOTHING = np.zeros((0, 0))
NO_PATHS = Paths(NOTHING, NOTHING, NOTHING, np.zeros((0, 2), np.int64), NOTHING)
