"""Meshes with slivers: elements are split at a point next to one of their faces.

The new elements fill the old ones by the same map, so that the new space of shapes contains the old one: by Rayleigh's
principle no frequency rises. Surfaces do not change; parts of a volume belong to it.
"""

from dataclasses import replace

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.geometry.cells import cell_of


def with_slivers(mesh: MeshRecord, aspect: float, count: int) -> MeshRecord:
    """Return a mesh with `count` elements, evenly spread, split at a point at 1/`aspect` of the height over a face."""
    corners, edges = _layout(mesh)
    chosen = np.unique(np.linspace(0, len(mesh.cells) - 1, min(count, len(mesh.cells))).astype(int))
    kept = np.setdiff1d(np.arange(len(mesh.cells)), chosen)
    nodes, cells = list(mesh.nodes), list(mesh.cells[kept])
    height = 1.0 / aspect
    place = np.append(np.full(corners - 1, (1 - height) / (corners - 1)), height)
    for number in chosen:
        cell = mesh.cells[number]
        at = {i: int(cell[i]) for i in range(corners)}
        sides = {frozenset(edge): int(cell[corners + i]) for i, edge in enumerate(edges)}
        at[corners] = len(nodes)
        nodes.append(_mapped(mesh, number, place))
        if edges:
            # The mid-side node of a split line becomes that of its first half.
            spare = [sides.pop(frozenset((0, 1)))] if corners == 2 else []
            for i in range(corners):
                middle = _mapped(mesh, number, 0.5 * (place + np.eye(corners)[i]))
                if spare:
                    node = spare.pop()
                    nodes[node] = middle
                else:
                    node = len(nodes)
                    nodes.append(middle)
                sides[frozenset((i, corners))] = node
        for left in range(corners):
            own = [corners if i == left else i for i in range(corners)]
            middles = [sides[frozenset((own[a], own[b]))] for a, b in edges]
            cells.append(np.array([*(at[i] for i in own), *middles]))
    origin = np.concatenate([kept, np.repeat(chosen, corners)])
    volumes = {name: np.flatnonzero(np.isin(origin, own)) for name, own in mesh.volumes.items()}
    return replace(mesh, nodes=np.array(nodes), cells=np.array(cells, dtype=mesh.cells.dtype), volumes=volumes)


def _layout(mesh: MeshRecord) -> tuple[int, list[list[int]]]:
    """Return the number of an element's corners, and the corners of each mid-side node."""
    cell = cell_of(mesh)
    return cell.shape.corners, np.asarray(cell.shape.edges).tolist() if cell.quadratic else []


def _mapped(mesh: MeshRecord, number: int, share: np.ndarray) -> np.ndarray:
    """Return the point of an element at barycentric coordinates [m], (3,)."""
    cell, (corners, edges) = mesh.cells[number], _layout(mesh)
    if not edges:
        return share @ mesh.nodes[cell]
    values = [*(share * (2 * share - 1)), *(4 * share[a] * share[b] for a, b in edges)]
    return np.array(values) @ mesh.nodes[cell[: corners + len(edges)]]
