"""Reduced matrices of Sierra/SD in Exodus II (.nc4, .e, .exo): `Kr`, `Mr`, and their rows in `cbmap`."""

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.decks.exodus import read_variables
from gudgeon.pipeline.geometry.decks.model import SCALAR
from gudgeon.pipeline.geometry.matrices.model import Given, checked_symmetric

STIFFNESS, MASS, ROWS = "Kr", "Mr", "cbmap"


def read_reduced(path: str, names: tuple[str | None, str | None]) -> Given:
    """Read stiffness and mass; rows whose node is 0 are amplitudes of fixed-interface modes.

    Raises:
        InputError: the file is missing, damaged, or has no such matrices.
    """
    K_name, M_name = names[0] or STIFFNESS, names[1] or MASS
    arrays = read_variables(path, lambda name: name in (K_name, M_name, ROWS))[0]
    if missing := [name for name in (K_name, M_name, ROWS) if name not in arrays]:
        raise InputError(f"{path}: has no variable {missing[0]}; allowed: reduced matrices with {ROWS}")
    if wrong := [name for name in (K_name, M_name, ROWS) if arrays[name].dtype.kind not in "iuf"]:
        raise InputError(f"{path}: the variable {wrong[0]} is not of numbers; allowed: reduced matrices with {ROWS}")
    rows = np.asarray(arrays[ROWS], np.int64)
    K, M = (np.asarray(arrays[name], float) for name in (K_name, M_name))
    if rows.ndim != 2 or rows.shape[1] != 2 or K.shape != (len(rows), len(rows)) or M.shape != K.shape:
        raise InputError(f"{path}: the variables {K_name} are {K.shape}, {M_name} {M.shape}, {ROWS} {rows.shape};"
                         " allowed: (N, N) and (N, 2)")  # fmt: skip
    modal = rows[:, 0] <= 0
    labelled = np.column_stack([rows[:, 0], rows[:, 1] - 1])
    labelled[modal] = np.column_stack([-1 - np.arange(modal.sum()), np.full(modal.sum(), SCALAR)])
    K, M = (checked_symmetric(sparse.csr_matrix(A), path) for A in (K, M))
    return Given(K, M, labelled)
