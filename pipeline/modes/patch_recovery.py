"""Superconvergent patch recovery: smooth strains of a finite element solution (Zienkiewicz & Zhu 1992).

Around each corner node a quadratic polynomial is fitted to the strains at the Gauss points of the elements that share
it. The value at a corner is that of its polynomial, at the middle of a side the mean of the polynomials of its corners.
Patches of few elements, as at edges and corners of the body, include their neighbours; a ridge on the quadratic terms
prevents a fit to noise in flat patches, as under a free surface.
"""

from collections.abc import Iterator

import numpy as np
from scipy import sparse

from gudgeon.pipeline.fem.elements.strain import StrainSamples
from gudgeon.pipeline.geometry.cells import EDGES

RIDGE = 2e-3
"""Weight of a squared quadratic coefficient against all of a patch's squared samples, lengths scaled to the patch. Half
or twice this value changes the estimates of the reference cases F1 to F4 by 5 %."""
FEWEST = {1: 2, 2: 3, 3: 5}
"""Patches of fewer elements include the elements that touch them, by dimension."""
BATCH = 512
"""Patches, sides or elements processed at once."""


class Recovery:
    """Patches of a mesh. Values are in single precision: an estimate of an error needs few digits."""

    def __init__(self, samples: StrainSamples) -> None:
        self.samples = samples
        self._dimension = samples.points.shape[1] - 1
        self._corners, numbers = np.unique(samples.cells[:, : self._dimension + 1], return_inverse=True)
        self._numbers = numbers.reshape(len(samples.cells), -1)
        self._frame = _frame(samples.nodes, self._dimension)
        self._scale = np.empty(len(self._corners))
        self._patches = list(self._fits())
        self._sides, self._middles = self._all_sides()

    def error_energy(self, values: np.ndarray) -> np.ndarray:
        """Return ∫ |σ* − σ_h|² over the mesh, the square of recovered minus given values, (k,).

        Args:
            values: D^½ ε at the samples' points, (e, q, s, k).
        """
        count, q, s, k = values.shape
        # In units of the largest value: squares of small parts' strains exceed single precision.
        unit = np.abs(values).max(axis=(0, 1, 2), initial=0.0)
        unit[unit == 0] = 1.0
        flat = (values / unit).reshape(count, q, s * k).astype(np.float32)
        nodal = self._nodal(flat)
        root = np.linalg.cholesky(self.samples.mass).T.astype(np.float32)
        linear = (root @ self.samples.to_nodes).astype(np.float32)
        total = np.zeros(s * k)
        for start in range(0, count, BATCH):
            cells = slice(start, start + BATCH)
            difference = root @ nodal[self.samples.cells[cells]] - linear @ flat[cells]
            total += self.samples.sizes[cells] @ np.einsum("eac,eac->ec", difference, difference)
        return unit**2 * total.reshape(s, k).sum(axis=0)

    def _nodal(self, flat: np.ndarray) -> np.ndarray:
        """Return recovered values at the nodes, (n, c)."""
        width = flat.shape[2]
        terms = self._patches[0][2].shape[1]
        fitted = np.empty((len(self._corners), terms, width), np.float32)
        for corners, elements, fit in self._patches:
            fitted[corners] = fit @ flat[elements].reshape(len(corners), -1, width)
        nodal = np.empty((len(self.samples.nodes), width), np.float32)
        nodal[self._corners] = fitted[:, 0]
        for start in range(0, len(self._sides), BATCH):
            sides, middles = self._sides[start : start + BATCH], self._middles[start : start + BATCH]
            values = 0.0
            for end in range(2):
                terms = self._terms(self.samples.nodes[middles], sides[:, end]).astype(np.float32)
                values = values + (terms[:, None] @ fitted[sides[:, end]])[:, 0] / 2
            nodal[middles] = values
        return nodal

    def _fits(self) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Yield patches of about equal size: corners (b,), elements (b, w), and least-squares matrices from values at
        their points to coefficients, (b, terms, w·q)."""
        touching = self._touching()
        sizes = np.diff(touching.indptr)
        order = np.argsort(sizes, kind="stable")
        quadratic = slice(self._dimension + 1, None)
        for start in range(0, len(order), BATCH):
            corners = order[start : start + BATCH]
            width = int(sizes[corners[-1]])
            slots = np.arange(width)
            there = slots < sizes[corners][:, None]
            # Smaller patches are filled with their first element, with weight zero.
            elements = touching.indices[touching.indptr[corners][:, None] + np.where(there, slots, 0)]
            points = self.samples.points[elements]
            squares = ((points - self.samples.nodes[self._corners[corners]][:, None, None]) ** 2).sum(axis=3)
            self._scale[corners] = np.sqrt(squares.max(axis=(1, 2)))
            terms = self._terms(points.reshape(len(corners), -1, 3), corners)
            terms *= np.repeat(there, points.shape[2], axis=1)[:, :, None]
            normal = terms.transpose(0, 2, 1) @ terms
            ridge = np.arange(normal.shape[1])[quadratic]
            normal[:, ridge, ridge] += RIDGE * points.shape[2] * sizes[corners][:, None]
            yield corners, elements, np.linalg.solve(normal, terms.transpose(0, 2, 1)).astype(np.float32)

    def _touching(self) -> sparse.csr_matrix:
        """Return the elements of each corner's patch as a sparse pattern, (corners, e)."""
        count, per_cell = self._numbers.shape
        elements = np.repeat(np.arange(count), per_cell)
        shape = (len(self._corners), count)
        incidence = sparse.csr_matrix(
            (np.ones(len(elements), np.int32), (self._numbers.ravel(), elements)), shape=shape
        )
        few = np.flatnonzero(np.diff(incidence.indptr) < FEWEST[self._dimension])
        if len(few):
            neighbours = sparse.coo_matrix(incidence[few] @ incidence.T @ incidence)
            spread = sparse.csr_matrix((neighbours.data, (few[neighbours.row], neighbours.col)), shape=shape)
            incidence = sparse.csr_matrix(incidence + spread)
        return incidence

    def _all_sides(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the two corners of each side, (sides, 2), and the node in its middle, (sides,)."""
        ends = self._numbers[:, EDGES[self._dimension]].reshape(-1, 2)
        nodes, side_ids = np.unique(self.samples.cells[:, self._dimension + 1 :], return_index=True)
        return ends[side_ids], nodes

    def _terms(self, points: np.ndarray, corners: np.ndarray) -> np.ndarray:
        """Return 1, x, x xᵀ at points (b, …, 3) relative to a corner each, scaled by its patch, (b, …, terms)."""
        middle = (slice(None),) + (None,) * (points.ndim - 2)
        x = (points - self.samples.nodes[self._corners[corners]][middle]) @ self._frame.T
        x = x / self._scale[corners][(*middle, None)]
        pairs = [(i, j) for i in range(self._dimension) for j in range(i, self._dimension)]
        squares = np.stack([x[..., i] * x[..., j] for i, j in pairs], axis=-1)
        return np.concatenate([np.ones((*x.shape[:-1], 1)), x, squares], axis=-1)


def _frame(nodes: np.ndarray, dimension: int) -> np.ndarray:
    """Return orthonormal directions in which a mesh extends, (dimension, 3)."""
    if dimension == 3:
        return np.eye(3)
    return np.linalg.svd(nodes - nodes.mean(axis=0), full_matrices=False)[2][:dimension]
