"""Weights N of the master's surface functions at the contact points: one table for all contacts, and its products."""

from itertools import pairwise

import numpy as np

from gudgeon.modaldb.records.modes import TractionModes
from gudgeon.modaldb.traction import SUPPORT, cubic_weights, inside, spline_weights
from gudgeon.pipeline.nodal.problem import NodalContact


class SplineWeights:
    """Splines of a traction space at points that slide along it.

    Args:
        coordinates: Of the points at σ = 0, across and along [m], (c, 2).
    """

    def __init__(self, space: TractionModes, coordinates: np.ndarray) -> None:
        self._start, self._spacing = float(space.start[1]), float(space.spacing[1])
        self._along, self._count = coordinates[:, 1], int(space.counts[1])
        # The weights across are constant; they are those of a point in the middle of the range along.
        middle = np.full(len(coordinates), self._start + 0.5 * self._spacing * (self._count - 3))
        fixed = np.column_stack([coordinates[:, 0], middle])
        self._on = inside(space, fixed)
        numbers, values = spline_weights(space, fixed)
        self._across = values.reshape(-1, 4, 4).sum(axis=2)[:, :, None]
        self._columns = (numbers.reshape(-1, 4, 4)[:, :, 0] // self._count * self._count)[:, :, None]

    def __call__(self, sigma: float) -> tuple[np.ndarray, np.ndarray]:
        """Return N(σ), see `SlidingSurface.weights`."""
        place = (self._along + (sigma - self._start)) / self._spacing
        last = self._count - 3
        on = self._on & (place >= 0) & (place <= last)
        first = np.clip(np.floor(place), 0, last - 1)
        numbers = self._columns + (first.astype(np.int64)[:, None] + np.arange(4))[:, None]
        numbers[~on] = -1
        values = self._across * cubic_weights(place - first)[:, None]
        return numbers.reshape(-1, SUPPORT), values.reshape(-1, SUPPORT)


class Touch:
    """N at one time: numbers of functions, counted over all surfaces, and values, (c, s); zero where there is none."""

    def __init__(self, numbers: np.ndarray, values: np.ndarray, present: np.ndarray) -> None:
        self.numbers, self.values, self.present = numbers, values, present
        """`present`: whether each point faces a surface, rigid or not, (c,)."""

    def sample(self, field: np.ndarray, points: np.ndarray | slice = slice(None)) -> np.ndarray:
        """N field at some points, (a,)."""
        return np.einsum("cs,cs->c", self.values[points], field[self.numbers[points]])

    def spread(self, forces: np.ndarray, points: np.ndarray, size: int) -> np.ndarray:
        """Nᵀ forces of some points (a,), (F,)."""
        amounts = self.values[points] * forces[:, None]
        return np.bincount(self.numbers[points].ravel(), amounts.ravel(), minlength=size)

    def dense(self, points: np.ndarray, column: np.ndarray, width: int) -> np.ndarray:
        """N of some points and functions as a matrix, (a, width); `column` (F,) is the column of each function."""
        flat = column[self.numbers[points]] + width * np.arange(len(points))[:, None]
        return np.bincount(flat.ravel(), self.values[points].ravel(), minlength=len(points) * width).reshape(-1, width)


class Surfaces:
    """The surfaces of all contacts: contact k has the points `points[k]` and the functions `functions[k]`."""

    def __init__(self, contacts: list[NodalContact]) -> None:
        ends = np.cumsum([0, *(len(contact.gap) for contact in contacts)])
        sizes = [0 if contact.surface is None else contact.surface.rows.shape[0] for contact in contacts]
        bases = np.cumsum([0, *sizes])
        self.points = [slice(a, b) for a, b in pairwise(ends)]
        self.functions = [slice(a, b) for a, b in pairwise(bases)]
        self.count, self.size = int(ends[-1]), int(bases[-1])
        self.sliding = [k for k, contact in enumerate(contacts) if contact.surface is not None]
        """Contacts that slide, in the order of σ."""
        self._weights = [surface.weights for c in contacts if (surface := c.surface) is not None]

    def touch(self, sigmas: np.ndarray) -> Touch:
        """Return N after the sliding distances [m] of the sliding contacts."""
        found = [weights(float(sigma)) for weights, sigma in zip(self._weights, sigmas, strict=True)]
        width = max([values.shape[1] for _, values in found], default=1)
        numbers, values = np.zeros((self.count, width), np.int64), np.zeros((self.count, width))
        present = np.ones(self.count, bool)
        for k, (one, value) in zip(self.sliding, found, strict=True):
            points, on = self.points[k], one[:, 0] >= 0
            present[points] = on
            numbers[points, : one.shape[1]] = np.where(on[:, None], one + self.functions[k].start, 0)
            values[points, : one.shape[1]] = np.where(on[:, None], value, 0.0)
        return Touch(numbers, values, present)
