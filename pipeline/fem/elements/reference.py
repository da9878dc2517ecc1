"""Shape functions and quadrature on scikit-fem's reference elements, in meshio's node order."""

from typing import Any

import numpy as np

DIMENSIONS = {"tetra10": 3, "triangle6": 2, "line3": 1}
"""Of the cell types that have reference elements."""


def reference(cell_type: str, order: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return N (a, q), ∂N/∂ξ (a, k, q) and weights (q,) on scikit-fem's reference element, in meshio's node order.

    Args:
        order: Polynomial degree that the quadrature integrates exactly.
    """
    from skfem.quadrature import get_quadrature

    X, W = get_quadrature(type(_element(cell_type)).refdom, order)
    return *shape_functions(cell_type, X), W


def shape_functions(cell_type: str, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return N (a, q) and ∂N/∂ξ (a, k, q) at places ξ of the reference element, (k, q)."""
    element = _element(cell_type)
    basis = [element.lbasis(X, a) for a in range(len(element.doflocs))]
    return np.array([b[0] for b in basis]), np.array([b[1] for b in basis])


def extrapolation(cell_type: str, order: int) -> np.ndarray:
    """Return E (a, q): values at the nodes of the linear field nearest to values at the points of a quadrature."""
    from skfem.quadrature import get_quadrature

    element = _element(cell_type)
    X, _ = get_quadrature(type(element).refdom, order)
    linear = [np.column_stack([np.ones(len(places)), places]) for places in (element.doflocs, X.T)]
    return linear[0] @ np.linalg.pinv(linear[1])


def _element(cell_type: str) -> Any:
    from skfem import ElementLineP2, ElementTetP2, ElementTriP2

    return {"tetra10": ElementTetP2, "triangle6": ElementTriP2, "line3": ElementLineP2}[cell_type]()
