"""What files of another program's matrices hold, by its own numbers of nodes."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.surfaces import SurfaceRule

ASYMMETRY = 1e-9
"""Largest difference between A and Aᵀ over the largest entry: files keep 13 digits or more."""


@dataclass(frozen=True)
class MatrixFiles:
    """Files of a body's matrices and what they mean; fields as in the geometry `Matrices`."""

    stiffness: str
    mass: str | None
    dofs: str | None
    model: str
    part: str | None
    instance: str | None
    stiffness_name: str | None
    mass_name: str | None
    unit: float
    mass_unit: float
    surfaces: Mapping[str, SurfaceRule]
    """True shapes by name."""


class Given(NamedTuple):
    """Stiffness and mass as they were read."""

    K: sparse.csr_matrix
    M: sparse.csr_matrix
    dofs: np.ndarray | None
    """Label of the node and direction from 0 of each row, (N, 2); None where the file has the rows only."""


def symmetric(rows: np.ndarray, columns: np.ndarray, values: np.ndarray, size: int, path: str) -> sparse.csr_matrix:
    """Return a symmetric matrix of entries, those of one triangle or of both.

    Raises:
        InputError: entries of both triangles differ; `path` is their file.
    """
    A = sparse.csr_matrix((values, (rows, columns)), shape=(size, size))
    if (rows >= columns).all() or (rows <= columns).all():
        return sparse.csr_matrix(A + A.T - sparse.diags(A.diagonal()))
    return checked_symmetric(A, path)


def checked_symmetric(A: sparse.csr_matrix, path: str) -> sparse.csr_matrix:
    """Return the symmetric part of a matrix that is symmetric but for round-off.

    Raises:
        InputError: it is not.
    """
    if not np.isfinite(A.data).all():
        raise InputError(f"{path}: a number of the matrix is not finite")
    largest = np.abs(A.data).max(initial=0.0)
    difference = np.abs((A - A.T).data).max(initial=0.0)
    if difference > ASYMMETRY * largest:
        raise InputError(
            f"{path}: the matrix is not symmetric, entries differ by {difference:.2g} of at most {largest:.2g};"
            f" allowed: {ASYMMETRY:g} of the largest"
        )
    return sparse.csr_matrix(0.5 * (A + A.T))
