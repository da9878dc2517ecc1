"""Solid elements: straight and curved tet10. scikit-fem gives shape functions and quadrature.

Tet10 elements are isoparametric: x = Σ N_a x_a, so the true surface is kept to second order. Element matrices are
formed in batches from the scalar basis, G_ij^ab = ∫ ∂_i N_a ∂_j N_b, which is several times faster than vector forms
and equal to them.
"""

import numpy as np
from pydantic import BaseModel
from scipy import sparse

from modaldb.schema import MeshRecord
from pipeline.elements.reference import reference
from pipeline.femodel import FEModel, MassProperties, scatter
from pipeline.geometry.soundness import refuse_degenerate
from pipeline.material import Material

STIFFNESS_ORDER, MASS_ORDER = 4, 6
"""Polynomial degree that the quadrature integrates exactly. A straight tet10 needs 2 and 4; the curved ones' Jacobians
add to both, and going higher changes no frequency of the skirt in its seventh digit."""

BATCH = 4096
"""Elements assembled at once: the largest work array is about 60 MB."""


def assemble_solid(mesh: MeshRecord, material: Material, geometry: BaseModel | None) -> FEModel:
    lam = material.E * material.nu / (1 + material.nu) / (1 - 2 * material.nu)
    mu = material.E / 2 / (1 + material.nu)
    count = len(mesh.cells)
    Ke, Me = np.empty((count, 10, 3, 10, 3)), np.empty((count, 10, 10))
    for start in range(0, count, BATCH):
        cells = slice(start, min(start + BATCH, count))
        _, grad, dx = solid_quadrature(mesh, STIFFNESS_ORDER, cells)
        flat = grad.reshape(len(dx), 30, -1)
        G = np.matmul(flat * dx[:, None], flat.transpose(0, 2, 1)).reshape(-1, 10, 3, 10, 3)
        Ke[cells] = lam * G + mu * G.transpose(0, 1, 4, 3, 2)
        shear = mu * np.einsum("eaibi->eab", G)
        for i in range(3):
            Ke[cells, :, i, :, i] += shear
        N, _, dx = solid_quadrature(mesh, MASS_ORDER, cells)
        Me[cells] = material.rho * np.matmul(N * dx[:, None], N.T)
    dofs = (3 * mesh.cells[:, :, None] + np.arange(3)).reshape(count, 30)
    K = scatter(Ke.reshape(count, 30, 30), dofs, 3 * len(mesh.nodes))
    M = sparse.kron(scatter(Me, mesh.cells, len(mesh.nodes)), sparse.eye(3), format="csr")
    properties = mass_properties(mesh, material.rho)
    twists, held = solid_twists(properties), np.zeros(K.shape[0], bool)
    return FEModel(K, M, mesh, np.eye(3), np.zeros((3, 3)), properties, twists, held)


def solid_quadrature(mesh: MeshRecord, order: int, cells: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return N (10, q), ∂N/∂x (e, 10, 3, q) and weights × |J| (e, q) of the chosen curved tet10."""
    N, dN, W = reference("tetra10", order)
    x = mesh.nodes[mesh.cells[cells]]
    J = np.einsum("eai,akq->eqik", x, dN)
    det = np.linalg.det(J)
    refuse_degenerate(x, det, cells.start or 0)
    grad = np.einsum("akq,eqki->eaiq", dN, np.linalg.inv(J), optimize=True)
    return N, grad, det * W


def nodal_jacobians(mesh: MeshRecord) -> np.ndarray:
    """Return det(∂x/∂ξ) of every tet10 at its ten nodes, (e, 10); positive in a sound element."""
    from skfem import ElementTetP2

    element = ElementTetP2()
    dN = np.array([element.lbasis(element.doflocs.T, a)[1] for a in range(10)])
    return _determinants(mesh.nodes[mesh.cells], dN)


def mass_properties(mesh: MeshRecord, rho: float) -> MassProperties:
    """Integrate mass, centre and inertia of a tet10 mesh over its curved elements, by the rule of the mass matrix."""
    N, dN, W = reference("tetra10", MASS_ORDER)
    x = mesh.nodes[mesh.cells]
    weights = (rho * W * _determinants(x, dN)).ravel()
    points = np.matmul(N.T, x).reshape(-1, 3)
    mass = float(weights.sum())
    centre = weights @ points / mass
    arm = points - centre
    second = (weights[:, None] * arm).T @ arm
    return MassProperties(mass, centre, np.trace(second) * np.eye(3) - second)


def _determinants(x: np.ndarray, dN: np.ndarray) -> np.ndarray:
    """Return det(∂x/∂ξ) (e, q) of elements with nodes x (e, a, 3) and shape gradients dN (a, k, q)."""
    tangents = np.matmul(dN.transpose(1, 2, 0), x[:, None])
    a, b, c = tangents[:, 0], tangents[:, 1], tangents[:, 2]
    return (
        a[..., 0] * (b[..., 1] * c[..., 2] - b[..., 2] * c[..., 1])
        + a[..., 1] * (b[..., 2] * c[..., 0] - b[..., 0] * c[..., 2])
        + a[..., 2] * (b[..., 0] * c[..., 1] - b[..., 1] * c[..., 0])
    )


def solid_twists(properties: MassProperties) -> np.ndarray:
    """Return the six mass-normalised rigid motions of a solid: x, y, z, then turns about the principal axes, (6, 6)."""
    moments, axes = np.linalg.eigh(properties.inertia)
    twists = np.zeros((6, 6))
    twists[:3, :3] = np.eye(3) / np.sqrt(properties.mass)
    twists[3:, 3:] = (axes / np.sqrt(moments)).T
    return twists
