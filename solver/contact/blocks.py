"""Matrices over ports and coordinates, of which the blocks are held that are not zero.

W has a block for the ports of a contact and each body that they move with, R one for the ports of two contacts that
share a body: of a chain of bodies both grow with its length, where full matrices grow with its square.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

Index = slice | np.ndarray
"""Rows or columns of a block: from a first to a last one, or ascending numbers."""
Block = tuple[Index, Index, np.ndarray]
"""Its rows, its columns, and its values."""


@dataclass(frozen=True)
class Blocks:
    """A matrix; products with arrays are arrays. Rows and columns of two blocks are the same or have none in common."""

    shape: tuple[int, int]
    blocks: Sequence[Block]

    __array_ufunc__ = None  # So that an array leaves products with it to `__rmatmul__`.

    def __len__(self) -> int:
        return self.shape[0]

    def __matmul__(self, right: np.ndarray) -> np.ndarray:
        found = np.zeros((self.shape[0], *right.shape[1:]))
        for rows, columns, values in self.blocks:
            found[rows] += values @ right[columns]
        return found

    def __rmatmul__(self, left: np.ndarray) -> np.ndarray:
        found = np.zeros((*left.shape[:-1], self.shape[1]))
        for rows, columns, values in self.blocks:
            found[..., columns] += left[..., rows] @ values
        return found

    def __abs__(self) -> "Blocks":
        return self.applied(np.abs)

    def __getitem__(self, key: int | np.integer | slice | np.ndarray | list[int]) -> np.ndarray:
        """Return one row, or some as a full matrix, as of an array."""
        wanted = np.arange(self.shape[0])[key]
        found = self.among(np.atleast_1d(wanted))
        return found[0] if wanted.ndim == 0 else found

    @property
    def T(self) -> "Blocks":
        return Blocks(
            (self.shape[1], self.shape[0]), [(columns, rows, values.T) for rows, columns, values in self.blocks]
        )

    def applied(self, function: Callable[[np.ndarray], np.ndarray]) -> "Blocks":
        """Return a function of each value that is zero at zero."""
        return Blocks(self.shape, [(rows, columns, function(values)) for rows, columns, values in self.blocks])

    def largest(self) -> np.ndarray:
        """Return the largest magnitude in each row, (n,)."""
        found = np.zeros(self.shape[0])
        for rows, _, values in self.blocks:
            found[rows] = np.maximum(found[rows], np.abs(values).max(axis=1, initial=0.0))
        return found

    def among(self, rows: np.ndarray, columns: np.ndarray | None = None) -> np.ndarray:
        """Return some rows of some columns, of all by default, as a full matrix."""
        found = np.zeros((len(rows), self.shape[1] if columns is None else len(columns)))
        for own, to, values in self.blocks:
            here, taken = _places(own, rows)
            if not len(here):
                continue
            if columns is None:
                at = np.arange(self.shape[1])[to]
                found[np.ix_(here, at)] += values[taken]
            else:
                at, used = _places(to, columns)
                found[np.ix_(here, at)] += values[np.ix_(taken, used)]
        return found

    def over(self, columns: slice) -> "Blocks":
        """Return the columns from a first to a last one, between which blocks begin and end, with the blocks there."""
        found = [
            (rows, slice(own.start - columns.start, own.stop - columns.start), values)
            for rows, own, values in self.blocks
            if isinstance(own, slice) and columns.start <= own.start and own.stop <= columns.stop
        ]
        return Blocks((self.shape[0], columns.stop - columns.start), found)

    def dense(self) -> np.ndarray:
        """Return the full matrix."""
        found = np.zeros(self.shape)
        for rows, columns, values in self.blocks:
            found[rows, columns] += values
        return found

    def diagonal(self) -> np.ndarray:
        """Return the diagonal, (n,)."""
        found = np.zeros(min(self.shape))
        for rows, columns, values in self.blocks:
            numbers = np.arange(self.shape[0])[rows]
            at, used = _places(columns, numbers)
            found[numbers[at]] += values[at, used]
        return found

    def with_diagonal(self, added: np.ndarray) -> "Blocks":
        """Return the sum with a diagonal matrix, (n,), whose blocks are held."""
        blocks = [(rows, columns, values.copy()) for rows, columns, values in self.blocks]
        for rows, columns, values in blocks:
            numbers = np.arange(self.shape[0])[rows]
            at, used = _places(columns, numbers)
            values[at, used] += added[numbers[at]]
        return Blocks(self.shape, blocks)

    def beside_diagonal(self) -> np.ndarray:
        """Return which rows have values beside the diagonal, (n,)."""
        return self.with_diagonal(-self.diagonal()).largest() > 0


def summed(shape: tuple[int, int], parts: Iterable[tuple[slice, slice, np.ndarray]]) -> Blocks:
    """Return the matrix that is the sum of some blocks, of which those of the same rows and columns are added."""
    found = dict[tuple[int, int, int, int], np.ndarray]()
    for rows, columns, values in parts:
        key = rows.start, rows.stop, columns.start, columns.stop
        found[key] = found[key] + values if key in found else values
    return Blocks(shape, [(slice(a, b), slice(c, d), values) for (a, b, c, d), values in found.items()])


def full(matrix: np.ndarray) -> Blocks:
    """Return a full matrix as one block."""
    rows, columns = matrix.shape
    return Blocks((rows, columns), [(slice(0, rows), slice(0, columns), matrix)])


def _places(index: Index, wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which of some numbers stand in a block, and where."""
    if isinstance(index, slice):
        here = np.flatnonzero((wanted >= index.start) & (wanted < index.stop))
        return here, wanted[here] - index.start
    if not len(index):
        return np.empty(0, np.int64), np.empty(0, np.int64)
    place = np.minimum(np.searchsorted(index, wanted), len(index) - 1)
    here = np.flatnonzero(index[place] == wanted)
    return here, place[here]
