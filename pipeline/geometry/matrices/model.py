"""What files of another program hold: its nodes, elements and sets, and its matrices, by its own numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import Cell
from gudgeon.pipeline.geometry.surfaces import SurfaceRule

ASYMMETRY = 1e-9
"""Largest difference between A and Aᵀ over the largest entry: files keep 13 digits or more."""


class Block(NamedTuple):
    """Elements of one type."""

    cell: Cell
    """Of a solid."""
    labels: np.ndarray
    """(e,)"""
    nodes: np.ndarray
    """Labels of each element's nodes, (e, a)."""


class Coupling(NamedTuple):
    """Nodes of a set that a reference node leads."""

    name: str
    """As the file names it."""
    surface: str
    """Name of the set."""
    reference: int
    """Label of the reference node."""
    tie: str
    """`rbe2`: the set moves as a rigid body with the node; `rbe3`: the node has the set's mean motion."""


@dataclass(frozen=True)
class Model:
    """Nodes, elements and sets, by labels of the other program."""

    labels: np.ndarray
    """Of the nodes, (n,), ascending."""
    points: np.ndarray
    """In its unit of length, (n, 3)."""
    blocks: tuple[Block, ...] = ()
    node_sets: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Labels of nodes by name."""
    side_sets: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Pairs of an element's label and the number of its face from 0, as Abaqus counts them, (f, 2), by name."""
    couplings: tuple[Coupling, ...] = ()
    dependent: np.ndarray = field(default_factory=lambda: np.empty(0, int))
    """Labels of nodes that equations express by others: a program may have eliminated them."""

    def rows(self, labels: np.ndarray, path: str) -> np.ndarray:
        """Return the places of labels among those of the nodes, in the same shape.

        Raises:
            InputError: there is no such node; `path` is the file that names it.
        """
        rows = np.searchsorted(self.labels, labels)
        missing = self.labels[np.minimum(rows, len(self.labels) - 1)] != labels
        if missing.any():
            raise InputError(f"{path}: names node {labels[missing][0]}, which the model does not have")
        return rows


@dataclass(frozen=True)
class MatrixFiles:
    """Files of a body's matrices and what they mean; fields as in the geometry `Matrices`."""

    stiffness: str
    mass: str | None
    dofs: str | None
    model: str
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


def model_of(
    labels: np.ndarray,
    points: np.ndarray,
    blocks: list[Block],
    node_sets: Mapping[str, np.ndarray],
    side_sets: Mapping[str, np.ndarray],
    path: str,
    *,
    couplings: Sequence[Coupling] = (),
    dependent: np.ndarray | None = None,
) -> Model:
    """Return a model with its nodes in ascending order.

    Raises:
        InputError: there is no node, two have one label, or an element or coupling names one that is not there.
    """
    order = np.argsort(labels, kind="stable")
    labels, points = labels[order], points[order]
    if not len(labels):
        raise InputError(f"{path}: has no nodes")
    if (np.diff(labels) == 0).any():
        raise InputError(f"{path}: node {labels[1:][np.diff(labels) == 0][0]} is given twice; allowed: one part")
    if not np.isfinite(points).all():
        raise InputError(f"{path}: node {labels[~np.isfinite(points).all(axis=1)][0]} has no finite position")
    dependent = np.empty(0, int) if dependent is None else np.unique(dependent)
    model = Model(
        labels, points, tuple(blocks), dict(node_sets), dict(side_sets), couplings=tuple(couplings), dependent=dependent
    )
    for block in blocks:
        model.rows(block.nodes, path)
    model.rows(np.array([coupling.reference for coupling in couplings], int), path)
    return model


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
