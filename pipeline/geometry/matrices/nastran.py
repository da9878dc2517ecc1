"""Files of Nastran, read by pyyeti: matrices in OUTPUT4 or DMIG, and bulk data with GRID, solids and SET1.

OUTPUT4 has rows only; DMIG names the grid points and directions of its entries.
"""

import importlib
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import HEXAHEDRON8, HEXAHEDRON20, TETRA4, TETRA10, WEDGE6, WEDGE15, Cell
from gudgeon.pipeline.geometry.matrices.model import Block, Coupling, Given, Model, checked_symmetric, model_of
from gudgeon.pipeline.geometry.matrices.text_matrix import read_dofs

CARDS = {"CTETRA": (TETRA4, TETRA10), "CHEXA": (HEXAHEDRON8, HEXAHEDRON20), "CPENTA": (WEDGE6, WEDGE15)}
"""Solids by card."""
UPRIGHT = {HEXAHEDRON20: (12, 16), WEDGE15: (9, 12)}
"""Mid-edge nodes between both ends, which Nastran numbers before those of the upper end: first and last + 1."""
HEAD = 2
"""Numbers of an element before its nodes: its own and that of its property."""


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


def read_bulk(path: str) -> Model:
    """Read grid points, solids and SET1 cards, as sets `set1`, `set2`, … of their numbers.

    Raises:
        InputError: the file is missing or no bulk data, or a grid point is in another coordinate system.
    """
    bulk, _ = nastran(path)
    grids = _read(path, bulk.rdgrids, "bulk data with GRID cards")
    if grids is None or not len(grids):
        raise InputError(f"{path}: has no GRID cards")
    if (moved := grids[(grids[:, 1] != 0) | (grids[:, 5] != 0)]).size:
        raise InputError(
            f"{path}: GRID {int(moved[0, 0])} is in another coordinate system; allowed: the basic one (CP and CD blank)"
        )
    blocks, sets = _solids(bulk, path), dict[str, list[int]]()
    for row in bulk.rdcards(path, "SET1", return_var="list") or []:
        sets.setdefault(f"set{row[0]}", []).extend(_listed(row[1:]))
    couplings, coupled = _rigid_elements(bulk, path)
    sets |= coupled
    labels = grids[:, 0].astype(int)
    members = {name: np.intersect1d(np.array(chosen, int), labels) for name, chosen in sets.items()}
    dependent = np.unique(np.array([n for name in coupled if name.startswith("rbe2") for n in coupled[name]], int))
    return model_of(labels, grids[:, 2:5], blocks, members, {}, path, couplings=couplings, dependent=dependent)


def _solids(bulk: ModuleType, path: str) -> list[Block]:
    """Return the solid elements, one block a card and number of nodes."""
    blocks: list[Block] = []
    for card, cells in CARDS.items():
        rows = bulk.rdcards(path, card, return_var="list") or []
        for cell in cells:
            table = np.array([_whole(row, card, path) for row in rows if len(row) - HEAD == cell.nodes], int)
            if len(table):
                blocks.append(Block(cell, table[:, 0], _ordered(table[:, HEAD:], cell)))
        allowed = [cell.nodes for cell in cells]
        if wrong := [row for row in rows if len(row) - HEAD not in allowed]:
            have = " or ".join(map(str, allowed))
            raise InputError(f"{path}: {card} {wrong[0][0]} has {len(wrong[0]) - HEAD} nodes, allowed: {have}")
    return blocks


def _rigid_elements(bulk: ModuleType, path: str) -> tuple[list[Coupling], dict[str, list[int]]]:
    """Return RBE2 and RBE3 cards as couplings, and their grid points by names `rbe2_EID` and `rbe3_EID`.

    An RBE2 that does not carry all translations is none; weights of an RBE3 are not read.
    """
    couplings, sets = [], {}
    for row in bulk.rdcards(path, "RBE2", return_var="list") or []:
        if {"1", "2", "3"} <= set(str(row[2])):
            name = f"rbe2_{row[0]}"
            sets[name] = _listed(row[3:])
            couplings.append(Coupling(name, name, int(row[1]), "rbe2"))
    for row in bulk.rdcards(path, "RBE3", return_var="list") or []:
        name, members, i = f"rbe3_{row[0]}", list[int](), 4
        while i < len(row) and isinstance(row[i], float):
            i += 2  # A weight and its directions, then the grid points.
            while i < len(row) and isinstance(row[i], int):
                members.append(row[i])
                i += 1
        sets[name] = members
        couplings.append(Coupling(name, name, int(row[2]), "rbe3"))
    return couplings, sets


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


def _whole(row: list[Any], card: str, path: str) -> list[int]:
    if not all(isinstance(v, int) for v in row):
        raise InputError(f"{path}: {card} {row[0]} has a blank or a number that is not whole among its nodes")
    return row


def _ordered(nodes: np.ndarray, cell: Cell) -> np.ndarray:
    """Return nodes with those of upright edges last."""
    if cell not in UPRIGHT:
        return nodes
    start, stop = UPRIGHT[cell]
    return np.hstack([nodes[:, :start], nodes[:, stop:], nodes[:, start:stop]])


def _listed(values: list[Any]) -> list[int]:
    """Return the members of a set: numbers, and ranges `a THRU b`."""
    if len(values) == 3 and str(values[1]).strip().upper() == "THRU":
        return list(range(int(values[0]), int(values[2]) + 1))
    return [int(v) for v in values if isinstance(v, int)]
