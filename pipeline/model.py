"""From a mesh and a material to the FE model: K, M, rigid motions. scikit-fem gives elements and quadrature.

Tet10 elements are isoparametric: x = Σ N_a x_a, so the true surface is kept to second order. Element matrices are
formed in batches from the scalar basis, G_ij^ab = ∫ ∂_i N_a ∂_j N_b, which is several times faster than vector forms
and equal to them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from modaldb.schema import MeshRecord
from pipeline.errors import InputError
from pipeline.material import Material

STIFFNESS_ORDER, MASS_ORDER = 4, 6
"""Polynomial degree that the quadrature integrates exactly. A straight tet10 needs 2 and 4; the curved ones' Jacobians
add to both, and going higher changes no frequency of the skirt in its seventh digit."""

FIRMNESS = 1e-6
"""Least of the held nodes' rigid motions relative to the largest: below it they stand on one line, or in one point."""

BATCH = 4096
"""Elements assembled at once: the largest work array is about 60 MB."""


@dataclass(frozen=True)
class MassProperties:
    """Mass [kg], centre of mass [m] and inertia about it [kg m^2]."""

    mass: float
    centre: np.ndarray
    inertia: np.ndarray


@dataclass(frozen=True)
class FEModel:
    """Linear elastic body before reduction."""

    K: sparse.csr_matrix
    """Stiffness [N/m], (dofs, dofs)."""
    M: sparse.csr_matrix
    """Consistent mass [kg], (dofs, dofs)."""
    nodes: np.ndarray
    """[m], (n, 3)"""
    directions: np.ndarray
    """Directions of a node's dofs, (d, 3): the axes of a solid, the axis of a bar. Dof = d·node + direction."""
    properties: MassProperties
    rigid_twists: np.ndarray
    """Mass-normalised rigid motions: translation, rotation about the centre, (r, 6); none of a held body, (0, 6)."""
    held: np.ndarray
    """Which dofs a support holds at zero, (dofs,). K and M have all dofs nevertheless."""

    @property
    def rigid_modes(self) -> np.ndarray:
        """Φ_r, mass-orthonormal, (dofs, r)."""
        if not len(self.rigid_twists):
            return np.empty((len(self.held), 0))
        arm = self.nodes - self.properties.centre
        motion = [twist[:3] + np.cross(twist[3:], arm) for twist in self.rigid_twists]
        return np.column_stack([(field @ self.directions.T).ravel() for field in motion])

    @property
    def free(self) -> np.ndarray:
        """Numbers of the dofs that no support holds, (free,)."""
        return np.flatnonzero(~self.held)

    def free_matrices(self) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
        """Return K and M of the dofs that no support holds, (free, free)."""
        if not self.held.any():
            return self.K, self.M
        free = self.free
        return sparse.csr_matrix(self.K[free][:, free]), sparse.csr_matrix(self.M[free][:, free])

    def nodal(self, columns: np.ndarray) -> np.ndarray:
        """Turn dof columns (dofs, k) into nodal vectors (n, 3, k)."""
        per_node = columns.reshape(len(self.nodes), len(self.directions), -1)
        return np.einsum("ndk,di->nik", per_node, self.directions)

    def rows(self, nodes: np.ndarray, normals: np.ndarray) -> sparse.csr_matrix:
        """B: displacement of `nodes` (c,) along `normals` (c, 3), as a matrix on the dofs, (c, dofs)."""
        d = len(self.directions)
        along = normals @ self.directions.T
        columns = (d * nodes[:, None] + np.arange(d)).ravel()
        points = np.repeat(np.arange(len(nodes)), d)
        return sparse.csr_matrix((along.ravel(), (points, columns)), shape=(len(nodes), self.K.shape[0]))

    def on_dofs(self, nodal: sparse.csr_matrix) -> sparse.csr_matrix:
        """Turn rows over nodal vectors (k, 3n), node by node, into rows over the dofs, (k, dofs)."""
        spread = sparse.kron(sparse.eye(len(self.nodes)), self.directions.T, format="csr")
        return sparse.csr_matrix(nodal @ spread)


def build_model(
    mesh: MeshRecord, material: Material, supports: Sequence[str] = (), where: str = "component"
) -> FEModel:
    """Assemble stiffness and consistent mass of a meshed component.

    Args:
        supports: Surfaces whose nodes are held in all their dofs.
        where: The component's key in the scene, for messages.

    Raises:
        InputError: the mesh has an inverted element or no such surface, or the supports leave a rigid motion free.
    """
    model = ASSEMBLERS[mesh.cell_type](mesh, material)
    return _supported(model, mesh, supports, f"{where}.supports") if supports else model


def _supported(model: FEModel, mesh: MeshRecord, supports: Sequence[str], where: str) -> FEModel:
    for name in supports:
        if name not in mesh.surfaces:
            have = ", ".join(sorted(mesh.surfaces)) or "none"
            raise InputError(f"{where}: the mesh has no surface '{name}', it has {have}")
    nodes = np.unique(np.concatenate([mesh.surfaces[name].facets.ravel() for name in supports]))
    held = np.zeros((len(mesh.nodes), len(model.directions)), bool)
    held[nodes] = True
    strength = np.linalg.svd(model.rigid_modes[held.ravel()], compute_uv=False)
    if len(strength) < len(model.rigid_twists) or strength[-1] < FIRMNESS * strength[0]:
        raise InputError(
            f"{where}: the {len(nodes)} nodes of {', '.join(supports)} leave a rigid motion free; at least three that"
            " are not on one line hold a solid"
        )
    return replace(model, rigid_twists=np.empty((0, 6)), held=held.ravel())


def solid_quadrature(mesh: MeshRecord, order: int, cells: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return N (10, q), ∂N/∂x (e, 10, 3, q) and weights × |J| (e, q) of the chosen curved tet10."""
    N, dN, W = _reference("tetra10", order)
    x = mesh.nodes[mesh.cells[cells]]
    J = np.einsum("eai,akq->eqik", x, dN)
    det = np.linalg.det(J)
    if det.min() <= 0:
        worst = int(np.argmin(det.min(axis=1)))
        raise InputError(f"mesh: element {worst + (cells.start or 0)} is inverted (Jacobian {det.min():.3g})")
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
    N, dN, W = _reference("tetra10", MASS_ORDER)
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


def _assemble_solid(mesh: MeshRecord, material: Material) -> FEModel:
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
    K = _scatter(Ke.reshape(count, 30, 30), dofs, 3 * len(mesh.nodes))
    M = sparse.kron(_scatter(Me, mesh.cells, len(mesh.nodes)), sparse.eye(3), format="csr")
    properties = mass_properties(mesh, material.rho)
    return FEModel(K, M, mesh.nodes, np.eye(3), properties, solid_twists(properties), np.zeros(K.shape[0], bool))


def _assemble_bar(mesh: MeshRecord, material: Material) -> FEModel:
    area = next(iter(mesh.surfaces.values())).shape["area"]
    N, dN, W = _reference("line3", 4)
    x = mesh.nodes[mesh.cells]
    axis = x[0, 1] - x[0, 0]
    axis = axis / np.linalg.norm(axis)
    J = np.einsum("ea,akq->eq", x @ axis, dN)
    grad = dN[None, :, 0] / J[:, None]
    Ke = material.E * area * np.einsum("eaq,ebq,eq,q->eab", grad, grad, J, W)
    Me = material.rho * area * np.einsum("aq,bq,eq,q->eab", N, N, J, W)
    count = len(mesh.nodes)
    K, M = _scatter(Ke, mesh.cells, count), _scatter(Me, mesh.cells, count)
    mass = float(M.sum())
    weights = np.asarray(M.sum(axis=0)).ravel()
    centre = weights @ mesh.nodes / mass
    second = weights @ ((mesh.nodes - centre) @ axis) ** 2
    inertia = second * (np.eye(3) - np.outer(axis, axis))
    twist = np.concatenate([axis / np.sqrt(mass), np.zeros(3)])[None]
    return FEModel(K, M, mesh.nodes, axis[None], MassProperties(mass, centre, inertia), twist, np.zeros(count, bool))


ASSEMBLERS = {"tetra10": _assemble_solid, "line3": _assemble_bar}


def _reference(cell_type: str, order: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return N (a, q), ∂N/∂ξ (a, k, q) and weights (q,) on scikit-fem's reference element, in meshio's node order."""
    from skfem import ElementLineP2, ElementTetP2
    from skfem.quadrature import get_quadrature

    element = ElementTetP2() if cell_type == "tetra10" else ElementLineP2()
    X, W = get_quadrature(type(element).refdom, order)
    basis = [element.lbasis(X, a) for a in range(len(element.doflocs))]
    return np.array([b[0] for b in basis]), np.array([b[1] for b in basis]), W


def _scatter(blocks: np.ndarray, dofs: np.ndarray, size: int) -> sparse.csr_matrix:
    """Add element matrices (e, a, a) at their dofs (e, a)."""
    width = dofs.shape[1]
    rows = np.repeat(dofs, width, axis=1).ravel().astype(np.int32)
    columns = np.tile(dofs, (1, width)).ravel().astype(np.int32)
    matrix = sparse.csr_matrix((blocks.ravel(), (rows, columns)), shape=(size, size))
    matrix.sort_indices()
    return sparse.csr_matrix(0.5 * (matrix + matrix.T))
