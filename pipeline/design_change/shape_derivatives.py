"""How the bilinear forms of kept displacements change as nodes move: one vector over the nodes for each pair.

While the points of a body move by v with their elements and the nodal values of u and w stay, ∂u_i/∂x_j changes by
−∂u_i/∂x_k ∂v_k/∂x_j and the volume by div v. So the forms of stiffness and mass change by

    a'(u, w) = ∫ T_kj ∂v_k/∂x_j dx,   T = (∇u : σ(w)) I − ∇uᵀ σ(w) − ∇wᵀ σ(u),      b'(u, w) = ∫ ρ (u · w) div v dx

(Sokolowski & Zolésio, Introduction to Shape Optimization, 1992, chapter 2). Both are linear in v = Σ N_a v_a, so that
they are found once for each pair, and of any movement by one product. Taken at the points of the quadrature of K and M
they are the exact derivatives of the assembled matrices; fewer points are enough for smooth movements.
"""

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.elements.materials import densities, material_cells
from gudgeon.pipeline.fem.elements.reference import batches, quadrature
from gudgeon.pipeline.fem.elements.strain import GAUSS_ORDER
from gudgeon.pipeline.scenes.material import Material

BATCH = 256
"""Elements taken at once: work arrays stay in the cache of the processor's core or near it."""


def stiffness_derivatives(
    mesh: MeshRecord, material: Material, fields: np.ndarray, pairs: np.ndarray, order: int = GAUSS_ORDER
) -> np.ndarray:
    """Return g with uᵀ δK w = Σ g · δx to first order in the movement δx of the nodes (n, 3), for each pair (n, 3, p).

    Args:
        fields: Nodal displacements (n, 3, c).
        pairs: Numbers of u and w among the fields, (p, 2).
        order: Of the quadrature; with `STIFFNESS_ORDER` g is the derivative of the assembled K.
    """
    total = np.zeros((len(mesh.nodes), 3, len(pairs)))
    for cell_material, cells in material_cells(mesh, material):
        for block, batch, _ in batches(mesh, cells, BATCH):
            _, grad, dx = quadrature(block, order, batch)
            slopes = _slopes(grad, fields[block.cells[batch]])
            tensors = _tensors(slopes, _stress(slopes, cell_material), pairs) * dx.ravel()[:, None]
            # Σ over points and directions j of ∂N_a/∂x_j T_jk, one matrix product for each element.
            along = grad.transpose(0, 1, 3, 2).reshape(len(batch), grad.shape[1], -1)
            tensors = np.moveaxis(tensors, 2, 0).reshape(len(batch), along.shape[2], -1)
            _add(total, block.cells[batch], along @ tensors)
    return total


def mass_derivatives(
    mesh: MeshRecord, material: Material, fields: np.ndarray, pairs: np.ndarray, order: int = GAUSS_ORDER
) -> tuple[np.ndarray, np.ndarray]:
    """Return g with uᵀ δM w = Σ g · δx for each pair (n, 3, p), and M u of the fields (n, 3, c).

    Args:
        fields, pairs, order: As of `stiffness_derivatives`, with `MASS_ORDER` for the assembled M.
    """
    total, loads = np.zeros((len(mesh.nodes), 3, len(pairs))), np.zeros_like(fields)
    rho = np.broadcast_to(densities(mesh, material), len(mesh.cells))
    for block, batch, rows in batches(mesh, np.arange(len(mesh.cells)), BATCH):
        N, grad, dx = quadrature(block, order, batch)
        mass = rho[rows, None] * dx
        cells = block.cells[batch]
        nodal = fields[cells]
        values = (N.T @ nodal.reshape(len(batch), len(N), -1)).reshape(len(batch), N.shape[1], *nodal.shape[2:])
        weighted = values * mass[:, :, None, None]
        products = sum(values[:, :, i, pairs[:, 0]] * weighted[:, :, i, pairs[:, 1]] for i in range(3))
        _add(total, cells, grad.reshape(len(batch), -1, grad.shape[3]) @ products)
        _add(loads, cells, N @ weighted.reshape(len(batch), N.shape[1], -1))
    return total, loads


def _slopes(grad: np.ndarray, nodal: np.ndarray) -> np.ndarray:
    """Return ∂u_i/∂x_j (j, i, e·q, c) of nodal values (e, a, i, c), with ∂N_a/∂x_j (e, a, j, q)."""
    e, a, d, q = grad.shape
    slopes = grad.transpose(0, 3, 2, 1).reshape(e, -1, a) @ nodal.reshape(e, a, -1)
    return np.ascontiguousarray(slopes.reshape(e * q, d, d, -1).transpose(1, 2, 0, 3))


def _stress(slopes: np.ndarray, material: Material) -> np.ndarray:
    """Return σ_ji (j, i, …) of slopes ∂u_i/∂x_j (j, i, …)."""
    if material.orthotropic is not None:
        return np.einsum("jilk,kl...->ji...", material.orthotropic.tensor, slopes, optimize=True)
    lam, mu = material.lame
    stress = mu * (slopes + slopes.swapaxes(0, 1))
    pressure = lam * (slopes[0, 0] + slopes[1, 1] + slopes[2, 2])
    for i in range(3):
        stress[i, i] += pressure
    return stress


def _tensors(slopes: np.ndarray, stress: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Return T_kj of each pair as (j, k, e·q, p), from slopes and stresses (j, i, e·q, c)."""
    T = np.empty((*slopes.shape[:3], len(pairs)))
    same = pairs[:, 0] == pairs[:, 1]
    for chosen in (same, ~same):
        u_ids, w_ids = pairs[chosen].T
        u, su = slopes[..., u_ids], stress[..., u_ids]
        w, sw = (u, su) if chosen is same else (slopes[..., w_ids], stress[..., w_ids])
        energy = sum(u[j, i] * sw[j, i] for i in range(3) for j in range(3))
        for j in range(3):
            for k in range(3):
                term = sum(u[k, i] * sw[j, i] for i in range(3))
                term = -2 * term if w is u else -term - sum(w[k, i] * su[j, i] for i in range(3))
                T[j, k][:, chosen] = term + energy if j == k else term
    return T


def _add(total: np.ndarray, cells: np.ndarray, values: np.ndarray) -> None:
    """Add values at the nodes of elements, (e, a, …), to those of the mesh, (n, 3, p)."""
    nodes, slot = np.unique(cells, return_inverse=True)
    gather = sparse.csr_matrix((np.ones(slot.size), (slot.ravel(), np.arange(slot.size))))
    total[nodes] += (gather @ values.reshape(slot.size, -1)).reshape(len(nodes), *total.shape[1:])
