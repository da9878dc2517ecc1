"""The finite-element model of a linear elastic body before reduction: matrices on dofs, and the meaning of each dof."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord


@dataclass(frozen=True)
class MassProperties:
    """Mass [kg], centre of mass [m] and inertia about it [kg m^2]."""

    mass: float
    centre: np.ndarray
    inertia: np.ndarray


def point_masses(points: np.ndarray, masses: np.ndarray) -> MassProperties:
    """Return the mass properties of masses [kg], (p,), at points [m], (p, 3)."""
    mass = float(masses.sum())
    centre = masses @ points / mass
    arm = points - centre
    second = (masses[:, None] * arm).T @ arm
    return MassProperties(mass, centre, np.trace(second) * np.eye(3) - second)


@dataclass(frozen=True)
class LineStiffness:
    """Stiffness of each bar or beam element: strain energy without the round-off of K Φ.

    The rigid motion of each element, most of the motion in a slender body, is subtracted first.
    """

    blocks: np.ndarray
    """Stiffness matrix of each element [N/m], (e, a, a)."""
    dofs: np.ndarray
    """Dofs of each element, (e, a): a bar's nodes; deflection and rotation of each node of a beam."""
    distances: np.ndarray | None = None
    """Of each beam element's nodes from its first one [m], (e, a/2); None for bars, which do not rotate."""
    relative: np.ndarray | None = None
    """Of each element of a beam in space, the motion of its dofs less its rigid motion, per motion of its dofs,
    (e, a, a)."""
    spread: sparse.csr_matrix | None = None
    """Motion of all dofs per motion of those that do not follow others in a rigid tie, (dofs, dofs)."""
    masses: np.ndarray | None = None
    """Consistent mass matrix of each beam element [kg], (e, a, a); None for bars."""

    def product(self, Phi: np.ndarray, X: np.ndarray | None = None) -> np.ndarray:
        """Return ΦᵀKX of columns (dofs, m) and (dofs, k), the same by default, (m, k)."""
        bent = self._bent(Phi)
        loads = np.einsum("eab,ebj->eaj", self.blocks, bent if X is None else self._bent(X))
        return np.einsum("eai,eaj->ij", bent, loads, optimize=True)

    def _bent(self, Phi: np.ndarray) -> np.ndarray:
        """Return the motion of each element's dofs less its rigid motion, (e, a, m)."""
        local = (Phi if self.spread is None else self.spread @ Phi)[self.dofs]
        if self.relative is not None:
            return np.einsum("eab,ebm->eam", self.relative, local)
        if self.distances is None:
            return local - local[:, :1]
        w, turn = local[:, 0::2], local[:, 1::2]
        w = w - w[:, :1] + turn[:, :1] * self.distances[:, :, None]
        return np.stack([w, turn - turn[:, :1]], axis=2).reshape(local.shape)


@dataclass(frozen=True)
class FEModel:
    """Linear elastic body before reduction. Dof = d·node + i: along `directions[i]`, or about `rotations[i]`; those of
    generalised coordinates, which move no node, follow."""

    K: sparse.csr_matrix
    """Stiffness [N/m], (dofs, dofs)."""
    M: sparse.csr_matrix
    """Consistent mass [kg], (dofs, dofs)."""
    mesh: MeshRecord
    directions: np.ndarray
    """Direction of each of a node's dofs, (d, 3): the axes of a solid, the axis of a bar; zero for a rotation."""
    rotations: np.ndarray
    """Axis of each of a node's rotational dofs [rad], (d, 3); zero for a translation."""
    properties: MassProperties
    rigid_twists: np.ndarray
    """Mass-normalised rigid motions that no support prevents: translation, rotation about the centre, (r, 6)."""
    held: np.ndarray
    """Which dofs a support holds at zero, (dofs,); K and M contain them too."""
    added_mass: bool = False
    """Whether point masses are part of M, which is then not that of the elements alone."""
    parts: LineStiffness | None = None
    """Elements of a bar or a beam, None for other bodies."""

    @property
    def nodes(self) -> np.ndarray:
        """Nodal positions [m], (n, 3)."""
        return self.mesh.nodes

    @property
    def rigid_modes(self) -> np.ndarray:
        """Rigid modes Φ_r, mass-orthonormal, (dofs, r)."""
        if not len(self.rigid_twists):
            return np.empty((len(self.held), 0))
        arm = self.nodes - self.properties.centre
        motion = [
            (twist[:3] + np.cross(twist[3:], arm)) @ self.directions.T + twist[3:] @ self.rotations.T
            for twist in self.rigid_twists
        ]
        modes = self.of_nodes(np.stack(motion, axis=-1))
        modes[self.held] = 0.0  # The motions vanish at supports but for round-off.
        return modes

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

    @property
    def nodal_dofs(self) -> int:
        """Number of the dofs of nodes; those of generalised coordinates follow them."""
        return len(self.nodes) * len(self.directions)

    def by_node(self, columns: np.ndarray) -> np.ndarray:
        """Return what columns (dofs, …) have of the nodes, (n, d, …)."""
        return columns[: self.nodal_dofs].reshape(len(self.nodes), len(self.directions), *columns.shape[1:])

    def of_nodes(self, values: np.ndarray) -> np.ndarray:
        """Return values of the nodes' dofs (n, d, …) over all dofs, zero at generalised coordinates, (dofs, …)."""
        columns = np.zeros((len(self.held), *values.shape[2:]), values.dtype)
        columns[: self.nodal_dofs] = values.reshape(self.nodal_dofs, *values.shape[2:])
        return columns

    def nodal(self, columns: np.ndarray) -> np.ndarray:
        """Turn dof columns (dofs, k) into nodal displacements (n, 3, k)."""
        return np.einsum("ndk,di->nik", self.by_node(columns), self.directions)

    def rows(self, nodes: np.ndarray, normals: np.ndarray, points: np.ndarray | None = None) -> sparse.csr_matrix:
        """B: displacement of `nodes` (c,) along `normals` (c, 3), as a matrix on the dofs, (c, dofs).

        Args:
            points: Places that turn with their node where nodes have rotations [m], (c, 3); default: the nodes.
        """
        d = len(self.directions)
        along = normals @ self.directions.T
        if points is not None and self.rotations.any():
            along = along + np.cross(points - self.nodes[nodes], normals) @ self.rotations.T
        columns = (d * nodes[:, None] + np.arange(d)).ravel()
        points = np.repeat(np.arange(len(nodes)), d)
        return sparse.csr_matrix((along.ravel(), (points, columns)), shape=(len(nodes), self.K.shape[0]))

    def weighted(self, nodes: np.ndarray, weights: np.ndarray) -> sparse.csr_matrix:
        """Return Σ weights · u over nodes (k,), one row for each set of weights (j, k, 3), (j, dofs)."""
        columns = np.tile((3 * nodes[:, None] + np.arange(3)).ravel(), len(weights))
        rows = np.repeat(np.arange(len(weights)), 3 * len(nodes))
        shape = (len(weights), 3 * len(self.nodes))
        return self.on_dofs(sparse.csr_matrix((weights.ravel(), (rows, columns)), shape=shape))

    def on_dofs(self, nodal: sparse.csr_matrix) -> sparse.csr_matrix:
        """Turn rows over nodal vectors (k, 3n), node by node, into rows over the dofs, (k, dofs)."""
        spread = sparse.kron(sparse.eye(len(self.nodes)), self.directions.T, format="csr")
        rows = sparse.csr_matrix(nodal @ spread)
        rows.resize(rows.shape[0], len(self.held))
        return rows


def scatter(blocks: np.ndarray, dofs: np.ndarray, size: int) -> sparse.csr_matrix:
    """Add element matrices (e, a, a) at their dofs (e, a)."""
    width = dofs.shape[1]
    rows = np.repeat(dofs, width, axis=1).ravel().astype(np.int32)
    columns = np.tile(dofs, (1, width)).ravel().astype(np.int32)
    matrix = sparse.csr_matrix((blocks.ravel(), (rows, columns)), shape=(size, size))
    matrix.sort_indices()
    return sparse.csr_matrix(0.5 * (matrix + matrix.T))
