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
        product = np.zeros((self.shape[0], *right.shape[1:]))
        for rows, columns, values in self.blocks:
            product[rows] += values @ right[columns]
        return product

    def __rmatmul__(self, matrix: np.ndarray) -> np.ndarray:
        product = np.zeros((*matrix.shape[:-1], self.shape[1]))
        for rows, columns, values in self.blocks:
            product[..., columns] += matrix[..., rows] @ values
        return product

    def __abs__(self) -> "Blocks":
        return self.applied(np.abs)

    def __getitem__(self, key: int | np.integer | slice | np.ndarray | list[int]) -> np.ndarray:
        """Return one row, or some as a full matrix, as of an array."""
        rows = np.arange(self.shape[0])[key]
        entries = self.among(np.atleast_1d(rows))
        return entries[0] if rows.ndim == 0 else entries

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
        magnitudes = np.zeros(self.shape[0])
        for rows, _, values in self.blocks:
            magnitudes[rows] = np.maximum(magnitudes[rows], np.abs(values).max(axis=1, initial=0.0))
        return magnitudes

    def among(self, rows: np.ndarray, columns: np.ndarray | None = None) -> np.ndarray:
        """Return some rows of some columns, of all by default, as a full matrix."""
        submatrix = np.zeros((len(rows), self.shape[1] if columns is None else len(columns)))
        for block_rows, to, values in self.blocks:
            positions, taken = _places(block_rows, rows)
            if not len(positions):
                continue
            if columns is None:
                column_positions = np.arange(self.shape[1])[to]
                submatrix[np.ix_(positions, column_positions)] += values[taken]
            else:
                column_positions, used = _places(to, columns)
                submatrix[np.ix_(positions, column_positions)] += values[np.ix_(taken, used)]
        return submatrix

    def over(self, columns: slice) -> "Blocks":
        """Return the columns from a first to a last one, between which blocks begin and end, with the blocks there."""
        blocks = [
            (rows, slice(cols.start - columns.start, cols.stop - columns.start), values)
            for rows, cols, values in self.blocks
            if isinstance(cols, slice) and columns.start <= cols.start < cols.stop <= columns.stop
        ]
        return Blocks((self.shape[0], columns.stop - columns.start), blocks)

    def dense(self) -> np.ndarray:
        """Return the full matrix."""
        matrix = np.zeros(self.shape)
        for rows, columns, values in self.blocks:
            matrix[rows, columns] += values
        return matrix

    def diagonal(self) -> np.ndarray:
        """Return the diagonal, (n,)."""
        entries = np.zeros(min(self.shape))
        for rows, columns, values in self.blocks:
            numbers = np.arange(self.shape[0])[rows]
            positions, used = _places(columns, numbers)
            entries[numbers[positions]] += values[positions, used]
        return entries

    def with_diagonal(self, added: np.ndarray) -> "Blocks":
        """Return the sum with a diagonal matrix, (n,), whose blocks are held."""
        blocks = [(rows, columns, values.copy()) for rows, columns, values in self.blocks]
        for rows, columns, values in blocks:
            numbers = np.arange(self.shape[0])[rows]
            positions, used = _places(columns, numbers)
            values[positions, used] += added[numbers[positions]]
        return Blocks(self.shape, blocks)

    def beside_diagonal(self) -> np.ndarray:
        """Return which rows have values beside the diagonal, (n,)."""
        return self.with_diagonal(-self.diagonal()).largest() > 0


def summed(shape: tuple[int, int], blocks: Iterable[tuple[slice, slice, np.ndarray]]) -> Blocks:
    """Return the matrix that is the sum of some blocks, of which those of the same rows and columns are added."""
    sums = dict[tuple[int, int, int, int], np.ndarray]()
    for rows, columns, values in blocks:
        key = rows.start, rows.stop, columns.start, columns.stop
        sums[key] = sums[key] + values if key in sums else values
    return Blocks(shape, [(slice(a, b), slice(c, d), values) for (a, b, c, d), values in sums.items()])


def full(matrix: np.ndarray) -> Blocks:
    """Return a full matrix as one block."""
    rows, columns = matrix.shape
    return Blocks((rows, columns), [(slice(0, rows), slice(0, columns), matrix)])


def _places(index: Index, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which of some numbers stand in a block, and where."""
    if isinstance(index, slice):
        positions = np.flatnonzero((numbers >= index.start) & (numbers < index.stop))
        return positions, numbers[positions] - index.start
    if not len(index):
        return np.empty(0, np.int64), np.empty(0, np.int64)
    entry = np.minimum(np.searchsorted(index, numbers), len(index) - 1)
    positions = np.flatnonzero(index[entry] == numbers)
    return positions, entry[positions]
