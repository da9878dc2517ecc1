"""Stress and strain from displacements: averaged recovery at the nodes, and places within elements.

In every element the strain is evaluated at the points of the rule that is exact to degree 2, where derivatives of
quadratic elements are most accurate (Barlow 1976; four points of a tetrahedron, eight of a hexahedron, three of a
triangle), and extrapolated linearly to the nodes; of linear elements it is that of their centre, and of those with
incompatible modes that of eight points, the modes included. The values of the elements around a node are averaged by
volume; between nodes the shape functions interpolate. A linear strain is exact on straight quadratic elements.

Components are those of the tensor, shear strains ε_ij and not γ_ij, in the order of `COMPONENTS`.
"""

from collections.abc import Iterator

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.elements.incompatible import mode_slopes
from gudgeon.pipeline.fem.elements.materials import elasticity_matrix
from gudgeon.pipeline.fem.elements.reference import batches, extrapolation, quadrature, shape_functions
from gudgeon.pipeline.fem.elements.shapes import CORNERS
from gudgeon.pipeline.geometry.cells import HEXAHEDRON, PYRAMID, WEDGE, Cell, cell_blocks, cell_of
from gudgeon.pipeline.scenes.material import Material

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "zx")
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
ORDER = 2
"""Degree to which the rule of the sampling points is exact; 1 of linear elements."""
BATCH = 4096
OUTSIDE = 1e-2
"""How far a place may lie outside an element, in its barycentric coordinates: quadratic elements deviate from a true
surface by less than a hundredth of their size."""
REACH = 0.2
"""By how much of its extent an element may bulge beyond its nodes."""
ITERATIONS, CONVERGED = 30, 1e-12


def strain_rows(mesh: MeshRecord, nodes: np.ndarray, material: Material | None = None) -> sparse.csr_matrix:
    """Return the recovered strain at nodes (s,) over the nodal displacements, (6 s, 3 n), node by node.

    The strain across a plane part is zero here; `complete_strain` adds it. Incompatible modes need the material.
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
    if "incompatible" in mesh.formulations:
        assert material is not None
        rows = rows + _mode_strain_rows(mesh, nodes, material)
    return sparse.csr_matrix(rows)


def nodal_gradient(mesh: MeshRecord, nodes: np.ndarray) -> list[sparse.csr_matrix]:
    """Return ∂/∂x, ∂/∂y and, of solids, ∂/∂z of a nodal field, recovered at nodes (s,), (s, n) each."""
    shape, dimension = (len(nodes), len(mesh.nodes)), cell_of(mesh).dimension
    total, volumes = [sparse.csr_matrix(shape) for _ in range(dimension)], np.zeros(len(nodes))
    for block, batch, rows in _around(mesh, nodes):
        order = _order(block)
        cells, (_, gradient, dx) = block.cells[batch], quadrature(block, order, batch)
        volume, touched = dx.sum(axis=1), rows >= 0
        at_nodes = np.einsum("cq,eaiq,e->ieca", extrapolation(cell_of(block), order), gradient, volume, optimize=True)
        row_numbers = np.broadcast_to(rows[:, :, None], at_nodes.shape[1:])
        columns = np.broadcast_to(cells[:, None], at_nodes.shape[1:])
        requested = row_numbers >= 0
        for i in range(dimension):
            entries = at_nodes[i][requested], (row_numbers[requested], columns[requested])
            total[i] += sparse.csr_matrix(entries, shape=shape)
        np.add.at(volumes, rows[touched], np.broadcast_to(volume[:, None], rows.shape)[touched])
    return [sparse.csr_matrix(sparse.diags(1 / volumes) @ T) for T in total]


def _around(mesh: MeshRecord, nodes: np.ndarray) -> Iterator[tuple[MeshRecord, np.ndarray, np.ndarray]]:
    """Yield the cells around nodes, as of `batches`, and the row of each cell's nodes among these, −1 of others."""
    row_of_node = np.full(len(mesh.nodes), -1)
    row_of_node[nodes] = np.arange(len(nodes))
    around = np.flatnonzero((row_of_node[mesh.cells] >= 0).any(axis=1))
    for block, batch, _ in batches(mesh, around, BATCH):
        yield block, batch, row_of_node[block.cells[batch]]


def _order(block: MeshRecord) -> int:
    return ORDER if cell_of(block).quadratic or "incompatible" in block.formulations else 1


def _mode_strain_rows(mesh: MeshRecord, nodes: np.ndarray, material: Material) -> sparse.csr_matrix:
    """Return what incompatible modes add to the recovered strain at nodes (s,), (6 s, 3 n)."""
    shape = (6 * len(nodes), 3 * len(mesh.nodes))
    total, volumes = sparse.csr_matrix(shape), np.zeros(len(nodes))
    for block, batch, rows in _around(mesh, nodes):
        cells, (_, gradient, dx) = block.cells[batch], quadrature(block, ORDER, batch)
        volume, touched = dx.sum(axis=1), rows >= 0
        np.add.at(volumes, rows[touched], np.broadcast_to(volume[:, None], rows.shape)[touched])
        if "incompatible" not in block.formulations:
            continue
        units = np.broadcast_to(np.eye(24).reshape(8, 3, 24), (len(batch), 8, 3, 24))
        slopes = mode_slopes(block.nodes[cells], gradient, dx, material, units)
        strain = np.stack([0.5 * (slopes[:, :, i, j] + slopes[:, :, j, i]) for i, j in PAIRS], axis=2)
        at_nodes = np.einsum("cq,eqsd,e->ecsd", extrapolation(cell_of(block), ORDER), strain, volume, optimize=True)
        row_numbers = np.where(touched[:, :, None], 6 * rows[:, :, None] + np.arange(6), -1)
        dofs = (3 * cells[:, :, None] + np.arange(3)).reshape(len(batch), 24)
        row_numbers = np.broadcast_to(row_numbers[..., None], at_nodes.shape)
        columns = np.broadcast_to(dofs[:, None, None], at_nodes.shape)
        requested = row_numbers >= 0
        total += sparse.csr_matrix((at_nodes[requested], (row_numbers[requested], columns[requested])), shape=shape)
    return sparse.csr_matrix(sparse.diags(np.repeat(1 / volumes, 6)) @ total)


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
    containing, best = None, -np.inf
    for cell, _, nodes in cell_blocks(mesh):
        corners = mesh.nodes[nodes]
        low, high = corners.min(axis=1), corners.max(axis=1)
        room = REACH * (high - low).max(axis=1, keepdims=True)
        for row in np.flatnonzero(((point >= low - room) & (point <= high + room)).all(axis=1)):
            X = _place(cell, corners[row], point)
            if X is not None and (margin := _margin(cell, X)) > best:
                containing, best = (cell, nodes[row], X), margin
    off_plane = dimension == 2 and abs(point[2]) > OUTSIDE * np.ptp(mesh.nodes, axis=0).max()
    if containing is None or best < -OUTSIDE or off_plane:
        nearest = float(np.linalg.norm(mesh.nodes - point, axis=1).min())
        raise InputError(
            f"{key}: {point.tolist()} given, it lies outside the part; the nearest node is {nearest:.4g} m away"
        )
    cell, nodes, X = containing
    return nodes, shape_functions(cell, X[:, None])[0][:, 0]


def _margin(cell: Cell, X: np.ndarray) -> float:
    """Return how far a place of a reference cell lies within its sides; below zero outside."""
    if cell.shape is PYRAMID:
        return float(min(X[2], *(1 - X[2] - np.abs(X[:2]))))
    if cell.shape is HEXAHEDRON:
        return float(min(X.min(), 1 - X.max()))
    if cell.shape is WEDGE:
        return float(min(X.min(), 1 - X[0] - X[1], 1 - X[2]))
    return float(min(X.min(), 1 - X.sum()))


def _place(cell: Cell, nodes: np.ndarray, point: np.ndarray) -> np.ndarray | None:
    """Return a point's coordinates in the reference element (k,), or None if Newton's method does not converge.

    Args:
        nodes: Of the element [m], (a, 3).
    """
    dimension = cell.dimension
    x = nodes[:, :dimension]
    X = np.array(CORNERS[cell.shape], float).mean(axis=0)
    for _ in range(ITERATIONS):
        N, dN = shape_functions(cell, X[:, None])
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
