"""Bounds on the error of frequencies against the exact ones of the same mesh, from residuals r = K φ − θ M φ.

For an M-normal φ an eigenvalue λ lies within ρ = ‖r‖_{M⁻¹} of θ. If an inertia count proves that no other eigenvalue
is near, |λ − θ| ≤ ρ²/δ with δ the distance of θ from all the others (Temple, Kato); for a cluster of close eigenvalues
ρ is the root of the sum of their squares (Parlett, The Symmetric Eigenvalue Problem, 1998, ch. 11).

‖r‖_{M⁻¹} needs no solve on solids: element by element M ≥ c diag(M), so that ‖r‖_{M⁻¹} ≤ ‖r‖_{diag(M)⁻¹} / √c (Wathen
1987). c is that of the straight element, times the least ratio of Jacobians within a curved element; the quadrature
weights are positive. For other elements M is factorised.

Residuals are known up to round-off only: eps·max(K_ii/M_ii), the uncertainty of all eigenvalues, is added.
"""

from itertools import pairwise

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.elements.given import SINGULAR
from gudgeon.pipeline.fem.elements.reference import orders, reference
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.geometry.cells import Block, cell_blocks, cell_of
from gudgeon.pipeline.linalg import factorise
from gudgeon.pipeline.modes.problem import Count

CLUSTER = 1e-3
"""Eigenvalues closer than this share form a cluster: a smaller gap would weaken the bound."""
BATCH = 4096


def residuals(model: FEModel, angular_frequencies: np.ndarray, Phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ‖KΦ − MΦω²‖ / ‖KΦ‖ over the free dofs, (m,), and the residuals themselves, (free, m).

    Args:
        angular_frequencies: [rad/s], (m,)
        Phi: M-orthonormal, (dofs, m).
    """
    K, M = model.free_matrices()
    shapes = Phi[model.free]
    forces = K @ shapes
    R = forces - (M @ shapes) * angular_frequencies**2
    return np.linalg.norm(R, axis=0) / np.linalg.norm(forces, axis=0), R


def algebraic_errors(
    model: FEModel, pairs: tuple[np.ndarray, np.ndarray], R: np.ndarray, proven: Count | None, untied: bool
) -> np.ndarray:
    """Return bounds on |δω|/ω of Ritz pairs, (m,).

    Args:
        pairs: Angular frequencies [rad/s] (m,) and shapes (dofs, m); those that a count proves first, ascending.
        R: Their residuals over the free dofs, (free, m).
        proven: None if other eigenvalues may lie in between.
        untied: Whether M is that of the mesh, without ties.
    """
    theta = pairs[0] ** 2
    bounds = rho = _mass_norms(model, R, untied)
    if proven is not None:
        shift, count = proven
        proven_modes = slice(0, count)
        # Φᵀr: difference of the stored frequencies from Rayleigh quotients, mostly round-off.
        offsets = pairs[1][model.free, proven_modes].T @ R[:, proven_modes]
        floor = 0.0 if len(model.rigid_twists) else -np.inf
        sharper = _with_gaps(theta[proven_modes], rho[proven_modes], offsets, (floor, shift))
        bounds = np.concatenate([sharper, rho[count:]])
    return (bounds + round_off(model)) / (2 * theta)


def round_off(model: FEModel) -> float:
    """Return the uncertainty of a model's eigenvalues by round-off [rad²/s²]."""
    stiffness, mass = model.K.diagonal()[model.free], model.M.diagonal()[model.free]
    return float(np.finfo(float).eps * (stiffness / mass).max())


def _with_gaps(theta: np.ndarray, rho: np.ndarray, offsets: np.ndarray, between: tuple[float, float]) -> np.ndarray:
    """Return bounds on |λ − θ| [rad²/s²] of all eigenvalues between two neighbours of them, (m,)."""
    cluster_starts = np.flatnonzero(np.diff(theta) > CLUSTER * theta[1:]) + 1
    groups = [slice(a, b) for a, b in pairwise([0, *cluster_starts.tolist(), len(theta)])]
    radii = [float(np.linalg.norm(rho[group])) for group in groups]
    lower_neighbour = [between[0], *(theta[group][-1] + radius for group, radius in zip(groups, radii, strict=True))]
    upper_neighbour = [*(theta[group][0] - radius for group, radius in zip(groups, radii, strict=True)), between[1]]
    if any(low >= high for low, high in zip(lower_neighbour, upper_neighbour, strict=True)):
        return rho  # The intervals overlap: residuals are too large to assign eigenvalues.
    bounds = rho.copy()
    for i, (group, radius) in enumerate(zip(groups, radii, strict=True)):
        gap = min(theta[group][0] - lower_neighbour[i], upper_neighbour[i + 1] - theta[group][-1])
        bounds[group] = np.minimum(rho[group], radius**2 / gap + np.linalg.norm(offsets[group, group]))
    return bounds


def _mass_norms(model: FEModel, R: np.ndarray, untied: bool) -> np.ndarray:
    """Return ‖r‖_{M⁻¹} of columns over the free dofs, or an upper bound, (m,)."""
    # Solids and plane parts have the same shape functions in each direction.
    singular = model.mesh.system is not None or "reduced" in model.mesh.formulations
    if untied and cell_of(model.mesh).dimension > 1 and not singular and not model.added_mass:
        lumped = model.M.diagonal()[model.free]
        return np.sqrt((R**2 / lumped[:, None]).sum(axis=0) / lumped_share(model.mesh))
    mass = model.free_matrices()[1]
    if singular:  # It may be; a larger mass changes frequencies by less than its share.
        mass = sparse.csr_matrix(mass + SINGULAR * sparse.diags(mass.diagonal()))
    factor = factorise(mass, definite=True)
    answer = factor.solve(R)
    factor.free()
    return np.sqrt(np.maximum((R * answer).sum(axis=0), 0.0))


def lumped_share(mesh: MeshRecord) -> float:
    """Return a c for which M − c·diag(M) is positive semidefinite, M of constant density."""
    return min(_cell_share(mesh.nodes, block) for block in cell_blocks(mesh))


def _cell_share(nodes: np.ndarray, block: Block) -> float:
    """Return the same of cells of one type."""
    cell, _, cells = block
    N, dN, W = reference(cell, orders(cell)[1])
    if W.min() <= 0:
        raise ValueError(f"the quadrature of {cell.name} of order {orders(cell)[1]} has weights below zero")
    mass = (N * W) @ N.T
    scale = 1 / np.sqrt(mass.diagonal())
    fraction, evenness = float(np.linalg.eigvalsh(mass * np.outer(scale, scale))[0]), 1.0
    for start in range(0, len(cells), BATCH):
        J = np.einsum("eai,akq->eqki", nodes[cells[start : start + BATCH]], dN, optimize=True)
        sizes = np.sqrt(np.linalg.det(J @ J.transpose(0, 1, 3, 2)))
        evenness = min(evenness, float((sizes.min(axis=1) / sizes.max(axis=1)).min()))
    return fraction * evenness
