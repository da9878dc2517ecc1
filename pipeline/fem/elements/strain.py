"""Strains inside elements, scaled to energy: D^½ ε at the points of the smallest Gauss rule.

Straight quadratic solids and bars have linear strains, and so have both kinds of beams in bending and shear. At the
d + 1 points of this rule in d dimensions the strains of a smooth field are most accurate (Barlow 1976).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.elements.beam import element_lengths, hermite_curvature, timoshenko_strains
from gudgeon.pipeline.fem.elements.materials import elasticity_matrix
from gudgeon.pipeline.fem.elements.plane import plane_lame
from gudgeon.pipeline.fem.elements.reference import extrapolation, quadrature, reference
from gudgeon.pipeline.geometry.shapes.beam import Beam
from gudgeon.pipeline.geometry.shapes.plane import PlanePart
from gudgeon.pipeline.scenes.material import Material

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


def strain_samples(mesh: MeshRecord, material: Material, geometry: BaseModel | None) -> StrainSamples | None:
    """Return the strain samples of a mesh of one material; None for cell types without them."""
    make = SAMPLERS.get(mesh.cell_type)
    return None if make is None else make(mesh, material, geometry)


def _continuum(mesh: MeshRecord, material: Material, geometry: BaseModel | None) -> StrainSamples:
    _, grad, dx = quadrature(mesh, GAUSS_ORDER)
    if mesh.cell_type == "tetra10":
        D = elasticity(*material.lame, 3)
        if material.orthotropic is not None:
            D = elasticity_matrix(material, [(0, 0), (1, 1), (2, 2), *SHEARS], 1.0)
    elif isinstance(geometry, PlanePart):
        D = geometry.thickness * elasticity(*plane_lame(material, geometry), 2)
    elif mesh.cell_type == "line3":
        D = next(iter(mesh.surfaces.values())).shape["area"] * np.array([[material.E]])
    else:
        raise TypeError("a mesh of type triangle6 needs its plane geometry")
    return _sampled(mesh.cell_type, mesh.nodes, mesh.cells, dx.sum(axis=1), len(D), _from_gradients(mesh, grad, D))


def _beam(mesh: MeshRecord, material: Material, geometry: BaseModel | None) -> StrainSamples:
    if not isinstance(geometry, Beam):
        raise TypeError(f"a mesh of type {mesh.cell_type} needs its Beam geometry")
    N, _, _ = reference("line3", GAUSS_ORDER)
    h, section = element_lengths(mesh), geometry.section
    xi = 2 * (N[1] + N[2] / 2) - 1
    nodes, cells = mesh.nodes, mesh.cells
    bending = np.sqrt(material.E * section.second_moment)
    if mesh.cell_type == "beam2":
        rows = bending * hermite_curvature(h, xi)[:, :, None]
        middles = nodes[cells].mean(axis=1)
        nodes, cells = np.vstack([nodes, middles]), np.column_stack([cells, len(nodes) + np.arange(len(cells))])
    else:
        bend, shear = timoshenko_strains(h, xi)
        G = material.E / 2 / (1 + material.nu)
        rows = np.stack([bending * bend, np.sqrt(geometry.shear_coefficient * G * section.area) * shear], axis=2)
    dofs = (2 * mesh.cells[:, :, None] + np.arange(2)).reshape(len(h), -1)

    def strains(columns: np.ndarray) -> np.ndarray:
        return np.einsum("eqsd,edk->eqsk", rows, columns[dofs])

    return _sampled("line3", nodes, cells, h, rows.shape[2], strains)


def _sampled(
    cell_type: str, nodes: np.ndarray, cells: np.ndarray, sizes: np.ndarray, components: int, strains: Strains
) -> StrainSamples:
    """Return the samples at the Gauss points of quadratic elements."""
    points = np.matmul(reference(cell_type, GAUSS_ORDER)[0].T, nodes[cells])
    N, _, W = reference(cell_type, 4)
    mass = (N * W) @ N.T / W.sum()
    return StrainSamples(
        nodes=nodes, cells=cells, points=points, sizes=sizes, to_nodes=extrapolation(cell_type, GAUSS_ORDER),
        mass=mass, components=components, strains=strains,
    )  # fmt: skip


SAMPLERS: dict[str, Callable[[MeshRecord, Material, BaseModel | None], StrainSamples]] = {
    "tetra10": _continuum,
    "triangle6": _continuum,
    "line3": _continuum,
    "beam2": _beam,
    "beam3": _beam,
}


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
