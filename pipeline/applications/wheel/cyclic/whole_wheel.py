"""The whole wheel, assembled from its sectors, each with the stiffness of its own blade.

T = I ⊗ C₀ + P ⊗ C₁ with P the shift to the next sector; K = Tᵀ (I ⊗ K + diag(f − 1) ⊗ K_blade) T in the turning axes
of the sectors. It has N times the dofs of a sector: a reference for small meshes.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from gudgeon.pipeline.applications.wheel.cyclic.harmonic import rigid_motions
from gudgeon.pipeline.applications.wheel.cyclic.hermitian import orthonormal
from gudgeon.pipeline.applications.wheel.cyclic.sector import Sector
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.assemble import build_model
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.cells import submesh
from gudgeon.pipeline.modes.problem import Problem
from gudgeon.pipeline.scenes.material import Material


@dataclass(frozen=True)
class Mistuning:
    """Blades of different stiffness."""

    part: sparse.csr_matrix
    """Contribution of the blade to the sector's K, (dofs, dofs)."""
    factors: np.ndarray
    """Stiffness of each blade over the tuned one, (N,)."""


def part_stiffness(model: FEModel, material: Material, cells: np.ndarray) -> sparse.csr_matrix:
    """Return the contribution of cells, a mask or numbers (e,), to the stiffness of a solid, (dofs, dofs)."""
    mesh, nodes = submesh(model.mesh, cells)
    K, d = sparse.coo_matrix(build_model(mesh, material).K), len(model.directions)
    dofs = (d * nodes[:, None] + np.arange(d)).ravel()
    return sparse.csr_matrix((K.data, (dofs[K.row], dofs[K.col])), shape=model.K.shape)


def wheel_problem(sector: Sector, mistuning: Mistuning | None = None) -> Problem:
    """Return the eigenproblem of the wheel, sector after sector, (N m); errors as of `changes`."""
    sectors, model = sector.symmetry.sectors, sector.model
    K_blade, delta = sparse.csr_matrix(model.K.shape), np.zeros(sectors)
    if mistuning is not None:
        K_blade, delta = mistuning.part, changes(mistuning, sectors)
    K, M = wheel_matrices(tied(sector.own, sector.next, sectors), model.K, model.M, K_blade, delta)
    return Problem(K, M, orthonormal(wheel_rigid(sector), M))


def wheel_matrices(
    tie: sparse.csr_matrix, K: Any, M: Any, K_blade: Any, delta: np.ndarray
) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Return Tᵀ (I ⊗ K + diag(δ) ⊗ K_part) T and Tᵀ (I ⊗ M) T, (N m, N m), of dense or sparse K, M, K_part."""
    identity = sparse.eye(len(delta))
    free = (sparse.kron(identity, K) + sparse.kron(sparse.diags(delta), K_blade), sparse.kron(identity, M))
    K_wheel, M_wheel = (sparse.csr_matrix(tie.T @ sparse.csr_matrix(A) @ tie) for A in free)
    return sparse.csr_matrix(0.5 * (K_wheel + K_wheel.T)), sparse.csr_matrix(0.5 * (M_wheel + M_wheel.T))


def changes(mistuning: Mistuning, sectors: int) -> np.ndarray:
    """Return f − 1 of each blade, (N,).

    Raises:
        InputError: there are not as many blades as sectors, or a factor is not positive.
    """
    factors = np.asarray(mistuning.factors, float)
    if factors.shape != (sectors,):
        raise InputError(f"mistuning.factors: {factors.size} given, the wheel has {sectors} blades")
    if not factors.min() > 0:
        raise InputError(f"mistuning.factors: {factors.min():.6g} given, a blade's stiffness must be above 0")
    return factors - 1


def wheel_motion(sector: Sector, rows: np.ndarray) -> sparse.csr_matrix:
    """Return rows over a sector's dofs (c, dofs) as rows over the wheel's, sector after sector, (N c, N m)."""
    blocks = sparse.kron(sparse.eye(sector.symmetry.sectors), sparse.csr_matrix(rows), format="csr")
    return sparse.csr_matrix(blocks @ tied(sector.own, sector.next, sector.symmetry.sectors))


def tied(C0: sparse.csr_matrix, following: sparse.csr_matrix, sectors: int) -> sparse.csr_matrix:
    """Return T = I ⊗ C₀ + P ⊗ C₁, which couples the sectors, (N dofs, N m)."""
    shift = np.roll(np.eye(sectors), 1, axis=1)
    return sparse.csr_matrix(sparse.kron(sparse.eye(sectors), C0) + sparse.kron(shift, following))


def wheel_rigid(sector: Sector) -> np.ndarray:
    """Return the wheel's rigid motions, assembled from those of the harmonics, (N m, r)."""
    symmetry = sector.symmetry
    columns = [np.empty((symmetry.sectors * sector.own.shape[1], 0))]
    for harmonic in symmetry.harmonics():
        turns = np.exp(1j * harmonic * symmetry.angle * np.arange(symmetry.sectors))
        motions = np.kron(turns[:, None], rigid_motions(sector, harmonic))
        columns += [motions.real] if symmetry.multiplicity(harmonic) == 1 else [motions.real, motions.imag]
    return np.column_stack(columns)
