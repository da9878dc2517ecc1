"""Solid elements: straight and curved tet10. scikit-fem gives shape functions and quadrature.

Tet10 elements are isoparametric: x = Σ N_a x_a, so the true surface is kept to second order. Element matrices are
formed in batches from the scalar basis, G_ij^ab = ∫ ∂_i N_a ∂_j N_b, which is several times faster than vector forms
and equal to them.
"""

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.elements.assembly import NodePairs
from gudgeon.pipeline.fem.elements.materials import densities, elasticity_matrix, material_cells, stiffness_of
from gudgeon.pipeline.fem.elements.reference import (
    MASS_ORDER,
    STIFFNESS_ORDER,
    adjugates,
    determinants,
    jacobians,
    quadrature,
    reference,
)
from gudgeon.pipeline.fem.elements.strain import SHEARS, StrainSamples, continuum_samples, elasticity
from gudgeon.pipeline.fem.model import FEModel, MassProperties, point_masses
from gudgeon.pipeline.geometry.cells import TETRA10
from gudgeon.pipeline.geometry.soundness import refuse_degenerate
from gudgeon.pipeline.scenes.material import Material

BATCH = 4096
"""Elements assembled at once: the largest work array is about 60 MB."""
STRAIGHT = 8 * np.finfo(float).eps
"""Largest distance of a mid-side node from the middle of its edge, over the largest coordinate."""


def assemble_solid(mesh: MeshRecord, material: Material, _: object) -> FEModel:
    """Assemble a solid: elements with straight edges in closed form, curved ones by quadrature."""
    pairs = NodePairs(mesh.cells, len(mesh.nodes))
    stiffness, mass = np.zeros(()), np.zeros(())
    straight, owner = straight_elements(mesh), np.zeros(len(mesh.cells), int)
    materials = material_cells(mesh, material)
    for index, (_, owned) in enumerate(materials):
        owner[owned] = index
    for start in range(0, len(mesh.cells), BATCH):
        cells = slice(start, min(start + BATCH, len(mesh.cells)))
        blocks = np.empty((cells.stop - start, 3, 3, len(pairs.first)))
        weights = np.empty((cells.stop - start, 1, 1, len(pairs.first)))
        for index, (phase, _) in enumerate(materials):
            for kind, form in ((True, _closed_form), (False, _by_quadrature)):
                chosen = (straight[cells] == kind) & (owner[cells] == index)
                if chosen.any():
                    elements = form(mesh, phase, start + np.flatnonzero(chosen), pairs)
                    blocks[chosen], weights[chosen, 0, 0] = elements
        stiffness = stiffness + pairs.sum_blocks(blocks, cells)
        mass = mass + pairs.sum_blocks(weights, cells)
    K = pairs.matrix(stiffness)
    M = sparse.kron(pairs.matrix(mass), sparse.eye(3), format="csr")
    properties = mass_properties(mesh, densities(mesh, material))
    twists, held = solid_twists(properties), np.zeros(K.shape[0], bool)
    return FEModel(
        K=K, M=M, mesh=mesh, directions=np.eye(3), rotations=np.zeros((3, 3)), properties=properties,
        rigid_twists=twists, held=held,
    )  # fmt: skip


def solid_samples(mesh: MeshRecord, material: Material, _: object) -> StrainSamples:
    """Return the samples of the strain in a solid."""
    if material.orthotropic is None:
        return continuum_samples(mesh, elasticity(*material.lame, 3))
    return continuum_samples(mesh, elasticity_matrix(material, [(0, 0), (1, 1), (2, 2), *SHEARS], 1.0))


def straight_elements(mesh: MeshRecord) -> np.ndarray:
    """Return which tet10 have straight edges with the mid-side node in the middle, but for round-off, (e,)."""
    x = mesh.nodes[mesh.cells]
    away = x[:, 4:] - x[:, TETRA10.shape.edges].mean(axis=2)
    return np.abs(away).max(axis=(1, 2)) <= STRAIGHT * np.abs(mesh.nodes).max(initial=0.0)


def _closed_form(
    mesh: MeshRecord, material: Material, cells: np.ndarray, pairs: NodePairs
) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness blocks (e, 3, 3, k) and masses (e, k) of straight tet10, whose ∂ξ/∂x is constant.

    ∫ ∂_i N_a ∂_j N_b is then linear in the nine products ∂_i ξ_m ∂_j ξ_n, with the integrals of ∂N_a/∂ξ_m ∂N_b/∂ξ_n
    on the reference element as coefficients: one matrix product for all elements.
    """
    x = mesh.nodes[mesh.cells[cells]]
    adjugate, det = adjugates((x[:, 1:4] - x[:, :1]).transpose(2, 1, 0))
    refuse_degenerate(x, det[:, None], cells)
    g = adjugate / det
    products = np.einsum("mie,nje->eijmn", g, g)
    strain = stiffness_of(products, material) * det[:, None, None, None, None]
    _, dN, W = reference(TETRA10, 2)
    gradients = np.einsum("amq,bnq,q->mnab", dN, dN, W)[:, :, pairs.first, pairs.second]
    stiffness = strain.reshape(-1, 9) @ gradients.reshape(9, -1)
    N, _, W = reference(TETRA10, 4)
    masses = ((N * W) @ N.T)[pairs.first, pairs.second]
    return stiffness.reshape(len(cells), 3, 3, -1), material.rho * det[:, None] * masses


def _by_quadrature(
    mesh: MeshRecord, material: Material, cells: np.ndarray, pairs: NodePairs
) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness blocks (e, 3, 3, k) and masses (e, k) of curved tet10."""
    _, grad, dx = quadrature(mesh, STIFFNESS_ORDER, cells)
    flat = grad.reshape(len(dx), 30, -1)
    G = np.matmul(flat * dx[:, None], flat.transpose(0, 2, 1)).reshape(-1, 10, 3, 10, 3)
    # Advanced indices apart: the pairs come first.
    G = G[:, pairs.first, :, pairs.second].transpose(1, 2, 3, 0)
    # No gradients are needed at the more numerous points of the mass.
    N, dN, W = reference(TETRA10, MASS_ORDER)
    x = mesh.nodes[mesh.cells[cells]]
    det = determinants(jacobians(x, dN))
    refuse_degenerate(x, det, cells)
    masses = material.rho * np.matmul(N * (det * W)[:, None], N.T)
    return stiffness_of(G, material), masses[:, pairs.first, pairs.second]


def mass_properties(mesh: MeshRecord, rho: float | np.ndarray) -> MassProperties:
    """Integrate mass, centre and inertia of a tet10 mesh over its curved elements, by the rule of the mass matrix.

    Args:
        rho: Density, or that of each element (e,) [kg/m^3].
    """
    N, dN, W = reference(TETRA10, MASS_ORDER)
    x = mesh.nodes[mesh.cells]
    weights = (np.reshape(rho, (-1, 1)) * W * determinants(jacobians(x, dN))).ravel()
    return point_masses(np.matmul(N.T, x).reshape(-1, 3), weights)


def solid_twists(properties: MassProperties) -> np.ndarray:
    """Return the six mass-normalised rigid motions of a solid: x, y, z, rotations about the principal axes, (6, 6)."""
    moments, axes = np.linalg.eigh(properties.inertia)
    twists = np.zeros((6, 6))
    twists[:3, :3] = np.eye(3) / np.sqrt(properties.mass)
    twists[3:, 3:] = (axes / np.sqrt(moments)).T
    return twists
