"""Solid elements, straight and curved, of one type or of several: isoparametric, x = Σ N_a x_a.

Curved edges keep the true surface to second order. Element matrices are formed in batches from the scalar basis,
G_ij^ab = ∫ ∂_i N_a ∂_j N_b, which is several times faster than vector forms and equal to them.
"""

from collections.abc import Callable, Sequence
from functools import reduce
from operator import add

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.elements.assembly import NodePairs
from gudgeon.pipeline.fem.elements.incompatible import incompatible_stiffness
from gudgeon.pipeline.fem.elements.materials import densities, elasticity_matrix, material_cells, stiffness_of
from gudgeon.pipeline.fem.elements.reference import (
    LINEAR_ORDERS,
    adjugates,
    determinants,
    jacobians,
    orders,
    quadrature,
    reference,
)
from gudgeon.pipeline.fem.elements.strain import SHEARS, StrainSamples, continuum_samples, elasticity
from gudgeon.pipeline.fem.model import FEModel, MassProperties, point_masses
from gudgeon.pipeline.geometry.cells import TETRA10, block_meshes, cell_of
from gudgeon.pipeline.geometry.soundness import refuse_degenerate
from gudgeon.pipeline.scenes.material import Material

BATCH = 4096
"""Tetrahedra of ten nodes assembled at once, of other elements by the squares of their numbers of nodes: the largest
work array is about 60 MB."""
REDUCED_ORDER, UNSEEN = 2, 1e-5
"""Degree of the rule of 2 × 2 × 2 points, and the share of the full stiffness and mass with theirs."""
STRAIGHT = 8 * np.finfo(float).eps
"""Largest distance of a mid-side node from the middle of its edge, over the largest coordinate."""


def assemble_solid(mesh: MeshRecord, material: Material, _: object) -> FEModel:
    """Assemble a solid: tetrahedra with straight edges in closed form, other elements by quadrature."""
    owner, materials = np.zeros(len(mesh.cells), int), material_cells(mesh, material)
    for index, (_, owned) in enumerate(materials):
        owner[owned] = index
    phases = [phase for phase, _ in materials]
    matrices = [_block_matrices(block, phases, owner[rows], rows) for rows, block in block_meshes(mesh)]
    K, mass = (reduce(add, blocks) for blocks in zip(*matrices, strict=True))
    properties = mass_properties(mesh, densities(mesh, material), as_assembled=True)
    twists, held = solid_twists(properties), np.zeros(K.shape[0], bool)
    return FEModel(
        K=K, M=sparse.kron(mass, sparse.eye(3), format="csr"), mesh=mesh, directions=np.eye(3),
        rotations=np.zeros((3, 3)), properties=properties, rigid_twists=twists, held=held,
    )  # fmt: skip


def _block_matrices(
    mesh: MeshRecord, phases: Sequence[Material], owner: np.ndarray, numbers: np.ndarray
) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Return the stiffness and the mass per direction of the elements of one type.

    Args:
        owner: Number of each element's material, (e,).
        numbers: Of each element in the whole mesh, (e,), for messages.
    """
    pairs, count = NodePairs(mesh.cells, len(mesh.nodes)), len(mesh.cells)
    stiffness, mass = np.zeros(()), np.zeros(())
    form = FORMULATIONS[next(iter(mesh.formulations), "")]
    straight = straight_elements(mesh) if cell_of(mesh) is TETRA10 else np.zeros(count, bool)
    batch = max(1, BATCH * 100 // mesh.cells.shape[1] ** 2)
    for start in range(0, count, batch):
        cells = slice(start, min(start + batch, count))
        blocks = np.empty((cells.stop - start, 3, 3, len(pairs.first)))
        weights = np.empty((cells.stop - start, 1, 1, len(pairs.first)))
        for index, phase in enumerate(phases):
            for closed in (False, True):
                chosen = (straight[cells] == closed) & (owner[cells] == index)
                if chosen.any():
                    element_ids = start + np.flatnonzero(chosen)
                    elements = (_closed_form if closed else form)(mesh, phase, element_ids, numbers, pairs)
                    blocks[chosen], weights[chosen, 0, 0] = elements
        stiffness = stiffness + pairs.sum_blocks(blocks, cells)
        mass = mass + pairs.sum_blocks(weights, cells)
    return pairs.matrix(stiffness), pairs.matrix(mass)


def solid_samples(mesh: MeshRecord, material: Material, _: object) -> list[StrainSamples]:
    """Return the samples of the strain in a solid."""
    if material.orthotropic is None:
        return continuum_samples(mesh, elasticity(*material.lame, 3), material)
    return continuum_samples(mesh, elasticity_matrix(material, [(0, 0), (1, 1), (2, 2), *SHEARS], 1.0), material)


def straight_elements(mesh: MeshRecord) -> np.ndarray:
    """Return which tet10 have straight edges with the mid-side node in the middle, but for round-off, (e,)."""
    x = mesh.nodes[mesh.cells]
    away = x[:, 4:] - x[:, TETRA10.shape.edges].mean(axis=2)
    return np.abs(away).max(axis=(1, 2)) <= STRAIGHT * np.abs(mesh.nodes).max(initial=0.0)


def _closed_form(
    mesh: MeshRecord, material: Material, cells: np.ndarray, numbers: np.ndarray, pairs: NodePairs
) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness blocks (e, 3, 3, k) and masses (e, k) of straight tet10, whose ∂ξ/∂x is constant.

    ∫ ∂_i N_a ∂_j N_b is then linear in the nine products ∂_i ξ_m ∂_j ξ_n, with the integrals of ∂N_a/∂ξ_m ∂N_b/∂ξ_n
    on the reference element as coefficients: one matrix product for all elements.
    """
    x = mesh.nodes[mesh.cells[cells]]
    adjugate, det = adjugates((x[:, 1:4] - x[:, :1]).transpose(2, 1, 0))
    refuse_degenerate(x, det[:, None], numbers[cells])
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
    mesh: MeshRecord, material: Material, cells: np.ndarray, numbers: np.ndarray, pairs: NodePairs
) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness blocks (e, 3, 3, k) and masses (e, k) of elements in full integration."""
    order, _ = orders(cell_of(mesh))
    return _stiffness(mesh, material, cells, numbers, pairs, order), _masses(mesh, material, cells, numbers, pairs)


def _reduced(
    mesh: MeshRecord, material: Material, cells: np.ndarray, numbers: np.ndarray, pairs: NodePairs
) -> tuple[np.ndarray, np.ndarray]:
    """Return the same by 2 × 2 × 2 points, as CalculiX does: motions that they do not see have no mass either.

    `UNSEEN` of the stiffness and of the mass in full integration keep such motions of a single row of elements apart
    from rest, and the mass positive.
    """
    full, _ = orders(cell_of(mesh))
    stiffness = (1 - UNSEEN) * _stiffness(mesh, material, cells, numbers, pairs, REDUCED_ORDER)
    stiffness += UNSEEN * _stiffness(mesh, material, cells, numbers, pairs, full)
    return stiffness, _masses(mesh, material, cells, numbers, pairs)


def _incompatible(
    mesh: MeshRecord, material: Material, cells: np.ndarray, numbers: np.ndarray, pairs: NodePairs
) -> tuple[np.ndarray, np.ndarray]:
    """Return the same of hexahedra of 8 nodes with incompatible modes, see `elements.incompatible`."""
    _, grad, dx = quadrature(mesh, LINEAR_ORDERS[0], cells, numbers)
    K = incompatible_stiffness(mesh.nodes[mesh.cells[cells]], grad, dx, material)
    return K[:, pairs.first, :, pairs.second].transpose(1, 2, 3, 0), _masses(mesh, material, cells, numbers, pairs)


Form = Callable[[MeshRecord, Material, np.ndarray, np.ndarray, NodePairs], tuple[np.ndarray, np.ndarray]]
FORMULATIONS: dict[str, Form] = {"": _by_quadrature, "incompatible": _incompatible, "reduced": _reduced}
"""By name, see `MeshRecord.formulations`; all others are integrated in full."""


def _stiffness(
    mesh: MeshRecord, material: Material, cells: np.ndarray, numbers: np.ndarray, pairs: NodePairs, order: int
) -> np.ndarray:
    """Return stiffness blocks (e, 3, 3, k) by the quadrature of a degree."""
    _, grad, dx = quadrature(mesh, order, cells, numbers)
    flat, a = grad.reshape(len(dx), -1, dx.shape[1]), mesh.cells.shape[1]
    G = np.matmul(flat * dx[:, None], flat.transpose(0, 2, 1)).reshape(-1, a, 3, a, 3)
    # Advanced indices apart: the pairs come first.
    return stiffness_of(G[:, pairs.first, :, pairs.second].transpose(1, 2, 3, 0), material)


def _masses(
    mesh: MeshRecord, material: Material, cells: np.ndarray, numbers: np.ndarray, pairs: NodePairs
) -> np.ndarray:
    """Return masses (e, k); no gradients are needed at their more numerous points."""
    x, masses = mesh.nodes[mesh.cells[cells]], np.zeros((len(numbers[cells]), len(pairs.first)))
    for order, fraction in _mass_orders(mesh).items():
        N, dN, W = reference(cell_of(mesh), order)
        det = determinants(jacobians(x, dN))
        refuse_degenerate(x, det, numbers[cells])
        masses += fraction * (det * W) @ (N[pairs.first] * N[pairs.second]).T
    return material.rho * masses


def _mass_orders(mesh: MeshRecord) -> dict[int, float]:
    """Return the shares of the rules by which the mass of cells is integrated, by their degree."""
    full = orders(cell_of(mesh))[1]
    return {REDUCED_ORDER: 1 - UNSEEN, full: UNSEEN} if "reduced" in mesh.formulations else {full: 1.0}


def mass_properties(mesh: MeshRecord, rho: float | np.ndarray, *, as_assembled: bool = False) -> MassProperties:
    """Integrate mass, centre and inertia of a solid over its curved elements, by the full rule of the mass matrix.

    Args:
        rho: Density, or that of each element (e,) [kg/m^3].
        as_assembled: By the rule of reduced integration where elements have it, as M is.
    """
    points, weights = [], []
    for rows, block in block_meshes(mesh):
        x = mesh.nodes[block.cells]
        density = np.reshape(rho, (-1, 1)) if np.ndim(rho) == 0 else np.asarray(rho)[rows, None]
        for order, fraction in (_mass_orders(block) if as_assembled else {orders(cell_of(block))[1]: 1.0}).items():
            N, dN, W = reference(cell_of(block), order)
            weights.append((fraction * density * W * determinants(jacobians(x, dN))).ravel())
            points.append(np.matmul(N.T, x).reshape(-1, 3))
    return point_masses(np.concatenate(points), np.concatenate(weights))


def solid_twists(properties: MassProperties) -> np.ndarray:
    """Return the six mass-normalised rigid motions of a solid: x, y, z, rotations about the principal axes, (6, 6)."""
    moments, axes = np.linalg.eigh(properties.inertia)
    twists = np.zeros((6, 6))
    twists[:3, :3] = np.eye(3) / np.sqrt(properties.mass)
    twists[3:, 3:] = (axes / np.sqrt(moments)).T
    return twists
