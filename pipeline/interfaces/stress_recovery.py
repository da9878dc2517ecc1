"""Stress and strain from displacements: averaged recovery at the nodes, and places within elements.

In every element the strain is evaluated at the points of the rule that is exact to degree 2, where derivatives of
quadratic elements are most accurate (Barlow 1976; four points of a tetrahedron, three of a triangle), and extrapolated
linearly to the nodes. The values of the elements around a node are averaged by volume; between nodes the shape
functions interpolate. A linear strain is exact on straight elements.

Components are those of the tensor, shear strains ε_ij and not γ_ij, in the order of `COMPONENTS`.
"""

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.materials import elasticity_matrix
from gudgeon.pipeline.fem.elements.reference import extrapolation, quadrature, shape_functions
from gudgeon.pipeline.geometry.cells import cell_of
from gudgeon.pipeline.scenes.material import Material

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "zx")
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
ORDER = 2
"""Degree to which the rule of the sampling points is exact."""
BATCH = 4096
OUTSIDE = 1e-2
"""How far a place may lie outside an element, in its barycentric coordinates: quadratic elements deviate from a true
surface by less than a hundredth of their size."""
REACH = 0.2
"""By how much of its extent an element may bulge beyond its nodes."""
ITERATIONS, CONVERGED = 30, 1e-12


def strain_rows(mesh: MeshRecord, nodes: np.ndarray) -> sparse.csr_matrix:
    """Return the recovered strain at nodes (s,) over the nodal displacements, (6 s, 3 n), node by node.

    The strain across a plane part is zero here; `complete_strain` adds it.
    """
    D = nodal_gradient(mesh, nodes)
    count = len(nodes)
    rows = sparse.csr_matrix((6 * count, 3 * len(mesh.nodes)))
    for component, (i, j) in enumerate(PAIRS):
        unit = sparse.csr_matrix(([1.0], ([component], [0])), shape=(6, 1))
        for derivative, direction in ((i, j), (j, i)):
            along = sparse.csr_matrix(([0.5], ([0], [direction])), shape=(1, 3))
            if derivative < len(D):
                rows = rows + sparse.kron(sparse.kron(D[derivative], along), unit, format="csr")
    return sparse.csr_matrix(rows)


def nodal_gradient(mesh: MeshRecord, nodes: np.ndarray) -> list[sparse.csr_matrix]:
    """Return ∂/∂x, ∂/∂y and, of solids, ∂/∂z of a nodal field, recovered at nodes (s,), (s, n) each."""
    cell = cell_of(mesh)
    dimension = cell.dimension
    row_of_node = np.full(len(mesh.nodes), -1)
    row_of_node[nodes] = np.arange(len(nodes))
    around = np.flatnonzero((row_of_node[mesh.cells] >= 0).any(axis=1))
    E = extrapolation(cell, ORDER)
    shape = (len(nodes), len(mesh.nodes))
    total, volumes = [sparse.csr_matrix(shape) for _ in range(dimension)], np.zeros(len(nodes))
    for start in range(0, len(around), BATCH):
        batch = around[start : start + BATCH]
        cells, (_, gradient, dx) = mesh.cells[batch], quadrature(mesh, ORDER, batch)
        volume = dx.sum(axis=1)
        at_nodes = np.einsum("cq,eaiq,e->ieca", E, gradient, volume, optimize=True)
        rows = np.broadcast_to(row_of_node[cells][:, :, None], at_nodes.shape[1:])
        columns = np.broadcast_to(cells[:, None], at_nodes.shape[1:])
        requested = rows >= 0
        for i in range(dimension):
            total[i] += sparse.csr_matrix((at_nodes[i][requested], (rows[requested], columns[requested])), shape=shape)
        cell_rows = row_of_node[cells]
        np.add.at(volumes, cell_rows[cell_rows >= 0], np.broadcast_to(volume[:, None], cell_rows.shape)[cell_rows >= 0])
    return [sparse.csr_matrix(sparse.diags(1 / volumes) @ T) for T in total]


def complete_strain(material: Material, state: str) -> np.ndarray:
    """Return the matrix that adds the strain across a plane part to its strain, (6, 6); for solids the identity.

    Args:
        state: `solid`, `plane-strain` or `plane-stress`: σ_zz = 0 there, ε_zz = −ν/(1 − ν) (ε_xx + ε_yy).
    """
    complete = np.eye(6)
    if state == "plane-stress":
        complete[2] = [-material.nu / (1 - material.nu)] * 2 + [0.0] * 4
    return complete


def hooke(material: Material) -> np.ndarray:
    """Return the matrix from the components of strain to those of stress [Pa], (6, 6)."""
    if material.orthotropic is not None:
        return elasticity_matrix(material, PAIRS, 2.0)
    lam, _ = material.lame
    D = material.E / (1 + material.nu) * np.eye(6)
    D[:3, :3] += lam
    return D


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Return the equivalent stress [Pa], (...), of the components of stress, (..., 6)."""
    xx, yy, zz, xy, yz, zx = np.moveaxis(stress, -1, 0)
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return np.sqrt(0.5 * normal + 3 * (xy**2 + yz**2 + zx**2))


def interpolation(mesh: MeshRecord, point: np.ndarray, key: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes of the element that contains a point [m], (3,), and their shape functions there, (a,) each.

    Raises:
        InputError: the point, whose key is `key`, lies outside the part.
    """
    dimension = cell_of(mesh).dimension
    corners = mesh.nodes[mesh.cells]
    low, high = corners.min(axis=1), corners.max(axis=1)
    room = REACH * (high - low).max(axis=1, keepdims=True)
    containing, best = None, -np.inf
    for cell in np.flatnonzero(((point >= low - room) & (point <= high + room)).all(axis=1)):
        X = _place(mesh, int(cell), point)
        if X is not None and (margin := float(min(X.min(), 1 - X.sum()))) > best:
            containing, best = (int(cell), X), margin
    off_plane = dimension == 2 and abs(point[2]) > OUTSIDE * np.ptp(mesh.nodes, axis=0).max()
    if containing is None or best < -OUTSIDE or off_plane:
        nearest = float(np.linalg.norm(mesh.nodes - point, axis=1).min())
        raise InputError(
            f"{key}: {point.tolist()} given, it lies outside the part; the nearest node is {nearest:.4g} m away"
        )
    N, _ = shape_functions(cell_of(mesh), containing[1][:, None])
    return mesh.cells[containing[0]], N[:, 0]


def _place(mesh: MeshRecord, cell: int, point: np.ndarray) -> np.ndarray | None:
    """Return a point's coordinates in the reference element (k,), or None if Newton's method does not converge."""
    dimension = cell_of(mesh).dimension
    x = mesh.nodes[mesh.cells[cell]][:, :dimension]
    X = np.full(dimension, 1 / (dimension + 1))
    for _ in range(ITERATIONS):
        N, dN = shape_functions(cell_of(mesh), X[:, None])
        J = x.T @ dN[:, :, 0]
        if np.linalg.det(J) <= 0:
            return None
        step = np.linalg.solve(J, point[:dimension] - N[:, 0] @ x)
        X = X + step
        if np.abs(step).max() < CONVERGED:
            return X
        if np.abs(X).max() > 1 / REACH:
            return None
    return None
