"""Rows of matrices: nodes and their directions, and the generalised coordinates of superelements."""

from collections.abc import Mapping

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.mesh import GENERALISED, SystemMatrices
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.decks.model import SCALAR, Deck
from gudgeon.pipeline.geometry.matrices.model import Given, MatrixFiles

TRANSLATIONS = 3
TRIPLES = (slice(0, 3), slice(3, 6))
"""Directions that turn together: translations, rotations."""


def matrix_rows(files: MatrixFiles, matrices: Given, model: Deck) -> np.ndarray:
    """Return row of the model's node, from 0, and direction of each degree of freedom, (N, 2); of generalised
    coordinates 0 and `GENERALISED`.

    Raises:
        InputError: the rows do not fit the model, or one stands twice.
    """
    labelled, source = matrices.dofs, files.dofs or files.stiffness
    if labelled is None:
        labelled = _stated_rows(files, matrices.K.shape[0], model)
    if (wrong := labelled[(labelled[:, 1] < SCALAR) | (labelled[:, 1] > 5)]).size:
        raise InputError(f"{source}: node {wrong[0, 0]} has direction {wrong[0, 1] + 1}; allowed: 1 to 6")
    _, indices, times = np.unique(labelled, axis=0, return_index=True, return_counts=True)
    if (times > 1).any():
        label, direction = labelled[indices[times > 1][0]]
        raise InputError(f"{source}: node {label} direction {direction + 1} is given twice")
    generalised = (labelled[:, 1] == SCALAR) | np.isin(labelled[:, 0], model.scalar_points)
    if len(model.generalised):
        generalised |= (labelled[:, None] == model.generalised).all(axis=2).any(axis=1)
    dofs = np.tile([0, GENERALISED], (len(labelled), 1))
    dofs[~generalised, 0] = model.rows(labelled[~generalised, 0], source)
    dofs[~generalised, 1] = labelled[~generalised, 1]
    return dofs


def _stated_rows(files: MatrixFiles, size: int, model: Deck) -> np.ndarray:
    """Return label and direction of each row of a file that has rows only, (N, 2): those that the model keeps, or all
    in ascending order."""
    if model.retained is not None and len(model.retained) == size:
        return model.retained
    count, scalars = len(model.labels), model.scalar_points
    for each in (3, 6):
        if each * count + len(scalars) == size:
            nodes = np.column_stack([np.repeat(model.labels, each), np.tile(np.arange(each), count)])
            every = np.concatenate([nodes, np.column_stack([scalars, np.full(len(scalars), SCALAR)])])
            return every[np.argsort(every[:, 0], kind="stable")]
    beside = f" and its {len(scalars)} scalar points" if len(scalars) else ""
    retained = "" if model.retained is None else f"; those that it retains are {len(model.retained)}"
    raise InputError(
        f"{files.stiffness}: has {size} rows, the {count} nodes of {files.model}{beside} have"
        f" {3 * count + len(scalars)} with three directions or {6 * count + len(scalars)} with six{retained}; state"
        " node and direction of each row by geometry.dofs"
    )


def centre_of_mass(system: SystemMatrices, points: np.ndarray) -> np.ndarray:
    """Return the centre of mass of matrices by their rigid motions [m], (3,); `points` are the nodes [m], (n, 3)."""
    turns, motions = system.directions - TRANSLATIONS, np.zeros((len(system.nodes), 6))
    for axis, unit in enumerate(np.eye(3)):
        motions[system.directions == axis, axis] = 1.0
        shifts = np.cross(unit, points)
        moved = system.directions < TRANSLATIONS
        motions[moved, 3 + axis] = shifts[system.nodes[moved], system.directions[moved]]
        motions[turns == axis, 3 + axis] = 1.0
    half = system.mass
    upper = sparse.csr_matrix((half.values, (half.rows, half.columns)), shape=(len(turns), len(turns)))
    inertia = motions.T @ (upper @ motions)
    inertia += inertia.T - motions.T @ (upper.diagonal()[:, None] * motions)
    lever, mass = inertia[3:, :3], inertia.diagonal()[:3].max()
    if not mass > 0:  # The assembly names the node that has none.
        return np.asarray(points.mean(axis=0))
    return np.array([lever[1, 2] - lever[2, 1], lever[2, 0] - lever[0, 2], lever[0, 1] - lever[1, 0]]) / (-2 * mass)


def to_basic_axes(files: MatrixFiles, matrices: Given, dofs: np.ndarray, model: Deck) -> Given:
    """Return matrices along the basic axes at nodes that have directions of their own (CD of Nastran, rotated nodes of
    Ansys).

    Args:
        dofs: Row of the model's node and direction of each degree of freedom, (N, 2).

    Raises:
        InputError: the matrices have not all three directions of such a node.
    """
    axes = {int(row): model.directions[label] for row, label in enumerate(model.labels) if label in model.directions}
    chosen = np.flatnonzero(np.isin(dofs[:, 0], list(axes)) & (dofs[:, 1] != GENERALISED))
    if not len(chosen):
        return matrices
    row_of = {(int(node), int(direction)): k for k, (node, direction) in enumerate(dofs) if k in set(chosen.tolist())}
    T = sparse.lil_matrix(sparse.eye(len(dofs)))
    for node in np.unique(dofs[chosen, 0]).tolist():
        for triple in TRIPLES:
            rows = [row_of.get((node, direction)) for direction in range(6)[triple]]
            if all(row is None for row in rows):
                continue
            _refuse_partial(files, rows, int(model.labels[node]), axes)
            complete = [row for row in rows if row is not None]
            T[np.ix_(complete, complete)] = axes[node].T
    T = sparse.csr_matrix(T)
    return matrices._replace(K=sparse.csr_matrix(T.T @ matrices.K @ T), M=sparse.csr_matrix(T.T @ matrices.M @ T))


def _refuse_partial(files: MatrixFiles, rows: list[int | None], label: int, axes: Mapping[int, np.ndarray]) -> None:
    if any(row is None for row in rows):
        raise InputError(
            f"{files.stiffness}: has some directions of node {label}, which {files.model} turns; allowed: all three"
            f" translations or rotations of each of its {len(axes)} turned nodes, or none"
        )
