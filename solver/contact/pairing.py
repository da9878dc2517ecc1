"""Pairs of points that face each other on two interfaces."""

import numpy as np


def facing(placed: np.ndarray, normals: np.ndarray, there: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the number of the point of another body that faces each point, their gap and their offset [m], (c,) each.

    Args:
        placed: Points [m], (c, 3).
        normals: Their outward normals, (c, 3).
        there: Points of the other body [m], (k, 3).
    """
    far = there[None] - placed[:, None]
    along = np.einsum("abi,ai->ab", far, normals)
    aside = np.linalg.norm(far - along[..., None] * normals[:, None], axis=2)
    order = aside.argmin(axis=1)
    first = np.arange(len(placed))
    return order, along[first, order], aside[first, order]
