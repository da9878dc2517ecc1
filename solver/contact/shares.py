"""Points of a contact as weighted sums of the points of an interface in the record, (c, k)."""

import numpy as np
from scipy import sparse


def identity(count: int) -> sparse.csr_matrix:
    """Return the shares of points that are those of the record, in their order."""
    return sparse.csr_matrix(sparse.identity(count, format="csr"))


def chosen(order: np.ndarray, count: int) -> sparse.csr_matrix:
    """Return the shares of points that are some of the record's `count` ones, given by their numbers, (c,)."""
    return sparse.csr_matrix((np.ones(len(order)), (np.arange(len(order)), order)), (len(order), count))


def shared(weights: sparse.csr_matrix, rows: np.ndarray) -> np.ndarray:
    """Return rows of the record, (k, …), at the points of a contact, (c, …)."""
    return np.asarray(weights @ rows)


def shared_columns(weights: sparse.csr_matrix, columns: np.ndarray) -> np.ndarray:
    """Return columns of the record, (…, k), at the points of a contact, (…, c)."""
    return np.asarray(weights @ columns.T).T


def shared_twice(weights: sparse.csr_matrix, matrix: np.ndarray, column_weights: sparse.csr_matrix) -> np.ndarray:
    """Return a matrix between points of the record, (k, l), between the points of contacts, (c, d)."""
    return shared_columns(column_weights, shared(weights, matrix))


def padded(weights: sparse.csr_matrix) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of the record's points of each point and their shares, (c, n) each; padded by 0 of point 0."""
    counts = np.diff(weights.indptr)
    column = np.arange(weights.nnz) - np.repeat(weights.indptr[:-1], counts)
    row = np.repeat(np.arange(len(counts)), counts)
    numbers = np.zeros((len(counts), max(int(counts.max(initial=0)), 1)), np.int64)
    amounts = np.zeros(numbers.shape)
    numbers[row, column], amounts[row, column] = weights.indices, weights.data
    return numbers, amounts
