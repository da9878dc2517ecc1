"""How the nodes of a built-in geometry move as a key of its shape changes.

Its surfaces are planes, cylinders and spheres, whose normal velocities follow from their places at two values of the
key. Nodes on a surface move along its normal with it and slide in it freely; so that elements keep their shape, all
follow the movement V of least Σ |V_a − V_b|² / d_ab² over pairs of nodes that share an element.
"""

from itertools import combinations

import numpy as np
from scipy import sparse
from scipy.sparse import linalg

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.errors import InputError

TURNED = 1e-9
"""Change of a direction of a surface, which may not turn."""
DEPENDENT = 1e-6
"""Singular value of the normals at a node below which one depends on the others."""
FREE = 1e-10
"""Weight of a node's movement itself over that of its differences: where nothing determines it, there is none."""


def shape_velocity(
    mesh: MeshRecord, ahead: MeshRecord, behind: MeshRecord, value_difference: float, key: str
) -> np.ndarray:
    """Return the movement of the nodes per unit of a key of the shape, (n, 3).

    Args:
        ahead, behind: Meshes of the shape with a larger and a smaller value; their surfaces alone are used.
        value_difference: Of both.
        key: In the scene, for messages.

    Raises:
        InputError: a surface turns, appears or is of another kind, or a part of the boundary belongs to none.
    """
    _refuse_unnamed(mesh, key)
    normals: dict[int, list[np.ndarray]] = {}
    speeds: dict[int, list[float]] = {}
    for name, surface in mesh.surfaces.items():
        if name not in ahead.surfaces or name not in behind.surfaces:
            raise InputError(f"{key}: the surface '{name}' vanishes as it changes")
        nodes = np.unique(surface.facets)
        along, rates = _normal_rates(mesh.nodes[nodes], name, (ahead, behind), value_difference, key)
        for node, normal, rate in zip(nodes.tolist(), along, rates, strict=True):
            normals.setdefault(node, []).append(normal)
            speeds.setdefault(node, []).append(float(rate))
    return _extended(mesh, normals, speeds)


def moved_surfaces(
    mesh: MeshRecord, ahead: MeshRecord, behind: MeshRecord, fraction: float
) -> dict[str, dict[str, object]]:
    """Return the shapes of the surfaces at a fraction of the way from behind (−1) to ahead (1)."""
    shapes = {}
    for name, surface in mesh.surfaces.items():
        low, high = behind.surfaces[name].shape, ahead.surfaces[name].shape
        changed = {
            key: ((1 - fraction) * np.asarray(low[key]) + (1 + fraction) * np.asarray(high[key])) / 2
            for key in ("radius", "origin")
            if key in surface.shape
        }
        shapes[name] = surface.shape | {
            key: float(value) if key == "radius" else value.tolist() for key, value in changed.items()
        }
    return shapes


def _refuse_unnamed(mesh: MeshRecord, key: str) -> None:
    if not mesh.cell_type.startswith("tetra"):
        raise InputError(f"{key}: shapes are varied of parts of tetrahedra and of bars")
    corners = np.sort(np.concatenate([mesh.cells[:, list(face)] for face in combinations(range(4), 3)]), axis=1)
    _, counts = np.unique(corners, axis=0, return_counts=True)
    named = np.concatenate([np.sort(s.facets[:, :3], axis=1) for s in mesh.surfaces.values()])
    if len(np.unique(named, axis=0)) < int((counts == 1).sum()):
        raise InputError(
            f"{key}: a part of the boundary belongs to no named surface, so that its movement is not known"
        )


def _normal_rates(
    points: np.ndarray, name: str, meshes: tuple[MeshRecord, MeshRecord], value_difference: float, key: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return normals (c, 3) and normal velocities (c,) of points of a surface."""
    high, low = (mesh.surfaces[name].shape for mesh in meshes)
    kind = high.get("kind")
    change = {
        k: (np.asarray(high[k]) - np.asarray(low[k])) / value_difference for k in ("radius", "origin") if k in high
    }
    for direction in ("normal", "axis"):
        if direction in high and np.abs(np.subtract(high[direction], low[direction])).max() > TURNED:
            raise InputError(f"{key}: the surface '{name}' turns as it changes")
    origin = (np.asarray(high.get("origin", np.zeros(3))) + np.asarray(low.get("origin", np.zeros(3)))) / 2
    if kind == "plane":
        normal = np.asarray(high["normal"], float)
        return np.tile(normal, (len(points), 1)), np.full(len(points), float(normal @ change["origin"]))
    if kind not in ("cylinder", "sphere"):
        raise InputError(f"{key}: the surface '{name}' is of kind '{kind}'; planes, cylinders and spheres are followed")
    arm = points - origin
    if kind == "cylinder":
        axis = np.asarray(high["axis"], float)
        arm = arm - np.outer(arm @ axis, axis)
    normals = arm / np.linalg.norm(arm, axis=1)[:, None]
    return normals, normals @ change["origin"] + float(change["radius"])


def _extended(mesh: MeshRecord, normals: dict[int, list[np.ndarray]], speeds: dict[int, list[float]]) -> np.ndarray:
    """Return the movement of all nodes that has given normal velocities on surfaces, (n, 3)."""
    count = len(mesh.nodes)
    prescribed = np.zeros((count, 3))
    blocks = np.tile(np.eye(3), (count, 1, 1))
    for node, along in normals.items():
        basis, sizes, normals_span = np.linalg.svd(np.array(along))
        rank = int((sizes > DEPENDENT).sum())
        prescribed[node] = normals_span[:rank].T @ ((basis[:, :rank].T @ np.array(speeds[node])) / sizes[:rank])
        blocks[node] = np.eye(3) - normals_span[:rank].T @ normals_span[:rank]
    pairs = np.array(list(combinations(range(mesh.cells.shape[1]), 2)))
    ends = np.unique(np.sort(mesh.cells[:, pairs].reshape(-1, 2), axis=1), axis=0)
    weights = 1 / ((mesh.nodes[ends[:, 0]] - mesh.nodes[ends[:, 1]]) ** 2).sum(axis=1)
    i, j = ends.T
    graph = sparse.coo_array((np.tile(weights, 2), (np.concatenate([i, j]), np.concatenate([j, i]))), (count, count))
    laplacian = sparse.diags_array(graph.sum(axis=1)) - graph
    L = sparse.kron(laplacian, sparse.eye_array(3), format="csr")
    P = sparse.block_diag(list(blocks), format="csr")
    scale = float(laplacian.diagonal().mean())
    # In the directions that are given, the identity keeps the matrix regular.
    A = P @ L @ P + scale * (sparse.eye_array(3 * count) - P) + FREE * scale * P
    free = linalg.spsolve(sparse.csc_array(A), -(P @ (L @ prescribed.ravel())))
    return prescribed + (P @ free).reshape(-1, 3)
