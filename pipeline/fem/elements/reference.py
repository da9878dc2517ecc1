"""Shape functions and quadrature on scikit-fem's reference elements, in meshio's node order."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.fem.elements import shapes
from gudgeon.pipeline.geometry.cells import (
    LINE,
    TETRA4,
    TETRAHEDRON,
    TRIANGLE,
    Cell,
    block_meshes,
    cell_blocks,
    cell_of,
)
from gudgeon.pipeline.geometry.soundness import refuse_degenerate

STIFFNESS_ORDER, MASS_ORDER = 4, 6
"""Polynomial degree that the quadrature of quadratic elements integrates exactly. Straight tetrahedra need 2 and 4; the
Jacobians of curved ones add to both. Higher degrees do not change the first seven digits of any frequency of the
skirt. Products of Gauss's rules are exact to an odd degree: 5 with 27 points, which curved hexahedra need in a patch
test."""
LINEAR_ORDERS = 2, 4
"""The same of linear elements."""
CONSTANT_STRAIN = 1, 2
"""The same of a tetrahedron of four nodes."""


def orders(cell: Cell) -> tuple[int, int]:
    """Return the degrees of the quadrature for stiffness and mass."""
    if cell is TETRA4:
        return CONSTANT_STRAIN
    return (STIFFNESS_ORDER, MASS_ORDER) if cell.quadratic else LINEAR_ORDERS


def reference(cell: Cell, order: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return N (a, q), ∂N/∂ξ (a, k, q) and weights (q,) of `rule`, in meshio's node order."""
    X, W = rule(cell, order)
    return *shape_functions(cell, X), W


def rule(cell: Cell, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points ξ (k, q) and weights (q,) of the quadrature that is exact to the polynomial degree `order`."""
    from skfem.quadrature import get_quadrature

    if cell in shapes.SPANS:
        return shapes.rule(cell.shape, order)
    return get_quadrature(type(_basis(cell)).refdom, order)


def shape_functions(cell: Cell, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return N (a, q) and ∂N/∂ξ (a, k, q) at places ξ of the reference element, (k, q)."""
    if cell in shapes.SPANS:
        return shapes.shape_functions(cell, X)
    basis = _basis(cell)
    values = [basis.lbasis(X, a) for a in range(cell.nodes)]
    return np.array([N for N, _ in values]), np.array([dN for _, dN in values])


def quadrature(
    mesh: MeshRecord, order: int, cells: np.ndarray | slice = slice(None), numbers: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return N (a, q), ∂N/∂x [1/m] (e, a, d, q) and weights × |∂x/∂ξ| (e, q) of isoparametric cells of one type.

    Args:
        cells: Those to be integrated.
        numbers: Of all cells, for messages; default: from 0.

    Raises:
        InputError: an element has no volume, or no area, or is inverted.
    """
    cell = cell_of(mesh)
    N, dN, W = reference(cell, order)
    x = mesh.nodes[mesh.cells[cells]][:, :, : cell.dimension]
    adjugate, det = adjugates(jacobians(x, dN))
    refuse_degenerate(x, det, (np.arange(len(mesh.cells)) if numbers is None else numbers)[cells])
    return N, np.einsum("akq,kieq->eaiq", dN, adjugate / det, optimize=True), det * W


def jacobians(x: np.ndarray, dN: np.ndarray) -> np.ndarray:
    """Return ∂x_i/∂ξ_k (i, k, e, q) of elements with nodes x (e, a, i) and shape gradients dN (a, k, q)."""
    along = x.transpose(2, 0, 1).reshape(-1, len(dN)) @ dN.reshape(len(dN), -1)
    return along.reshape(x.shape[2], len(x), *dN.shape[1:]).transpose(0, 2, 1, 3)


def adjugates(J: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return adj J (k, i, …), with J⁻¹ = adj J / det J, and det J (…) of matrices J (i, k, …), 1 × 1 to 3 × 3.

    By their formulas: of many matrices ten times faster than factorisations.
    """
    if len(J) == 1:
        return np.ones_like(J), J[0, 0]
    if len(J) == 2:
        (a, b), (c, d) = J
        return np.array([[d, -b], [-c, a]]), a * d - b * c
    (a, b, c), (d, e, f), (g, h, i) = J
    A, B, C = e * i - f * h, f * g - d * i, d * h - e * g
    adjugate = [[A, c * h - b * i, b * f - c * e], [B, a * i - c * g, c * d - a * f], [C, b * g - a * h, a * e - b * d]]
    return np.array(adjugate), a * A + b * B + c * C


def determinants(J: np.ndarray) -> np.ndarray:
    """Return the determinants (…) of matrices J (3, 3, …)."""
    (a, b, c), (d, e, f), (g, h, i) = J
    return a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g)


def nodal_jacobians(mesh: MeshRecord) -> np.ndarray:
    """Return the least and the largest det(∂x/∂ξ) at the nodes of every cell, (e, 2); positive in a valid one."""
    ranges = np.empty((len(mesh.cells), 2))
    for cell, rows, nodes in cell_blocks(mesh):
        _, dN = shape_functions(cell, shapes.reference_nodes(cell).T)
        det = adjugates(jacobians(mesh.nodes[nodes][:, :, : cell.dimension], dN))[1]
        ranges[rows] = np.column_stack([det.min(axis=1), det.max(axis=1)])
    return ranges


def batches(mesh: MeshRecord, cells: np.ndarray, size: int) -> Iterator[tuple[MeshRecord, np.ndarray, np.ndarray]]:
    """Yield chosen cells, `size` or fewer at once and of one type: their mesh, see `block_meshes`, their numbers in it,
    and those in the whole mesh."""
    for rows, block in block_meshes(mesh):
        local = np.flatnonzero(np.isin(rows, cells))
        for start in range(0, len(local), size):
            batch = local[start : start + size]
            yield block, batch, rows[batch]


def extrapolation(cell: Cell, order: int) -> np.ndarray:
    """Return E (a, q): values at the nodes of the field nearest to values at the points of a quadrature, linear as in
    elements of the corners alone; of one point the constant."""
    X, _ = rule(cell, order)
    if X.shape[1] == 1:
        return np.ones((cell.nodes, 1))
    fields = [shapes.linear_fields(cell, xi) for xi in (shapes.reference_nodes(cell).T, X)]
    return fields[0].T @ np.linalg.pinv(fields[1].T)


def _basis(cell: Cell) -> Any:
    from skfem import ElementLineP2, ElementTetP1, ElementTetP2, ElementTriP1, ElementTriP2

    if not cell.quadratic:
        return {TRIANGLE: ElementTriP1, TETRAHEDRON: ElementTetP1}[cell.shape]()
    return {LINE: ElementLineP2, TRIANGLE: ElementTriP2, TETRAHEDRON: ElementTetP2}[cell.shape]()
