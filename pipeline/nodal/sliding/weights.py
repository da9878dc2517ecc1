"""Weights N of the master's surface functions at the contact points: one sparse matrix for all contacts."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.modes import SplineGrid
from gudgeon.modaldb.records.traction import SUPPORT, inside
from gudgeon.pipeline.interfaces.traction_space import spline_matrix
from gudgeon.pipeline.nodal.problem import NodalContact


def sliding_weights(
    space: SplineGrid, coordinates: np.ndarray
) -> Callable[[float], tuple[sparse.csr_matrix, np.ndarray]]:
    """Return the splines at points that slide along a traction space, see `SlidingSurface.weights`.

    Args:
        coordinates: Of the points at σ = 0, across and along [m], (c, 2).
    """

    def weights(sigma: float) -> tuple[sparse.csr_matrix, np.ndarray]:
        shifted = coordinates + np.array([0.0, sigma])
        N, on = spline_matrix(space, shifted), inside(space, shifted)
        N.data.reshape(-1, SUPPORT)[~on] = 0.0
        return N, on

    return weights


@dataclass(frozen=True)
class Touch:
    """The points on the surfaces at one time."""

    N: sparse.csr_matrix
    """Weights of the functions of all surfaces; zero of points that face none, (c, F)."""
    present: np.ndarray
    """Whether each point faces a surface, rigid or not, (c,)."""


class Surfaces:
    """The surfaces of all contacts: contact k has the points `points[k]` and the functions `functions[k]`."""

    def __init__(self, contacts: list[NodalContact]) -> None:
        self._weights = {k: surface.weights for k, c in enumerate(contacts) if (surface := c.surface) is not None}
        ends = np.cumsum([0, *(len(contact.gap) for contact in contacts)])
        sizes = [0 if contact.surface is None else contact.surface.rows.shape[0] for contact in contacts]
        bases = np.cumsum([0, *sizes])
        self.points = [slice(a, b) for a, b in pairwise(ends)]
        self.functions = [slice(a, b) for a, b in pairwise(bases)]
        self.count, self.size = int(ends[-1]), int(bases[-1])
        self.sliding = list(self._weights)
        """Contacts that slide, in the order of σ."""

    def touch(self, sigmas: np.ndarray) -> Touch:
        """Return N after the sliding distances [m] of the sliding contacts."""
        present, sizes = np.ones(self.count, bool), np.zeros(self.count, np.int64)
        values, columns = [np.empty(0)], [np.empty(0, np.int64)]
        for k, sigma in zip(self.sliding, sigmas, strict=True):
            block, present[self.points[k]] = self._weights[k](float(sigma))
            sizes[self.points[k]] = np.diff(block.indptr)
            values.append(block.data)
            columns.append(block.indices + self.functions[k].start)
        starts = np.concatenate([[0], np.cumsum(sizes)])
        table = np.concatenate(values), np.concatenate(columns), starts
        return Touch(sparse.csr_matrix(table, shape=(self.count, self.size)), present)
