"""Strains inside elements, scaled to energy: D^½ ε at the points of the smallest Gauss rule.

Straight quadratic solids and bars have linear strains, and so have both kinds of beams in bending and shear. At the
d + 1 points of this rule in d dimensions the strains of a smooth field are most accurate (Barlow 1976).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.elements.reference import extrapolation, quadrature, reference
from gudgeon.pipeline.geometry.cells import Cell, cell_of

GAUSS_ORDER = 2
"""Of the rule with d + 1 points: 4 in a tetrahedron, 3 in a triangle, 2 on a line."""
SHEARS = ((1, 2), (0, 2), (0, 1))
"""Directions of the shear components, in order."""
Strains = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class StrainSamples:
    """Sampling points of the strain in a mesh, and the strain there over the displacements."""

    nodes: np.ndarray
    """Corners and middles of sides [m], (n, 3)."""
    cells: np.ndarray
    """Numbers of each element's corners, then of its middles, (e, a)."""
    points: np.ndarray
    """Sampling points [m], (e, q, 3)."""
    sizes: np.ndarray
    """Volume or length of each element, (e,)."""
    to_nodes: np.ndarray
    """Linear extrapolation from the points to the element's nodes, (a, q)."""
    mass: np.ndarray
    """∫ N_a N_b of a reference element of unit size, quadratic N, (a, a)."""
    components: int
    """Number of strain components, s."""
    strains: Strains
    """From dof columns (dofs, k) to D^½ ε, whose square is the density of twice the strain energy, (e, q, s, k)."""


def continuum_samples(mesh: MeshRecord, D: np.ndarray) -> StrainSamples:
    """Return the samples of a mesh of isoparametric elements with D in xx, yy, zz, yz, xz, xy."""
    _, grad, dx = quadrature(mesh, GAUSS_ORDER)
    return sampled(cell_of(mesh), mesh.nodes, mesh.cells, dx.sum(axis=1), len(D), _from_gradients(mesh, grad, D))


def sampled(
    cell: Cell, nodes: np.ndarray, cells: np.ndarray, sizes: np.ndarray, components: int, strains: Strains
) -> StrainSamples:
    """Return the samples at the Gauss points of quadratic elements."""
    points = np.matmul(reference(cell, GAUSS_ORDER)[0].T, nodes[cells])
    N, _, W = reference(cell, 4)
    mass = (N * W) @ N.T / W.sum()
    return StrainSamples(
        nodes=nodes, cells=cells, points=points, sizes=sizes, to_nodes=extrapolation(cell, GAUSS_ORDER), mass=mass,
        components=components, strains=strains,
    )  # fmt: skip


def elasticity(lam: float, mu: float, d: int) -> np.ndarray:
    """Return D of Lamé's constants [Pa] for strains xx, yy, zz and engineering shears yz, xz, xy, or xx, yy and xy."""
    D = np.diag([2 * mu] * d + [mu] * (d * (d - 1) // 2))
    D[:d, :d] += lam
    return D


def _from_gradients(mesh: MeshRecord, grad: np.ndarray, D: np.ndarray) -> Strains:
    """Return the function from dof columns to D^½ ε, given ∂N/∂x (e, a, d, q) and D in xx, yy, zz, yz, xz, xy."""
    d = grad.shape[2]
    slopes = np.ascontiguousarray(grad.transpose(0, 3, 2, 1)).reshape(len(grad), -1, grad.shape[1])
    pairs = [(i, i) for i in range(d)] + [(i, j) for i, j in SHEARS if max(i, j) < d]
    strain = np.zeros((len(pairs), d, d))
    for row, (i, j) in enumerate(pairs):
        strain[row, i, j] = strain[row, j, i] = 1.0
    # An upper triangle R with RᵀR = D.
    scaled = np.linalg.cholesky(D).T @ strain.reshape(len(pairs), -1)

    def strains(columns: np.ndarray) -> np.ndarray:
        u = columns.reshape(len(mesh.nodes), -1)[mesh.cells]
        slope = (slopes @ u).reshape(len(u), grad.shape[3], d * d, columns.shape[1])
        return scaled @ slope

    return strains
