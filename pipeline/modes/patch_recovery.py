"""Superconvergent patch recovery: smooth strains of a finite element solution (Zienkiewicz & Zhu 1992).

Around each corner node a quadratic polynomial is fitted to the strains at the Gauss points of the elements that share
it. The value at a corner is that of its polynomial, at a node between corners the mean of the polynomials of these.
Patches of few elements, as at edges and corners of the body, include their neighbours; a ridge on the quadratic terms
prevents a fit to noise in flat patches, as under a free surface. Where a mesh has one element across a body of nearly
incompressible material, its strains may be smooth and wrong, as in torsion without warping: there the nodes of free
surfaces lose what has a traction.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy import sparse

from gudgeon.pipeline.fem.elements.strain import StrainSamples

RIDGE = 2e-3
"""Weight of a squared quadratic coefficient against all of a patch's squared samples, lengths scaled to the patch. Half
or twice this value changes the estimates of the reference cases F1 to F4 by 5 %."""
FEWEST = {1: 2, 2: 3, 3: 5}
"""Patches of fewer simplices include the elements that touch them, by dimension; one element of another type, with 5 to
8 points, is enough."""
BATCH = 512
"""Patches, sides or elements processed at once."""


class Recovery:
    """Patches of a mesh. Values are in single precision: an estimate of an error needs few digits.

    Args:
        samples: Of the elements of each type.
        free: Nodes of free surfaces, (b,), and the projection of D^½ ε there on stress without traction, (b, s, s).
    """

    def __init__(self, samples: Sequence[StrainSamples], free: tuple[np.ndarray, np.ndarray] | None = None) -> None:
        self.samples, self._free = samples, free
        self._dimension, self._nodes = samples[0].cell.dimension, samples[0].nodes
        corners = [block.cells[:, : block.cell.shape.corners] for block in samples]
        self._corners = np.unique(np.concatenate([nodes.ravel() for nodes in corners]))
        self._numbers = [np.searchsorted(self._corners, nodes) for nodes in corners]
        self._points = np.concatenate([block.points.reshape(-1, 3) for block in samples])
        self._frame = _frame(self._nodes, self._dimension)
        self._scale = np.empty(len(self._corners))
        self._patches = list(self._fits())
        self._between = self._all_between()

    def error_energy(self, values: Sequence[np.ndarray]) -> np.ndarray:
        """Return ∫ |σ* − σ_h|² over the mesh, the square of recovered minus given values, (k,).

        Args:
            values: D^½ ε at the points of each type's samples, (e, q, s, k).
        """
        s, k = values[0].shape[2:]
        # In units of the largest value: squares of small parts' strains exceed single precision.
        unit = np.max([np.abs(block).max(axis=(0, 1, 2), initial=0.0) for block in values], axis=0)
        unit[unit == 0] = 1.0
        scaled = [(block / unit).reshape(*block.shape[:2], s * k).astype(np.float32) for block in values]
        nodal = self._nodal(np.concatenate([block.reshape(-1, s * k) for block in scaled]))
        total = np.zeros(s * k)
        for samples, flat in zip(self.samples, scaled, strict=True):
            root = np.linalg.cholesky(samples.mass).T.astype(np.float32)
            linear = (root @ samples.to_nodes).astype(np.float32)
            for start in range(0, len(flat), BATCH):
                cells = slice(start, start + BATCH)
                difference = root @ nodal[samples.cells[cells]] - linear @ flat[cells]
                total += samples.sizes[cells] @ np.einsum("eac,eac->ec", difference, difference)
        return unit**2 * total.reshape(s, k).sum(axis=0)

    def _nodal(self, flat: np.ndarray) -> np.ndarray:
        """Return recovered values at the nodes, (n, c), of values at the points, (p, c)."""
        width = flat.shape[1]
        terms = self._patches[0][2].shape[1]
        fitted = np.empty((len(self._corners), terms, width), np.float32)
        for corners, points, fit in self._patches:
            fitted[corners] = fit @ flat[points]
        nodal = np.empty((len(self._nodes), width), np.float32)
        nodal[self._corners] = fitted[:, 0]
        for around, nodes in self._between:
            for start in range(0, len(around), BATCH):
                corners, between = around[start : start + BATCH], nodes[start : start + BATCH]
                values = 0.0
                for column in corners.T:
                    terms = self._terms(self._nodes[between], column).astype(np.float32)
                    values = values + (terms[:, None] @ fitted[column])[:, 0] / corners.shape[1]
                nodal[between] = values
        if self._free is not None:
            nodes, projection = self._free
            at_nodes = nodal[nodes].reshape(*projection.shape[:2], -1)
            nodal[nodes] = (projection.astype(np.float32) @ at_nodes).reshape(len(nodes), width)
        return nodal

    def _fits(self) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Yield patches of about equal size: corners (b,), points (b, w), and least-squares matrices from values there
        to coefficients, (b, terms, w)."""
        touching = self._touching()
        sizes = np.diff(touching.indptr)
        order = np.argsort(sizes, kind="stable")
        quadratic = slice(self._dimension + 1, None)
        for start in range(0, len(order), BATCH):
            corners = order[start : start + BATCH]
            slots = np.arange(int(sizes[corners[-1]]))
            there = slots < sizes[corners][:, None]
            # Smaller patches are filled with their first point, with weight zero.
            numbers = touching.indices[touching.indptr[corners][:, None] + np.where(there, slots, 0)]
            points = self._points[numbers]
            squares = ((points - self._nodes[self._corners[corners]][:, None]) ** 2).sum(axis=2)
            self._scale[corners] = np.sqrt(squares.max(axis=1))
            terms = self._terms(points, corners) * there[:, :, None]
            normal = terms.transpose(0, 2, 1) @ terms
            ridge = np.arange(normal.shape[1])[quadratic]
            normal[:, ridge, ridge] += RIDGE * sizes[corners][:, None]
            yield corners, numbers, np.linalg.solve(normal, terms.transpose(0, 2, 1)).astype(np.float32)

    def _touching(self) -> sparse.csr_matrix:
        """Return the points of each corner's patch as a sparse pattern, (corners, p)."""
        corners = np.concatenate([np.full(len(numbers), numbers.shape[1]) for numbers in self._numbers])
        elements = np.repeat(np.arange(len(corners)), corners)
        indices = np.concatenate([numbers.ravel() for numbers in self._numbers]), elements
        shape = (len(self._corners), len(corners))
        incidence = sparse.csr_matrix((np.ones(len(indices[0]), np.int32), indices), shape=shape)
        fewest = FEWEST[self._dimension]
        few = np.flatnonzero(incidence @ np.where(corners > self._dimension + 1, fewest, 1) < fewest)
        if len(few):
            neighbours = sparse.coo_matrix(incidence[few] @ incidence.T @ incidence)
            spread = sparse.csr_matrix((neighbours.data, (few[neighbours.row], neighbours.col)), shape=shape)
            incidence = sparse.csr_matrix(incidence + spread)
        per_element = np.concatenate([np.full(len(block.points), block.points.shape[1]) for block in self.samples])
        owner = np.repeat(np.arange(len(corners)), per_element)
        points = sparse.csr_matrix((np.ones(len(owner), np.int32), (owner, np.arange(len(owner)))))
        return sparse.csr_matrix(incidence @ points)

    def _all_between(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return the corners around nodes that are none, (m, g), and these nodes, (m,), by the number g of corners."""
        groups: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}
        for samples, numbers in zip(self.samples, self._numbers, strict=True):
            for k, around in enumerate(samples.cell.centres, samples.cell.shape.corners):
                groups.setdefault(len(around), []).append((numbers[:, around], samples.cells[:, k]))
        between = []
        for pairs in groups.values():
            corners, nodes = (np.concatenate(column) for column in zip(*pairs, strict=True))
            nodes, rows = np.unique(nodes, return_index=True)
            between.append((corners[rows], nodes))
        return between

    def _terms(self, points: np.ndarray, corners: np.ndarray) -> np.ndarray:
        """Return 1, x, x xᵀ at points (b, …, 3) relative to a corner each, scaled by its patch, (b, …, terms)."""
        middle = (slice(None),) + (None,) * (points.ndim - 2)
        x = (points - self._nodes[self._corners[corners]][middle]) @ self._frame.T
        x = x / self._scale[corners][(*middle, None)]
        pairs = [(i, j) for i in range(self._dimension) for j in range(i, self._dimension)]
        squares = np.stack([x[..., i] * x[..., j] for i, j in pairs], axis=-1)
        return np.concatenate([np.ones((*x.shape[:-1], 1)), x, squares], axis=-1)


def _frame(nodes: np.ndarray, dimension: int) -> np.ndarray:
    """Return orthonormal directions in which a mesh extends, (dimension, 3)."""
    if dimension == 3:
        return np.eye(3)
    return np.linalg.svd(nodes - nodes.mean(axis=0), full_matrices=False)[2][:dimension]
