"""Matrices of Ansys: in a .full, read by ansys-mapdl-reader, and those of a substructure (.sub)."""

import importlib
from types import ModuleType
from typing import Any

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.decks.ansys.substructure import read_substructure
from gudgeon.pipeline.geometry.matrices.model import Given, checked_symmetric


def read_full(path: str) -> Given:
    """Read stiffness and mass of a .full; degrees of freedom that Ansys holds are left out.

    Raises:
        InputError: the file is missing, of another kind or release, or has no mass.
    """
    reader = _reader(path)
    try:
        full: Any = reader.read_binary(path)
        dofs, K, M = full.load_km(sort=False)
        constrained = {tuple(pair) for pair in np.asarray(full.const, int).reshape(-1, 2).tolist()}
    except Exception as error:  # The reader raises anything where bytes are not what it expects.
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise InputError(f"{path}: cannot be read as a .full of Ansys ({reason})") from None
    if K is None or M is None or M.nnz == 0:
        raise InputError(f"{path}: has no {'stiffness' if K is None else 'mass'}; allowed: a .full of a modal analysis")
    free = np.array([k for k, pair in enumerate(np.asarray(dofs, int).tolist()) if tuple(pair) not in constrained], int)
    A, B = (_whole(matrix, path)[free][:, free] for matrix in (K, M))
    return Given(sparse.csr_matrix(A), sparse.csr_matrix(B), np.asarray(dofs, int)[free])


def read_sub(path: str) -> Given:
    """Read stiffness and mass of a substructure.

    Raises:
        InputError: the file is missing, damaged, or what it has is not read.
    """
    sub = read_substructure(path)
    K, M = (checked_symmetric(sparse.csr_matrix(A), path) for A in (sub.stiffness, sub.mass))
    return Given(K, M, sub.rows)


def _reader(path: str) -> ModuleType:
    try:
        return importlib.import_module("ansys.mapdl.reader")
    except ImportError:
        raise InputError(
            f"{path}: is read by ansys-mapdl-reader, which is not installed; run pip install ansys-mapdl-reader"
        ) from None


def _whole(A: Any, path: str) -> sparse.csr_matrix:
    """Return a matrix of which the file has one triangle."""
    A = sparse.csr_matrix(A)
    lower, upper = sparse.tril(A, -1), sparse.triu(A, 1)
    if lower.nnz and upper.nnz:
        return checked_symmetric(A, path)
    return checked_symmetric(sparse.csr_matrix(A + A.T - sparse.diags(A.diagonal())), path)
