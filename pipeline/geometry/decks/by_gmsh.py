"""Meshes by gmsh's readers: MED, whose groups meshio 5 drops, and files of other formats that meshio cannot read."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gudgeon.pipeline.geometry.cells import CELLS
from gudgeon.pipeline.geometry.decks.model import Block, Deck, Scope, deck_of
from gudgeon.pipeline.geometry.occ import meshing, read_file
from gudgeon.pipeline.geometry.quiet import quiet_stdout
from gudgeon.pipeline.process.call import called_apart

HEXA20 = (*range(9), 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15)
PYRAMID13 = (*range(6), 8, 10, 6, 7, 9, 11, 12)
WEDGE15 = (*range(7), 9, 7, 12, 14, 13, 8, 10, 11)
TYPES: dict[int, tuple[str, Sequence[int]]] = {
    1: ("line", ()), 2: ("triangle", ()), 3: ("quad", ()), 4: ("tetra", ()), 5: ("hexahedron", ()), 6: ("wedge", ()),
    7: ("pyramid", ()), 8: ("line3", ()), 9: ("triangle6", ()), 10: ("quad9", ()),
    11: ("tetra10", (*range(8), 9, 8)), 12: ("hexahedron27", (*HEXA20, 22, 23, 21, 24, 20, 25, 26)),
    13: ("wedge18", (*WEDGE15, 15, 17, 16)), 14: ("pyramid14", (*PYRAMID13, 13)), 16: ("quad8", ()),
    17: ("hexahedron20", HEXA20), 18: ("wedge15", WEDGE15), 19: ("pyramid13", PYRAMID13),
}  # fmt: skip
"""Cell of gmsh's elements by number, and the order here where it differs; points are dropped."""


def read_by_gmsh(path: str, scope: Scope) -> Deck:
    """Read a mesh in a process of its own, which a damaged file may end; raises anything."""
    deck = called_apart(path, "gmsh", read_here, path)
    blocks = tuple(block._replace(cell=CELLS[block.cell.name]) for block in deck.blocks)
    return replace(deck, blocks=blocks)  # Cells are compared by identity, which pickling does not keep.


def read_here(path: str) -> Deck:
    """Read a mesh; physical groups are sets of elements.

    Raises:
        StageError: gmsh cannot read the file, or it has no node or foreign elements.
    """
    with meshing(1.0, {}) as gmsh:
        with quiet_stdout():
            read_file(gmsh, path)
        mesh, model = gmsh.model.mesh, gmsh.model
        labels, positions, _ = mesh.getNodes()
        if not len(labels):
            raise ValueError("it has no nodes")
        blocks: list[Block] = []
        members: dict[tuple[int, int], list[np.ndarray]] = {}
        for dimension, entity in model.getEntities():
            for kind, elements, nodes in zip(*mesh.getElements(dimension, entity), strict=True):
                if int(kind) not in TYPES:
                    if dimension:
                        raise ValueError(f"it has elements of gmsh's type {kind}")
                    continue
                name, order = TYPES[int(kind)]
                table = nodes.astype(np.int64).reshape(len(elements), -1)
                blocks.append(Block(CELLS[name], elements.astype(np.int64), table[:, order] if len(order) else table))
                members.setdefault((dimension, entity), []).append(blocks[-1].labels)
        sets: dict[str, np.ndarray] = {}
        for dimension, group in model.getPhysicalGroups():
            name = model.getPhysicalName(dimension, group).strip() or str(group)
            entities = model.getEntitiesForPhysicalGroup(dimension, group)
            rows = [rows for tag in entities for rows in members.get((dimension, int(tag)), [])]
            sets[name] = np.unique(np.concatenate([sets.get(name, np.empty(0, np.int64)), *rows]))
        return deck_of(labels.astype(np.int64), positions.reshape(-1, 3), blocks, path, element_sets=sets)
