"""Cells of elements of Ansys, which repeat corners where they are no hexahedra."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.geometry.cells import CELLS
from gudgeon.pipeline.geometry.decks.model import IN_FULL, Block, Source

CORNERS = 8
"""Nodes of an element as it is written: eight corners, of which some are repeated, then up to twelve others."""
DEGENERATE: Mapping[str, tuple[tuple[int, ...], tuple[int, ...]]] = {
    "tetra10": ((0, 1, 2, 4), (8, 9, 11, 16, 17, 18)),
    "wedge15": ((0, 1, 2, 4, 5, 6), (8, 9, 11, 12, 13, 15, 16, 17, 18)),
    "pyramid13": ((0, 1, 2, 3, 4), (8, 9, 10, 11, 16, 17, 18, 19)),
    "hexahedron20": (tuple(range(8)), tuple(range(8, 20))),
}
"""Corners and mid-edge nodes of a quadratic cell among the twenty of an element."""
TETRAHEDRA = (87, 92, 98, 187, 227)
"""Types of tetrahedra of ten nodes."""
LINEAR = {"tetra10": "tetra", "wedge15": "wedge", "pyramid13": "pyramid", "hexahedron20": "hexahedron"}


class Row(NamedTuple):
    """An element as it is written."""

    label: int
    kind: int
    """Of its type."""
    type_id: int
    nodes: list[int]
    source: Source
    material: int = 0
    """Its number."""


def blocks_of_rows(rows: list[Row], full: set[int]) -> list[Block]:
    """Return elements by cell; `full` are the types that are integrated in full."""
    tables: dict[tuple[str, str], list[list[int]]] = {}
    for row in rows:
        cell, nodes = solid_of_row(row)
        kind = IN_FULL if row.type_id in full else f"SOLID{row.kind}"
        tables.setdefault((cell, kind), []).append([row.label, *nodes])
    blocks = []
    for (cell, kind), table in tables.items():
        data = np.array(table, np.int64)
        blocks.append(Block(CELLS[cell], data[:, 0], data[:, 1:], kind))
    return blocks


def solid_of_row(row: Row) -> tuple[str, list[int]]:
    """Return type and nodes of an element, without the corners that it repeats; mid-edge nodes may be 0."""
    nodes, count = row.nodes, len(row.nodes)
    if row.kind in TETRAHEDRA and 4 < count < 10:
        nodes, count = nodes + [0] * (10 - count), 10  # Nodes that are left out at the end are not written.
    if count in (4, 10):
        return ("tetra" if count == 4 or not any(nodes[4:]) else "tetra10"), nodes[: 10 if any(nodes[4:]) else 4]
    if not CORNERS <= count <= 20:
        raise row.source.error(f"element {row.label} has {count} nodes; allowed: 4, 8, 10 or 20")
    nodes = nodes + [0] * (20 - count)
    apex = len(set(nodes[4:CORNERS])) == 1
    names = ("tetra10", "wedge15") if nodes[2] == nodes[3] else ("pyramid13", "hexahedron20")
    cell = names[0 if apex else 1]
    corners, middles = DEGENERATE[cell]
    chosen = [nodes[k] for k in corners]
    if len(set(chosen)) < len(chosen):
        raise row.source.error(f"element {row.label} repeats corners as no tetrahedron, wedge or pyramid: {nodes[:8]}")
    if not any(nodes[k] for k in middles):
        return LINEAR[cell], chosen
    return cell, [*chosen, *(nodes[k] for k in middles)]
