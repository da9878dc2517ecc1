"""A plane part from a mesh file: triangles of six nodes in z = 0, with named edges.

Edges get their names from gmsh's physical groups of dimension 1, from sets of lines or nodes, or from integer point
arrays (non-zero = member). All of the boundary is `edge`.
"""

from typing import Any, Literal

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.mesh_file import marks, read_mesh
from gudgeon.pipeline.geometry.numbers import Length
from gudgeon.pipeline.geometry.shapes.plane import PlanePart, boundary_edges, counter_clockwise
from gudgeon.pipeline.geometry.soundness import refuse_pieces

FLAT = 1e-9
"""How far nodes may lie off z = 0, relative to the part's size."""
EDGE = "edge"


class PlaneFile(PlanePart):
    """A mesh of triangles in a file."""

    kind: Literal["plane-file"]
    path: str
    unit: Length = 1.0
    """Metres per unit of length of the file."""

    def build(self, size: float | None) -> MeshRecord:
        """Read the mesh; `size` is not used, the file has its own.

        Raises:
            InputError: the file is missing, no mesh, or not one part of six-node triangles in z = 0.
        """
        mesh = read_mesh(self.path)
        points, triangles = self.unit * np.asarray(mesh.points, float), _triangles(mesh, self.path)
        used, cells = np.unique(triangles, return_inverse=True)
        nodes = points[used]
        off = float(np.abs(nodes[:, 2]).max())
        if off > FLAT * np.ptp(nodes, axis=0).max():
            raise InputError(f"{self.path}: nodes lie up to {off:.3g} m off z = 0, where a plane part has to be")
        cells = counter_clockwise(nodes, cells.reshape(-1, 6))
        edges = boundary_edges(cells)
        number = np.full(len(points), -1)
        number[used] = np.arange(len(used))
        members = {EDGE: np.ones(len(edges), bool)} | _named(mesh, number, edges)
        shape = {"thickness": self.thickness}
        surfaces = {name: Surface(edges[chosen], shape) for name, chosen in members.items() if chosen.any()}
        found = MeshRecord(nodes, cells, "triangle6", surfaces)
        refuse_pieces(found, self.path)
        return found


def _triangles(mesh: Any, path: str) -> np.ndarray:
    """Return the file's triangles (e, 6); other faces and solids are refused, lines and points left out."""
    kinds = {block.type for block in mesh.cells if len(block.data) and block.dim >= 2}
    if kinds != {"triangle6"}:
        raise InputError(
            f"{path}: has {', '.join(sorted(kinds)) or 'no triangles'}; a plane part is made of triangle6 alone,"
            " quadratic triangles of six nodes"
        )
    return np.concatenate([block.data for block in mesh.cells if block.type == "triangle6"])


def _named(mesh: Any, number: np.ndarray, edges: np.ndarray) -> dict[str, np.ndarray]:
    """Return which boundary edges (f, 3) belong to each name of the file.

    Args:
        number: New number of each of the file's nodes, -1 where unused.
    """
    sets = {name: np.asarray(nodes, int) for name, nodes in mesh.point_sets.items()}
    sets |= {name: np.flatnonzero(values) for name, values in mesh.point_data.items() if marks(name, values)}
    found: dict[str, np.ndarray] = {}
    for name, nodes in sets.items():
        found[name.strip('"')] = np.asarray(np.isin(edges, number[nodes]).all(axis=1))
    lines = [(k, np.asarray(block.data)) for k, block in enumerate(mesh.cells) if block.dim == 1]
    groups: dict[str, list[np.ndarray]] = {}
    for name, blocks in mesh.cell_sets.items():
        if not name.startswith("gmsh:"):
            chosen = [line[np.asarray(blocks[k], int), :2] for k, line in lines if k < len(blocks)]
            groups.setdefault(name.strip('"'), []).extend(chosen)
    names = {int(tag): name for name, (tag, dimension) in mesh.field_data.items() if dimension == 1}
    tags = mesh.cell_data.get("gmsh:physical", [])
    for k, line in lines:
        for tag in set(np.asarray(tags[k]).tolist()) - {0} if k < len(tags) else ():
            groups.setdefault(names.get(tag, str(tag)), []).append(line[np.asarray(tags[k]) == tag, :2])
    ends = {tuple(sorted(pair)): place for place, pair in enumerate(edges[:, :2].tolist())}
    for name, parts in groups.items():
        places = [ends.get(tuple(sorted(pair))) for part in parts for pair in number[part].tolist()]
        chosen = np.zeros(len(edges), bool)
        chosen[[place for place in places if place is not None]] = True
        found[name] = found[name] | chosen if name in found else chosen
    return found
