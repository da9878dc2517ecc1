"""The way `reuse`: modes, static responses and residual flexibility of the first stored design, as they are.

Its derivatives with respect to the nodes tell to first order, without new matrices, whether it may be within the
tolerance.
"""

import numpy as np
from scipy import linalg

from gudgeon.pipeline.design_change.projection import Projection, Target
from gudgeon.pipeline.design_change.ways.answer import Answer, Search


class Kept:
    """A body with the displacements of another, without its own rigid motions; see `Reduced`."""

    def __init__(self, target: Target, stored: Projection) -> None:
        self._target, self._stored = target, stored
        self.values = stored.values

    def shapes(self, count: int) -> np.ndarray:
        """Return the lowest M-orthonormal shapes, (dofs, count)."""
        Phi = self._target.elastic(self._stored.shapes(count))
        L = linalg.cholesky(Phi.T @ (self._target.model.M @ Phi), lower=True)
        return linalg.solve_triangular(L, Phi.T, lower=True).T

    def responses(self, loads: np.ndarray) -> np.ndarray:
        """Return the static displacement under forces on the rows (c, k), (dofs, k)."""
        return self._target.elastic(self._stored.responses(loads))

    def uncertified(self) -> np.ndarray:
        """Return the static displacement under the target's pressures and weights, (dofs, p + w)."""
        return self._target.elastic(self._stored.uncertified())


def kept(search: Search) -> Answer | None:
    """Return the first stored design as it is; None where that is beyond the tolerance to first order."""
    target, family = search.target, search.family
    if family.first_order(target).largest(target.count) > search.tolerance:
        return None
    stored, count = family.projections[0], target.count
    reduced = Kept(target, stored)
    at_rows = (target.B @ reduced.shapes(count)) / np.sqrt(stored.values[:count])
    return Answer(reduced, family.residual(count) + at_rows @ at_rows.T)
