"""Strains inside elements, scaled to energy: D^½ ε at the points of the smallest Gauss rule.

Straight quadratic simplices and bars have linear strains, and so have both kinds of beams in bending and shear. At the
d + 1 points of this rule in d dimensions, and the 2 × 2 × 2 of hexahedra, the strains of a smooth field are most
accurate (Barlow 1976).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.elements.incompatible import mode_slopes
from gudgeon.pipeline.fem.elements.reference import extrapolation, quadrature, reference
from gudgeon.pipeline.geometry.cells import Cell, block_meshes, cell_of
from gudgeon.pipeline.scenes.material import Material

GAUSS_ORDER = 2
"""Of the rule with d + 1 points: 4 in a tetrahedron, 3 in a triangle, 2 on a line; 8 in a hexahedron."""
BATCH = 2048
"""Elements whose gradients are in memory at once."""
SHEARS = ((1, 2), (0, 2), (0, 1))
"""Directions of the shear components, in order."""
Strains = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class StrainSamples:
    """Sampling points of the strain in the elements of one type, and the strain there over the displacements."""

    cell: Cell
    nodes: np.ndarray
    """All nodes of the mesh, and those between the corners of its beams [m], (n, 3)."""
    cells: np.ndarray
    """Nodes of each element, (e, a)."""
    points: np.ndarray
    """Sampling points [m], (e, q, 3)."""
    sizes: np.ndarray
    """Volume or length of each element, (e,)."""
    to_nodes: np.ndarray
    """Extrapolation from the points to the element's nodes, (a, q)."""
    mass: np.ndarray
    """∫ N_a N_b of a reference element of unit size, (a, a)."""
    components: int
    """Number of strain components, s."""
    strains: Strains
    """From dof columns (dofs, k) to D^½ ε, whose square is the density of twice the strain energy, (e, q, s, k)."""


def continuum_samples(mesh: MeshRecord, D: np.ndarray, material: Material) -> list[StrainSamples]:
    """Return the samples of a mesh of isoparametric elements with D in xx, yy, zz, yz, xz, xy, type by type.

    Args:
        material: Of incompatible modes.
    """
    samples = []
    for _, block in block_meshes(mesh):
        sizes = np.concatenate([quadrature(block, GAUSS_ORDER, batch)[2].sum(axis=1) for batch in _batches(block)])
        strains = _from_gradients(block, D, material)
        samples.append(sampled(cell_of(block), block.nodes, block.cells, sizes, len(D), strains))
    return samples


def sampled(
    cell: Cell, nodes: np.ndarray, cells: np.ndarray, sizes: np.ndarray, components: int, strains: Strains
) -> StrainSamples:
    """Return the samples at the Gauss points of elements of one type."""
    points = np.matmul(reference(cell, GAUSS_ORDER)[0].T, nodes[cells])
    N, _, W = reference(cell, 4)
    mass = (N * W) @ N.T / W.sum()
    return StrainSamples(
        cell=cell, nodes=nodes, cells=cells, points=points, sizes=sizes, mass=mass,
        to_nodes=extrapolation(cell, GAUSS_ORDER), components=components, strains=strains,
    )  # fmt: skip


def _batches(mesh: MeshRecord) -> list[np.ndarray]:
    return [np.arange(start, min(start + BATCH, len(mesh.cells))) for start in range(0, len(mesh.cells), BATCH)]


def elasticity(lam: float, mu: float, d: int) -> np.ndarray:
    """Return D of Lamé's constants [Pa] for strains xx, yy, zz and engineering shears yz, xz, xy, or xx, yy and xy."""
    D = np.diag([2 * mu] * d + [mu] * (d * (d - 1) // 2))
    D[:d, :d] += lam
    return D


def _from_gradients(mesh: MeshRecord, D: np.ndarray, material: Material) -> Strains:
    """Return the function from dof columns to D^½ ε at the Gauss points, with D in xx, yy, zz, yz, xz, xy."""
    d = cell_of(mesh).dimension
    pairs = [(i, i) for i in range(d)] + [(i, j) for i, j in SHEARS if max(i, j) < d]
    strain = np.zeros((len(pairs), d, d))
    for row, (i, j) in enumerate(pairs):
        strain[row, i, j] = strain[row, j, i] = 1.0
    # An upper triangle R with RᵀR = D.
    scaled = np.linalg.cholesky(D).T @ strain.reshape(len(pairs), -1)

    def strains(columns: np.ndarray) -> np.ndarray:
        nodal, values = columns.reshape(len(mesh.nodes), -1), []
        for batch in _batches(mesh):
            _, grad, dx = quadrature(mesh, GAUSS_ORDER, batch)
            u = nodal[mesh.cells[batch]]
            slopes = np.ascontiguousarray(grad.transpose(0, 3, 2, 1)).reshape(len(grad), -1, grad.shape[1])
            slope = (slopes @ u).reshape(len(u), grad.shape[3], d * d, columns.shape[1])
            if "incompatible" in mesh.formulations:
                fields = u.reshape(*u.shape[:2], d, -1)
                slope += mode_slopes(mesh.nodes[mesh.cells[batch]], grad, dx, material, fields).reshape(slope.shape)
            values.append(scaled @ slope)
        return np.concatenate(values)

    return strains
