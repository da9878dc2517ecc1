"""Hexahedra of 8 nodes with incompatible modes, which do not lock in bending.

Three modes 1 − s_k², s_k along the axes of the reference cell, are added to the displacements of each element and
condensed. Their gradients are formed by the Jacobian at the centre, so that a constant stress does no work on them and
the patch test holds (Taylor, Beresford & Wilson, Int. J. Numer. Meth. Eng. 10 (1976) 1211).
"""

import numpy as np

from gudgeon.pipeline.fem.elements.materials import stiffness_of
from gudgeon.pipeline.fem.elements.reference import LINEAR_ORDERS, adjugates, jacobians, rule, shape_functions
from gudgeon.pipeline.geometry.cells import HEXAHEDRON8
from gudgeon.pipeline.scenes.material import Material

CENTRE = np.full((3, 1), 0.5)
"""Centre of the reference cell."""


def mode_gradients(x: np.ndarray, dx: np.ndarray) -> np.ndarray:
    """Return ∂M/∂x [1/m] of the incompatible modes, (e, 3, 3, q), of elements with nodes x [m] (e, 8, 3).

    Args:
        dx: Weights × |∂x/∂ξ| of the quadrature of the stiffness [m^3], (e, q).
    """
    X, W = rule(HEXAHEDRON8, LINEAR_ORDERS[0])
    adjugate, _ = adjugates(jacobians(x, shape_functions(HEXAHEDRON8, CENTRE)[1]))
    slopes = -4 * (2 * X - 1)
    return np.einsum("kq,kie,eq->ekiq", slopes, adjugate[..., 0], W / dx)


def incompatible_stiffness(x: np.ndarray, gradients: np.ndarray, dx: np.ndarray, material: Material) -> np.ndarray:
    """Return the condensed stiffness of elements [N/m], (e, 8, 3, 8, 3).

    Args:
        x: Nodes [m], (e, 8, 3).
        gradients: ∂N/∂x of the shape functions [1/m], (e, 8, 3, q).
        dx: As of `mode_gradients`.
    """
    K = _stiffness(x, gradients, dx, material)
    condensed = K[:, :24, :24] - K[:, :24, 24:] @ np.linalg.solve(K[:, 24:, 24:], K[:, 24:, :24])
    return condensed.reshape(-1, 8, 3, 8, 3)


def mode_amplitudes(x: np.ndarray, gradients: np.ndarray, dx: np.ndarray, material: Material) -> np.ndarray:
    """Return the amplitudes of the modes per displacement of the nodes, (e, 3, 3, 8, 3): mode, direction, node, ….

    Arguments as of `incompatible_stiffness`.
    """
    K = _stiffness(x, gradients, dx, material)
    return -np.linalg.solve(K[:, 24:, 24:], K[:, 24:, :24]).reshape(-1, 3, 3, 8, 3)


def mode_slopes(x: np.ndarray, gradients: np.ndarray, dx: np.ndarray, material: Material, u: np.ndarray) -> np.ndarray:
    """Return ∂_i u_j of the modes under displacements of the nodes (e, 8, 3, k), (e, q, 3, 3, k).

    Arguments as of `incompatible_stiffness`.
    """
    amplitudes = np.einsum("emjbc,ebck->emjk", mode_amplitudes(x, gradients, dx, material), u)
    return np.einsum("emiq,emjk->eqijk", mode_gradients(x, dx), amplitudes)


def _stiffness(x: np.ndarray, gradients: np.ndarray, dx: np.ndarray, material: Material) -> np.ndarray:
    """Return the stiffness of nodes and modes, (e, 33, 33)."""
    flat = np.concatenate([gradients, mode_gradients(x, dx)], axis=1).reshape(len(x), 33, -1)
    G = np.matmul(flat * dx[:, None], flat.transpose(0, 2, 1)).reshape(-1, 11, 3, 11, 3)
    return stiffness_of(G.transpose(0, 2, 4, 1, 3), material).transpose(0, 3, 1, 4, 2).reshape(-1, 33, 33)
