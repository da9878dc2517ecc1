"""Meshes with slivers: elements are split at a point next to one of their faces.

The new elements fill the old ones by the same map, so that the new space of shapes contains the old one: by Rayleigh's
principle no frequency rises. Surfaces do not change; parts of a volume belong to it.
"""

from dataclasses import replace

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.geometry.cells import cell_of, quadratic_basis


def with_slivers(mesh: MeshRecord, aspect: float, count: int) -> MeshRecord:
    """Return a mesh with `count` elements, evenly spread, split at a point at 1/`aspect` of the height over a face."""
    shape = cell_of(mesh).shape
    corners, edges = shape.corners, shape.edges.tolist() if cell_of(mesh).quadratic else []
    chosen = np.unique(np.linspace(0, len(mesh.cells) - 1, min(count, len(mesh.cells))).astype(int))
    unsplit = np.setdiff1d(np.arange(len(mesh.cells)), chosen)
    nodes, cells = list(mesh.nodes), list(mesh.cells[unsplit])
    height = 1.0 / aspect
    barycentric = np.append(np.full(corners - 1, (1 - height) / (corners - 1)), height)
    for element in chosen:
        cell = mesh.cells[element]
        node_of = {i: int(cell[i]) for i in range(corners)}
        sides = {frozenset(edge): int(cell[corners + i]) for i, edge in enumerate(edges)}
        node_of[corners] = len(nodes)
        nodes.append(_mapped(mesh, element, barycentric))
        if edges:
            # The mid-side node of a split line becomes that of its first half.
            spare = [sides.pop(frozenset((0, 1)))] if corners == 2 else []
            for i in range(corners):
                middle = _mapped(mesh, element, 0.5 * (barycentric + np.eye(corners)[i]))
                if spare:
                    node = spare.pop()
                    nodes[node] = middle
                else:
                    node = len(nodes)
                    nodes.append(middle)
                sides[frozenset((i, corners))] = node
        for corner in range(corners):
            corner_of = [corners if i == corner else i for i in range(corners)]
            middles = [sides[frozenset((corner_of[a], corner_of[b]))] for a, b in edges]
            cells.append(np.array([*(node_of[i] for i in corner_of), *middles]))
    origin = np.concatenate([unsplit, np.repeat(chosen, corners)])
    volumes = {name: np.flatnonzero(np.isin(origin, cells_of)) for name, cells_of in mesh.volumes.items()}
    return replace(mesh, nodes=np.array(nodes), cells=np.array(cells, dtype=mesh.cells.dtype), volumes=volumes)


def _mapped(mesh: MeshRecord, element: int, barycentric: np.ndarray) -> np.ndarray:
    """Return the point of an element at barycentric coordinates [m], (3,)."""
    cell = cell_of(mesh)
    N = quadratic_basis(barycentric, cell.shape)[0] if cell.quadratic else barycentric
    return N @ mesh.nodes[mesh.cells[element]]
