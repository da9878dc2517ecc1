"""Matrices of Nastran: OUTPUT4, which has rows only, or DMIG, whose entries name grid points and directions."""

from collections.abc import Mapping
from typing import TypeVar

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.decks.nastran.bulk import Card, read_cards
from gudgeon.pipeline.geometry.matrices.model import Given, checked_symmetric, symmetric
from gudgeon.pipeline.geometry.matrices.output4 import read_output4
from gudgeon.pipeline.geometry.matrices.text_matrix import read_dofs

REAL, SQUARE, SYMMETRIC = ("1", "2"), "1", "6"
"""Types and forms of DMIG."""
FIRST, ENTRY = 4, 4
"""Field of the first entry of a column, and fields of each: grid point, direction, real and imaginary part."""
Entries = dict[tuple[tuple[int, int], tuple[int, int]], float]
"""By node and direction of row and column."""
Matrix = TypeVar("Matrix")


def read_op4(stiffness: str, mass: str, names: tuple[str | None, str | None], dofs: str | None) -> Given:
    """Read matrices of one or two OUTPUT4 files, and the file that maps rows to nodes.

    Raises:
        InputError: a file is missing or no OUTPUT4, has no such matrix, or they differ in size.
    """
    matrices_read = []
    for path, name, initial in ((stiffness, names[0], "k"), (mass, names[1], "m")):
        matrix = _chosen(read_output4(path), name, initial, path)
        matrices_read.append(checked_symmetric(_square(matrix, path), path))
    K, M = matrices_read
    if K.shape != M.shape:
        raise InputError(f"{mass}: has {M.shape[0]} rows, {stiffness} has {K.shape[0]}; allowed: matrices of one size")
    rows = None if dofs is None else read_dofs(dofs)
    if rows is not None and len(rows) != K.shape[0]:
        raise InputError(f"{dofs}: names {len(rows)} degrees of freedom, {stiffness} has {K.shape[0]} rows")
    return Given(K, M, rows)


def read_dmig(stiffness: str, mass: str, names: tuple[str | None, str | None]) -> Given:
    """Read matrices of one or two files of DMIG cards; rows are the grid points and directions of the stiffness.

    Raises:
        InputError: a file is missing or has no such DMIG, or the mass has a row that the stiffness has not.
    """
    K, M = (
        _chosen(dmig_entries(path), name, initial, path)
        for path, name, initial in ((stiffness, names[0], "k"), (mass, names[1], "m"))
    )
    labels = sorted({label for pair in K for label in pair})
    row_of = {label: row for row, label in enumerate(labels)}
    if extra := sorted({label for pair in M for label in pair} - row_of.keys()):
        node, direction = extra[0]
        raise InputError(f"{mass}: names node {node} direction {direction}, which {stiffness} does not have")

    def matrix(table: Entries, path: str) -> sparse.csr_matrix:
        rows, columns = (np.array([row_of[pair[k]] for pair in table], int) for k in range(2))
        return symmetric(rows, columns, np.array(list(table.values()), float), len(labels), path)

    return Given(matrix(K, stiffness), matrix(M, mass), np.array(labels, int).reshape(-1, 2) - [0, 1])


def dmig_entries(path: str) -> dict[str, Entries]:
    """Return the entries of each DMIG of a file.

    Raises:
        InputError: a card is wrong, or a matrix is complex or not square.
    """
    matrices: dict[str, Entries] = {}
    for card in read_cards(path):
        if card.name != "DMIG":
            continue
        name = card.text(0)
        if card.text(1) == "0":
            if card.text(2) not in (SQUARE, SYMMETRIC) or card.text(3) not in REAL:
                raise card.source.error(f"DMIG {name} is of form {card.text(2)}, type {card.text(3)}; allowed: square"
                                        f" or symmetric, {SQUARE} or {SYMMETRIC}, and real, 1 or 2")  # fmt: skip
            matrices.setdefault(name, {})
        elif name in matrices:
            _add_column(card, matrices[name])
        else:
            raise card.source.error(f"DMIG {name} has a column before its header")
    return matrices


def _add_column(card: Card, entries: Entries) -> None:
    column = card.integer(1), card.integer(2, 0)
    for k in range(FIRST, len(card.fields), ENTRY):
        if card.text(k):
            entries[(card.integer(k), card.integer(k + 1, 0)), column] = card.real(k + 2)


def _chosen(matrices: Mapping[str, Matrix], name: str | None, initial: str, path: str) -> Matrix:
    """Return the matrix of a name, or the only one, or the only one whose name begins so."""
    have = ", ".join(matrices) or "none"
    if name is not None:
        if name.lower() not in (lower := {key.lower(): value for key, value in matrices.items()}):
            raise InputError(f"{path}: has no matrix '{name}', it has {have}")
        return lower[name.lower()]
    fitting = [key for key in matrices if key.lower().startswith(initial)]
    if len(matrices) != 1 and len(fitting) != 1:
        key = "stiffness_name" if initial == "k" else "mass_name"
        raise InputError(f"{path}: has the matrices {have}; name one by geometry.{key}")
    return matrices[fitting[0] if len(matrices) > 1 else next(iter(matrices))]


def _square(A: sparse.csr_matrix, path: str) -> sparse.csr_matrix:
    if A.shape[0] != A.shape[1]:
        raise InputError(f"{path}: has {A.shape[0]} rows and {A.shape[1]} columns; allowed: a square matrix")
    return A
