"""Meshes of meshio and of scikit-fem as files that every stage reads, with their named parts as integer arrays."""

import hashlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.files import whole_file
from gudgeon.pipeline.geometry.decks.by_meshio import deck_of_mesh
from gudgeon.pipeline.geometry.decks.model import Deck

DIGITS = 16
"""Of the digest of the content in a file's name."""
FACETS = {2: "line", 3: "triangle", 4: "quad"}
"""Names of facets by their corners."""


def is_mesh(value: Any) -> bool:
    """Whether a value is a mesh of meshio or scikit-fem, or a basis of scikit-fem."""
    value = getattr(value, "mesh", value)
    return (hasattr(value, "points") and hasattr(value, "cells")) or hasattr(value, "doflocs")


def deck_of_object(mesh: Any, source: str) -> Deck:
    """Return nodes, cells and named parts of a mesh; of a basis, those of its mesh.

    Args:
        source: The mesh in messages.

    Raises:
        InputError: it has cells of a type that no body has, a node without finite position, or a name with a colon.
    """
    mesh = getattr(mesh, "mesh", mesh)
    deck = deck_of_mesh(source, _of_skfem(mesh) if hasattr(mesh, "doflocs") else mesh)
    for name in (*deck.node_sets, *deck.element_sets):
        if ":" in name:
            raise InputError(f"{source}: '{name}' names a part of the mesh; allowed: names without a colon")
    return deck


def _of_skfem(mesh: Any) -> Any:
    """Return a mesh of scikit-fem as one of meshio, with its boundaries as facets and its subdomains as sets."""
    import meshio
    from skfem.io.meshio import to_meshio

    solid = to_meshio(mesh, encode_cell_data=False).cells[0]
    cells, sets = [(solid.type, solid.data)], {name: [rows] for name, rows in (mesh.subdomains or {}).items()}
    for name, facets in (mesh.boundaries or {}).items():
        corners = mesh.facets[:, np.asarray(facets)].T
        sets[name] = [[]] * len(cells) + [np.arange(len(corners))]
        cells.append((FACETS[corners.shape[1]], corners))
    blocks = {name: [*rows, *[[]] * (len(cells) - len(rows))] for name, rows in sets.items()}
    return meshio.Mesh(mesh.doflocs.T, cells, cell_sets=blocks)


def write_mesh(deck: Deck, folder: Path) -> Path:
    """Write nodes, cells and named parts into a folder, under a name by their content, and return the file (.vtu)."""
    import meshio

    rows = [np.searchsorted(deck.labels, block.nodes) for block in deck.blocks]
    element_marks = {name: _marks(labels, [block.labels for block in deck.blocks])
             for name, labels in deck.element_sets.items()}  # fmt: skip
    nodes = {name: _marks(labels, [deck.labels])[0] for name, labels in deck.node_sets.items()}
    arrays = [deck.points, *rows, *(array for marks in element_marks.values() for array in marks), *nodes.values()]
    path = folder / f"mesh-{digest(arrays, [b.cell.name for b in deck.blocks], element_marks, nodes)}.vtu"
    if not path.is_file():
        cells = [
            (block.cell.meshio or block.cell.name, nodes_of) for block, nodes_of in zip(deck.blocks, rows, strict=True)
        ]
        mesh = meshio.Mesh(deck.points, cells, point_data=nodes, cell_data=element_marks)
        with whole_file(path) as scratch:
            meshio.write(scratch, mesh, file_format="vtu")
    return path


def _marks(labels: np.ndarray, blocks: Iterable[np.ndarray]) -> list[np.ndarray]:
    """Return 1 where a label of each block is one of some labels, else 0."""
    return [np.isin(block, labels).astype(np.int8) for block in blocks]


def digest(arrays: Iterable[np.ndarray], *words: Iterable[str] | Mapping[str, Any]) -> str:
    """Return the digest of arrays and words."""
    total = hashlib.sha256(repr([list(text) for text in words]).encode())
    for array in arrays:
        total.update(repr((array.shape, array.dtype.str)).encode() + np.ascontiguousarray(array).tobytes())
    return total.hexdigest()[:DIGITS]
