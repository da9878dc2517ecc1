"""Shape functions and quadrature of quadrilaterals, hexahedra, wedges and pyramids, in the node order of records.

An element is the span of its monomials ξ^i η^j ζ^k / (1 − ζ)^m, and its shape functions are the basis of that span that
is one at a node and zero at the others: N = V(ξ) V(ξ_nodes)⁻¹. Reference cells are the unit square and cube, the unit
triangle times [0, 1], and the pyramid on [−1, 1]² whose apex is (0, 0, 1).

Hexahedra and wedges: serendipity and full spaces (Zienkiewicz & Taylor 2000). Pyramids: the rational spaces of
Bedrosian (Int. J. Numer. Meth. Eng. 35 (1992) 95) with 5 and 13 nodes, that of Bergot, Cohen & Duruflé (J. Sci. Comput.
42 (2010) 345) with 14: on their triangles they are the polynomials of tetrahedra, on the base those of hexahedra.
"""

from functools import cache
from itertools import product

import numpy as np

from gudgeon.pipeline.geometry.cells import (
    HEXAHEDRON,
    HEXAHEDRON8,
    HEXAHEDRON20,
    HEXAHEDRON27,
    LINE,
    PYRAMID,
    PYRAMID5,
    PYRAMID13,
    PYRAMID14,
    QUADRANGLE,
    QUADRANGLE4,
    QUADRANGLE8,
    QUADRANGLE9,
    TETRAHEDRON,
    TRIANGLE,
    WEDGE,
    WEDGE6,
    WEDGE15,
    WEDGE18,
    Cell,
    Polytope,
)

APEX = 1e-12
"""Least 1 − ζ: at the apex itself the gradients are those along the axis."""
CORNERS: dict[Polytope, list[list[float]]] = {
    LINE: [[0], [1]],
    TRIANGLE: [[0, 0], [1, 0], [0, 1]],
    QUADRANGLE: [[0, 0], [1, 0], [1, 1], [0, 1]],
    TETRAHEDRON: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    HEXAHEDRON: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
    WEDGE: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]],
    PYRAMID: [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [0, 0, 1]],
}
"""Places ξ of the corners of reference cells, those of scikit-fem where it has them."""

_TENSOR = {degree: list(product(range(degree + 1), repeat=3)) for degree in (1, 2)}
_P2 = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]
_PYRAMID = [(0, 0, 0, 0), (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (1, 1, 0, 1)]
_PYRAMID2 = [
    (2, 0, 0, 0),
    (0, 2, 0, 0),
    (0, 0, 2, 0),
    (1, 0, 1, 0),
    (0, 1, 1, 0),
    (1, 1, 0, 0),
    (2, 1, 0, 1),
    (1, 2, 0, 1),
]
SPANS: dict[Cell, list[tuple[int, ...]]] = {
    QUADRANGLE4: list(product(range(2), repeat=2)),
    QUADRANGLE8: [e for e in product(range(3), repeat=2) if e != (2, 2)],
    QUADRANGLE9: list(product(range(3), repeat=2)),
    HEXAHEDRON8: _TENSOR[1],
    HEXAHEDRON20: [e for e in _TENSOR[2] if e.count(2) <= 1],
    HEXAHEDRON27: _TENSOR[2],
    WEDGE6: [(*e, k) for e in _P2[:3] for k in range(2)],
    WEDGE15: [(*e, k) for e in _P2 for k in range(2)] + [(*e, 2) for e in _P2[:3]],
    WEDGE18: [(*e, k) for e in _P2 for k in range(3)],
    PYRAMID5: _PYRAMID,
    PYRAMID13: _PYRAMID + _PYRAMID2,
    PYRAMID14: _PYRAMID + _PYRAMID2 + [(2, 2, 0, 2)],
}
"""Exponents i, j, k, m of the monomials of each element, i and j alone on quadrilaterals."""
LINEAR = {cell.shape: cell for cell in (QUADRANGLE4, HEXAHEDRON8, WEDGE6, PYRAMID5)}
"""Elements of the corners alone."""


def shape_functions(cell: Cell, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return N (a, q) and ∂N/∂ξ (a, k, q) at places ξ of the reference cell, (k, q)."""
    values, gradients = _monomials(cell, X)
    inverse = _nodal_basis(cell)
    return inverse @ values, np.einsum("ab,bkq->akq", inverse, gradients)


def reference_nodes(cell: Cell) -> np.ndarray:
    """Return the places ξ of the nodes of a reference cell, (a, k)."""
    corners = np.array(CORNERS[cell.shape], float)
    return np.array([*corners, *(corners[around].mean(axis=0) for around in cell.centres)])


def linear_fields(cell: Cell, X: np.ndarray) -> np.ndarray:
    """Return a basis of the fields of the element of the corners alone at places ξ (k, q), (b, q)."""
    if cell not in SPANS:
        return np.vstack([np.ones(X.shape[1]), X])
    return _monomials(LINEAR[cell.shape], X)[0]


def rule(shape: Polytope, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points ξ (k, q) and weights (q,) of a quadrature that is exact to the degree `order` of polynomials.

    Products of Gauss's rules; on a pyramid those along the axis have the weight (1 − ζ)² of its sections.
    """
    from scipy.special import roots_jacobi
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefLine, RefTri

    t, w = get_quadrature(RefLine, order)
    if shape is WEDGE:
        s, v = get_quadrature(RefTri, order)
        return np.vstack([np.repeat(s, t.shape[1], axis=1), np.tile(t, s.shape[1])]), np.outer(v, w).ravel()
    lines = [t[0]] * shape.dimension
    weights = [w] * shape.dimension
    if shape is PYRAMID:
        z, v = roots_jacobi(len(w), 2.0, 0.0)
        lines[2], weights[2] = (1 + z) / 2, v / 8
    X = np.array([axis.ravel() for axis in np.meshgrid(*lines, indexing="ij")])
    W = np.prod([axis.ravel() for axis in np.meshgrid(*weights, indexing="ij")], axis=0)
    if shape is PYRAMID:
        X[:2] = (2 * X[:2] - 1) * (1 - X[2])
        W = 4 * W
    return X, W


@cache
def _nodal_basis(cell: Cell) -> np.ndarray:
    """Return the coefficients of the monomials in each shape function, (a, a)."""
    return np.linalg.inv(_monomials(cell, reference_nodes(cell).T)[0])


def _monomials(cell: Cell, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the monomials of an element (a, q) and their gradients (a, k, q) at places ξ (k, q)."""
    powers = np.array(SPANS[cell])
    d = len(X)
    factors, slopes = [], []
    for x, exponents in zip(X, powers.T, strict=False):
        factors.append(x ** exponents[:, None])
        slopes.append(exponents[:, None] * x ** np.maximum(exponents - 1, 0)[:, None])
    gradients = [np.prod([slopes[k] if k == i else factors[k] for k in range(d)], axis=0) for i in range(d)]
    values = np.prod(factors, axis=0)
    if powers.shape[1] > d:
        m, depth = powers[:, d:], np.maximum(1 - X[2], APEX)
        scale = depth ** -m.astype(float)
        gradients = [slope * scale for slope in gradients]
        gradients[2] = gradients[2] + m * values * scale / depth
        values = values * scale
    return values, np.stack(gradients, axis=1)
