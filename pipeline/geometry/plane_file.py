"""A plane part from a mesh file: triangles of six nodes in z = 0, with named edges.

Edges get their names as surfaces of solids do: from gmsh's physical groups of dimension 1, from sets of lines or nodes,
or from integer cell or point arrays (non-zero = member). All of the boundary is `edge`.
"""

from typing import Literal

import numpy as np
from pydantic import Field

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import TRIANGLE6, compacted, outer_faces, turned
from gudgeon.pipeline.geometry.decks.model import Deck
from gudgeon.pipeline.geometry.decks.naming import named_facets
from gudgeon.pipeline.geometry.decks.reading import read_deck
from gudgeon.pipeline.geometry.mesh_file import scaled_points
from gudgeon.pipeline.geometry.shapes.plane import UP, PlanePart
from gudgeon.pipeline.geometry.soundness import refuse_pieces
from gudgeon.solver.numbers import Length

FLAT = 1e-9
"""How far nodes may lie off z = 0, relative to the part's size."""
EDGE = "edge"


class PlaneFile(PlanePart):
    """A mesh of triangles in a file."""

    kind: Literal["plane-file"]
    path: str = Field(description="File of the mesh, from the folder of the scene")
    unit: Length = Field(
        default=1.0, description="Metres per unit of length of the file; needed in a scene, unless the file states it"
    )

    def build(self, size: float | None) -> MeshRecord:
        """Read the mesh; `size` is not used, the file has its own.

        Raises:
            InputError: the file is missing, no mesh, or not one part of six-node triangles in z = 0.
        """
        deck = read_deck(self.path)
        points = scaled_points(deck.points, self.unit, self.path)
        nodes, cells, new_row = compacted(points, deck.rows(_triangles(deck, self.path), self.path))
        off = float(np.abs(nodes[:, 2]).max())
        if off > FLAT * np.ptp(nodes, axis=0).max():
            raise InputError(f"{self.path}: nodes lie up to {off:.3g} m off z = 0, allowed: a plane part in z = 0")
        cells = turned(nodes, cells, UP)
        edges = outer_faces(cells, TRIANGLE6)
        members = {EDGE: np.ones(len(edges), bool)} | named_facets(deck, edges, new_row, 1, len(nodes))
        shape = {"thickness": self.thickness}
        surfaces = {name: Surface(edges[chosen], shape) for name, chosen in members.items()}
        record = MeshRecord(nodes, cells, TRIANGLE6.name, surfaces)
        refuse_pieces(record, self.path)
        return record


def _triangles(deck: Deck, path: str) -> np.ndarray:
    """Return the nodes of the file's triangles (e, 6); other faces and solids are refused, lines omitted."""
    kinds = {block.cell.name for block in deck.blocks if block.cell.dimension >= 2}
    if kinds != {TRIANGLE6.name}:
        raise InputError(
            f"{path}: has {', '.join(sorted(kinds)) or 'no triangles'}; a plane part is made of triangle6 alone,"
            " quadratic triangles of six nodes"
        )
    return np.concatenate([block.nodes for block in deck.blocks if block.cell is TRIANGLE6])
