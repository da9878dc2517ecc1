"""Files of Ansys, read by ansys-mapdl-reader: matrices in .full, nodes, solids and components in an archive (.cdb)."""

import importlib
from types import ModuleType
from typing import Any

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import HEXAHEDRON8, HEXAHEDRON20, TETRA4, TETRA10, WEDGE6, WEDGE15, Cell
from gudgeon.pipeline.geometry.matrices.model import Block, Given, Model, checked_symmetric, model_of

SOLIDS = (45, 62, 72, 87, 90, 92, 95, 185, 186, 187, 285)
"""Types of solid elements."""
CORNERS = 8
"""Nodes of an element as it is written: eight corners, of which some are repeated, then up to twelve others."""
QUADRATIC_TETRA = (0, 1, 2, 4, 8, 9, 11, 16, 17, 18)
WEDGE = (0, 1, 2, 4, 5, 6)
QUADRATIC_WEDGE = (0, 1, 2, 4, 5, 6, 8, 9, 11, 12, 13, 15, 16, 17, 18)


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


def read_archive(path: str) -> Model:
    """Read an archive; its components of nodes are sets.

    Raises:
        InputError: it is missing or cannot be read, or has no nodes.
    """
    reader = _reader(path)
    try:
        archive: Any = reader.Archive(path, parse_vtk=False)
        labels, points = np.asarray(archive.nnum, int), np.asarray(archive.nodes, float)[:, :3]
        types = {int(type_id): int(kind) for type_id, kind in np.asarray(archive.ekey, int)[:, :2]}
        elements = [np.asarray(element, int) for element in archive.elem]
        sets = {str(name): np.asarray(nodes, int) for name, nodes in archive.node_components.items()}
    except Exception as error:
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise InputError(f"{path}: cannot be read as an archive of Ansys ({reason})") from None
    rows: dict[Cell, list[tuple[int, list[int]]]] = {}
    for element in elements:
        if types.get(int(element[1])) in SOLIDS:
            cell, nodes = _solid(element[10:].tolist())
            rows.setdefault(cell, []).append((int(element[8]), nodes))
    blocks = [
        Block(cell, np.array([label for label, _ in some], int), np.array([nodes for _, nodes in some], int))
        for cell, some in rows.items()
    ]
    return model_of(labels, points, blocks, sets, {}, path)


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


def _solid(nodes: list[int]) -> tuple[Cell, list[int]]:
    """Return type and nodes of an element, without the corners that it repeats."""
    if len(nodes) in (4, 10):
        return (TETRA4 if len(nodes) == 4 else TETRA10), nodes
    quadratic = len(nodes) > CORNERS and all(nodes[CORNERS:])
    if nodes[2] == nodes[3] and len(set(nodes[4:CORNERS])) == 1:
        return (TETRA10, [nodes[k] for k in QUADRATIC_TETRA]) if quadratic else (TETRA4, [*nodes[:3], nodes[4]])
    if nodes[2] == nodes[3]:
        chosen = QUADRATIC_WEDGE if quadratic else WEDGE
        return (WEDGE15 if quadratic else WEDGE6), [nodes[k] for k in chosen]
    return (HEXAHEDRON20, nodes) if quadratic else (HEXAHEDRON8, nodes[:CORNERS])
