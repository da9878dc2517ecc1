"""Estimated error of a mode's frequency against the continuum, from the recovered stress of its elements.

The eigenvalue of a smooth mode on a mesh is too high by the energy of its error, λ_h − λ ≈ ‖σ − σ_h‖² (Strang & Fix
1973), with recovered stress σ* for the exact one (Zienkiewicz & Zhu 1987; of eigenvalues: Wiberg, Bausys & Hager
1999): (ω_h − ω)/ω ≈ ‖σ* − σ_h‖² / 2λ_h. The error of a curved surface's shape is not included.
"""

import numpy as np
from pydantic import BaseModel

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.elements import ELEMENTS
from gudgeon.pipeline.fem.elements.materials import material_parts
from gudgeon.pipeline.fem.elements.strain import SHEARS, elasticity
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.cells import TETRAHEDRON, TRIANGLE, cell_of, outer_facets, quadratic_basis
from gudgeon.pipeline.modes.patch_recovery import Recovery
from gudgeon.pipeline.scenes.material import Material

INCOMPRESSIBLE = 0.48
"""ν from which quadratic elements may lock: displacements must preserve the volume of each."""
IN_TRACTION = 0.15
"""Share of a node's facets on which a direction of stress has a traction, from which on it has none there: below that
of the faces of an edge, above that of facets of one curved surface."""
BLOCK_BYTES = 2**26
"""Largest array of strains in memory."""


def discretisation_errors(
    model: FEModel,
    material: Material,
    geometry: BaseModel | None,
    angular_frequencies: np.ndarray,
    Phi: np.ndarray,
) -> np.ndarray | None:
    """Return the estimated (ω − ω_exact)/ω of normal modes, (m,); None if the elements have no strains to recover.

    Args:
        angular_frequencies: [rad/s], (m,)
        Phi: M-orthonormal, (dofs, m).
    """
    energies = error_energies(model, material, geometry, Phi, free=True)
    return None if energies is None else energies / (2 * angular_frequencies**2)


def error_energies(
    model: FEModel, material: Material, geometry: BaseModel | None, displacements: np.ndarray, *, free: bool = False
) -> np.ndarray | None:
    """Return ‖σ* − σ_h‖², twice the strain energy of the error of displacements (dofs, k), (k,); None as above.

    Of a static response under a load f it is how much more than fᵀ G f the compliance of the continuum is.

    Args:
        free: Whether surfaces have no traction but where they are held, as those of modes.
    """
    if model.rotations.any() and model.mesh.system is not None:
        return None  # Solids among nodes that have rotations too.
    total = np.zeros(displacements.shape[1])
    # Stress jumps between materials: each is recovered by itself.
    for cell_material, mesh, nodes in material_parts(model.mesh, material):
        u = displacements
        if mesh is not model.mesh:
            u = model.by_node(displacements)[nodes].reshape(len(nodes) * len(model.directions), displacements.shape[1])
        incompressible = free and mesh is model.mesh and cell_material.nu >= INCOMPRESSIBLE
        projection = without_traction(model, cell_material) if incompressible else None
        energies = _energies(mesh, cell_material, geometry, u, projection)
        if energies is None:
            return None
        total += energies
    return total


def _energies(
    mesh: MeshRecord,
    material: Material,
    geometry: BaseModel | None,
    displacements: np.ndarray,
    free: tuple[np.ndarray, np.ndarray] | None,
) -> np.ndarray | None:
    """Return the same for a mesh of one material, with nodes of free surfaces as `Recovery` takes them."""
    element = ELEMENTS.get(mesh.cell_type)
    if element is None or element.samples is None:
        return None
    samples = element.samples(mesh, material, geometry)
    energies = np.zeros(displacements.shape[1])
    per_column = 8 * sum(block.components * len(block.points) * block.points.shape[1] for block in samples)
    width = max(1, BLOCK_BYTES // per_column)
    for blocks in [[block] for block in samples] if element.separate else [samples]:
        recovery = Recovery(blocks, free)
        for start in range(0, displacements.shape[1], width):
            some = slice(start, start + width)
            energies[some] += recovery.error_energy([block.strains(displacements[:, some]) for block in blocks])
    return energies


def without_traction(model: FEModel, material: Material) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the nodes of a solid's surface that nothing holds, (b,), and the projection of D^½ ε there, (b, 6, 6), on
    what has no traction on their facets; None of other meshes and materials.

    With D = RᵀR and D^½ ε = R ε, σ = Rᵀ (D^½ ε), so that N(n) Rᵀ reads the traction on a facet. A node has the mean of
    the facets around it: directions are left out that most of it is in, of one flat face three, of an edge five.
    """
    cell = cell_of(model.mesh)
    if not cell.solid or cell.shape is not TETRAHEDRON or material.orthotropic is not None:
        return None
    facets = outer_facets(model.mesh)[:, :6]
    # At its own nodes a facet has the normals of its quadratic surface.
    corners = np.eye(3)
    _, slopes = quadratic_basis(np.vstack([corners, 0.5 * corners[TRIANGLE.edges].sum(axis=1)]))
    tangents = np.einsum("qak,fai->fqki", slopes, model.nodes[facets])
    normals = np.cross(tangents[:, :, 0], tangents[:, :, 1])
    sizes = np.linalg.norm(normals, axis=2)
    N, n = np.zeros((*normals.shape[:2], 3, 6)), normals / sizes[:, :, None]
    for axis in range(3):
        N[:, :, axis, axis] = n[:, :, axis]
    for column, (i, j) in enumerate(SHEARS, 3):
        N[:, :, i, column], N[:, :, j, column] = n[:, :, j], n[:, :, i]
    R = np.linalg.cholesky(elasticity(*material.lame, 3)).T
    Q = np.linalg.qr(np.swapaxes(N @ R.T, 2, 3))[0]
    tractions = (Q @ np.swapaxes(Q, 2, 3)) * sizes[:, :, None, None]
    constrained = model.by_node(model.held).any(axis=1)
    total, weight = np.zeros((len(model.nodes), 6, 6)), np.zeros(len(model.nodes))
    np.add.at(total, facets, tractions)
    np.add.at(weight, facets, sizes)
    nodes = np.flatnonzero((weight > 0) & ~constrained)
    values, vectors = np.linalg.eigh(total[nodes] / weight[nodes][:, None, None])
    traction_free = vectors * (values < IN_TRACTION)[:, None, :]
    return nodes, traction_free @ traction_free.transpose(0, 2, 1)
