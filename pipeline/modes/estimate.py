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
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.patch_recovery import Recovery
from gudgeon.pipeline.scenes.material import Material

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
    energies = error_energies(model, material, geometry, Phi)
    return None if energies is None else energies / (2 * angular_frequencies**2)


def error_energies(
    model: FEModel, material: Material, geometry: BaseModel | None, displacements: np.ndarray
) -> np.ndarray | None:
    """Return ‖σ* − σ_h‖², twice the strain energy of the error of displacements (dofs, k), (k,); None as above.

    Of a static response under a load f it is how much more than fᵀ G f the compliance of the continuum is.
    """
    if model.rotations.any() and model.mesh.system is not None:
        return None  # Solids among nodes that have rotations too.
    total = np.zeros(displacements.shape[1])
    # Stress jumps between materials: each is recovered by itself.
    for cell_material, mesh, nodes in material_parts(model.mesh, material):
        u = displacements
        if mesh is not model.mesh:
            count, columns = displacements.shape[0] // len(model.nodes), displacements.shape[1]
            by_node = displacements.reshape(len(model.nodes), count, columns)
            u = by_node[nodes].reshape(len(nodes) * count, columns)
        energies = _energies(mesh, cell_material, geometry, u)
        if energies is None:
            return None
        total += energies
    return total


def _energies(
    mesh: MeshRecord, material: Material, geometry: BaseModel | None, displacements: np.ndarray
) -> np.ndarray | None:
    """Return the same for a mesh of one material."""
    element = ELEMENTS.get(mesh.cell_type)
    if element is None or element.samples is None:
        return None
    samples = element.samples(mesh, material, geometry)
    recovery, energies = Recovery(samples), np.empty(displacements.shape[1])
    per_column = 8 * sum(block.components * len(block.points) * block.points.shape[1] for block in samples)
    width = max(1, BLOCK_BYTES // per_column)
    for start in range(0, displacements.shape[1], width):
        some = slice(start, start + width)
        energies[some] = recovery.error_energy([block.strains(displacements[:, some]) for block in samples])
    return energies
