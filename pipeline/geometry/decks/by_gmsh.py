"""Mesh files by gmsh's readers: UNV, MED, and what meshio cannot read."""

from typing import NamedTuple

import numpy as np

from gudgeon.pipeline.geometry.occ import meshing, read_file
from gudgeon.pipeline.geometry.quiet import quiet_stdout

FIRST = (".unv", ".med")
"""Endings that gmsh reads before meshio, which drops their names."""
ENDINGS = (*FIRST, ".bdf", ".nas", ".inp", ".mesh", ".msh", ".vtk", ".su2", ".cgns")
TYPES = {
    1: "line", 2: "triangle", 3: "quad", 4: "tetra", 5: "hexahedron", 6: "wedge", 7: "pyramid", 8: "line3",
    9: "triangle6", 10: "quad9", 11: "tetra10", 12: "hexahedron27", 16: "quad8", 17: "hexahedron20", 18: "wedge15",
    19: "pyramid13",
}  # fmt: skip
"""meshio's names of gmsh's elements by number; points are dropped."""


class FileMesh(NamedTuple):
    """A mesh as meshio's constructor takes it."""

    points: np.ndarray
    cells: list[tuple[str, np.ndarray]]
    cell_sets: dict[str, list[np.ndarray]]
    point_sets: dict[str, np.ndarray]


def read_by_gmsh(path: str) -> FileMesh:
    """Return points, blocks of cells, and the physical groups as sets of cells.

    Raises:
        StageError: gmsh cannot read the file, or it has no node or foreign elements.
    """
    with meshing(1.0, {}) as gmsh:
        with quiet_stdout():
            read_file(gmsh, path)
        mesh, model = gmsh.model.mesh, gmsh.model
        tags, positions, _ = mesh.getNodes()
        if not len(tags):
            raise ValueError("it has no nodes")
        node_ids = np.full(int(tags.max()) + 1, -1)
        node_ids[tags.astype(int)] = np.arange(len(tags))
        cells: list[tuple[str, np.ndarray]] = []
        owners: list[tuple[int, int]] = []
        for dimension, entity in model.getEntities():
            for kind, _, nodes in zip(*mesh.getElements(dimension, entity), strict=True):
                name = TYPES.get(int(kind))
                if name is None and dimension:
                    raise ValueError(f"it has elements of gmsh's type {kind}")
                if name is not None:
                    width = int(mesh.getElementProperties(kind)[3])
                    cells.append((name, node_ids[nodes.astype(int)].reshape(-1, width)))
                    owners.append((dimension, entity))
        sets: dict[str, list[np.ndarray]] = {}
        for dimension, group in model.getPhysicalGroups():
            name = model.getPhysicalName(dimension, group).strip() or str(group)
            members = {(dimension, int(tag)) for tag in model.getEntitiesForPhysicalGroup(dimension, group)}
            rows = [np.arange(len(block[1])) if owner in members else np.empty(0, int)
                    for block, owner in zip(cells, owners, strict=True)]  # fmt: skip
            old = sets.get(name)
            sets[name] = rows if old is None else [np.union1d(a, b) for a, b in zip(old, rows, strict=True)]
        return FileMesh(positions.reshape(-1, 3), cells, sets, {})
