"""Matrices of Nastran, read by pyyeti: OUTPUT4 or DMIG.

OUTPUT4 has rows only; DMIG names the grid points and directions of its entries.
"""

import importlib
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.matrices.model import Given, checked_symmetric
from gudgeon.pipeline.geometry.matrices.text_matrix import read_dofs


def nastran(path: str) -> tuple[ModuleType, ModuleType]:
    """Return pyyeti's modules of bulk data and of OUTPUT4, to read a file.

    Raises:
        InputError: it is not installed.
    """
    try:
        return importlib.import_module("pyyeti.nastran.bulk"), importlib.import_module("pyyeti.nastran.op4")
    except ImportError:
        raise InputError(f"{path}: is read by pyyeti, which is not installed; run pip install pyyeti") from None


def read_op4(stiffness: str, mass: str, names: tuple[str | None, str | None], dofs: str | None) -> Given:
    """Read matrices of one or two OUTPUT4 files, and the file that maps rows to nodes.

    Raises:
        InputError: a file is missing or no OUTPUT4, has no such matrix, or they differ in size.
    """
    matrices_read = []
    for path, name, initial in ((stiffness, names[0], "k"), (mass, names[1], "m")):
        matrices = _read(path, lambda p: nastran(p)[1].read(p, sparse=True), "OUTPUT4")
        matrices_read.append(checked_symmetric(_square(_chosen(matrices, name, initial, path), path), path))
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
    tables = []
    for path, name, initial in ((stiffness, names[0], "k"), (mass, names[1], "m")):
        matrices = _read(path, lambda p: nastran(p)[0].rddmig(p, square=True), "DMIG")
        tables.append(_chosen(matrices, name, initial, path))
    K, M = tables
    rows = K.index
    if len(extra := M.index.difference(rows)):
        node, direction = extra[0]
        raise InputError(f"{mass}: names node {node} direction {direction}, which {stiffness} does not have")
    M = M.reindex(index=rows, columns=rows, fill_value=0.0)
    A, B = (
        checked_symmetric(sparse.csr_matrix(table.loc[:, rows].to_numpy(float)), path)
        for table, path in ((K, stiffness), (M, mass))
    )
    labels = np.array(rows.to_list(), int).reshape(-1, 2)
    # A scalar point has direction 0: one degree of freedom that is none of a node.
    if (labels[:, 1] == 0).any():
        raise InputError(f"{stiffness}: row {labels[labels[:, 1] == 0][0, 0]} is a scalar point; allowed: grid points")
    return Given(A, B, labels - [0, 1])


def _read(path: str, reader: Callable[[str], Any], content: str) -> Any:
    """Return what a reader of pyyeti returns."""
    try:
        return reader(path)
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; expected {content}") from None
    except Exception as error:  # Readers of binary files raise anything.
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise InputError(f"{path}: cannot be read as {content} ({reason})") from None


def _chosen(matrices: dict[str, Any], name: str | None, initial: str, path: str) -> Any:
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


def _square(A: Any, path: str) -> sparse.csr_matrix:
    if A.shape[0] != A.shape[1]:
        raise InputError(f"{path}: has {A.shape[0]} rows and {A.shape[1]} columns; allowed: a square matrix")
    if np.iscomplexobj(A.data):
        raise InputError(f"{path}: the matrix is complex; allowed: a real one")
    return sparse.csr_matrix(A)
