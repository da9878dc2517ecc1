"""Global matrices from element matrices: the pairs of nodes that elements share, their blocks added up once.

Only pairs (low, high) are added, one component of the block after the other, so that the matrix is symmetric to the
last bit and never held twice.
"""

import numpy as np
from scipy import sparse


def isotropic(G: np.ndarray, lam: float, mu: float) -> np.ndarray:
    """Return λ G_ij + μ G_ji + μ G_kk δ_ij, the stiffness of products G_ij of gradients along i and j, (e, d, d, …)."""
    stiffness = lam * G + mu * G.swapaxes(1, 2)
    shear = mu * np.einsum("eii...->e...", G)
    for i in range(G.shape[1]):
        stiffness[:, i, i] += shear
    return stiffness


class NodePairs:
    """Pairs of nodes that share an element, (p,), and the number of each element's pairs among them.

    Args:
        cells: Node numbers of the elements, (e, a).
        count: Number of nodes.
    """

    def __init__(self, cells: np.ndarray, count: int) -> None:
        self.first, self.second = np.triu_indices(cells.shape[1])
        """An element's own pairs of nodes, (k,) each, k = a(a + 1)/2."""
        i, j = cells[:, self.first], cells[:, self.second]
        self._swapped = i > j
        keys = np.minimum(i, j).astype(np.int64) * count + np.maximum(i, j)
        pairs, slots = np.unique(keys.ravel(), return_inverse=True)
        self._slots = slots.reshape(keys.shape)
        self._low, self._high = pairs // count, pairs % count
        self._count = count

    def sum_blocks(self, blocks: np.ndarray, cells: slice = slice(None)) -> np.ndarray:
        """Add up blocks (e, d, d, k) of chosen elements over equal pairs, (p, d, d)."""
        blocks = np.where(self._swapped[cells][:, None, None], blocks.transpose(0, 2, 1, 3), blocks)
        slots, d = self._slots[cells].ravel(), blocks.shape[1]
        total = np.empty((len(self._low), d, d))
        for i in range(d):
            for j in range(d):
                total[:, i, j] = np.bincount(slots, blocks[:, i, j].ravel(), len(self._low))
        return total

    def matrix(self, blocks: np.ndarray) -> sparse.csr_matrix:
        """Turn blocks (p, d, d) of the pairs into the symmetric matrix, (d·count, d·count)."""
        d, diagonal = blocks.shape[1], self._low == self._high
        blocks[diagonal] = 0.5 * (blocks[diagonal] + blocks[diagonal].transpose(0, 2, 1))
        starts = np.concatenate([[0], np.cumsum(np.bincount(self._low, minlength=self._count))])
        shape = (d * self._count, d * self._count)
        upper = sparse.bsr_matrix((blocks, self._high, starts), shape=shape)
        lower = upper.T.tobsr((d, d))
        strict = lower.data.copy()
        lower_rows = np.repeat(np.arange(self._count), np.diff(lower.indptr))
        strict[lower_rows == lower.indices] = 0.0
        full = upper + sparse.bsr_matrix((strict, lower.indices, lower.indptr), shape=shape)
        matrix = sparse.csr_matrix(full)
        matrix.sort_indices()
        return matrix
