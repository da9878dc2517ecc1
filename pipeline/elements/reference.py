"""Shape functions and quadrature on scikit-fem's reference elements, in meshio's node order."""

import numpy as np


def reference(cell_type: str, order: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return N (a, q), ∂N/∂ξ (a, k, q) and weights (q,) on scikit-fem's reference element, in meshio's node order."""
    from skfem import ElementLineP2, ElementTetP2
    from skfem.quadrature import get_quadrature

    element = ElementTetP2() if cell_type == "tetra10" else ElementLineP2()
    X, W = get_quadrature(type(element).refdom, order)
    basis = [element.lbasis(X, a) for a in range(len(element.doflocs))]
    return np.array([b[0] for b in basis]), np.array([b[1] for b in basis]), W
