"""Which rows of a mechanism are coupled through a body, and the order in which S has a small envelope."""

from collections import Counter

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from gudgeon.solver.integrators.turning.arrays import NONE


def coupled(row_terms: np.ndarray, kinds: np.ndarray, owner: np.ndarray) -> np.ndarray:
    """Return the pairs of blocks of rows i ≥ j that belong to one body, (P, 4).

    Args:
        row_terms: As of `Model`, (m, 2).
        kinds: Its terms, (t, 4).
        owner: Bodies of each pair of markers, (J, 2).
    """
    pairs, by_body = [], {}
    for i, two in enumerate(row_terms):
        for k, t in enumerate(two):
            for side in range(2):
                if t != NONE and (b := int(owner[kinds[t, 1], side])) != NONE:
                    by_body.setdefault(b, []).append((i, 2 * k + side))
    for blocks in by_body.values():
        pairs += [(i, j, p, q) for i, p in blocks for j, q in blocks if i >= j]
    return np.array(pairs, np.int64).reshape(-1, 4)


def envelope(pairs: np.ndarray, rows: int) -> np.ndarray:
    """Return an order of the rows by Cuthill and McKee, reversed (George and Liu 1981), with first columns of rows and
    ends of columns in it.

    Args:
        pairs: As `coupled` returns them.
        rows: Their number m.

    Returns:
        As `Model.envelope`, (m, 3).
    """
    if not rows:
        return np.empty((0, 3), np.int64)
    i, j = pairs[:, 0], pairs[:, 1]
    graph = coo_array((np.ones(len(i)), (i, j)), (rows, rows)).tocsr()
    order = np.asarray(reverse_cuthill_mckee((graph + graph.T).tocsr(), symmetric_mode=True), np.int64)
    position = np.empty(rows, np.int64)
    position[order] = np.arange(rows)
    starts = np.arange(rows)
    ends = np.sort(np.column_stack([position[i], position[j]]), axis=1)
    np.minimum.at(starts, ends[:, 1], ends[:, 0])
    end = np.arange(1, rows + 1)
    for row, column in enumerate(starts):
        end[column:row] = row + 1
    return np.column_stack([order, starts, end])


def groups(keys: list[tuple[str, bool]]) -> np.ndarray:
    """Return the first of the rows with the same key and how many they are, of each row, (m, 2).

    Args:
        keys: Joint of each row, and whether it is of a length.
    """
    start, count = {}, Counter(keys)
    for i, key in enumerate(keys):
        start.setdefault(key, i)
    return np.array([(start[key], count[key]) for key in keys], np.int64).reshape(-1, 2)
