"""Patches: any smooth surface as a height over a plane, so that bodies slide over it as over a plane or in a bore.

The plane has the given direction `along` and, as its normal, the mean outward normal across it. The height is a tensor
product of uniform cubic B-splines, fitted by least squares to the nodes, which are on the true surface; second
differences hold it where cells have few nodes. The surface may end anywhere: cells without surface are marked.
"""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.modaldb.records.modes import SplineGrid
from gudgeon.modaldb.records.traction import chart_coordinates, height_grid, heights, spline_weights
from gudgeon.modaldb.records.types import Json
from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.geometry.cells import corner_triangles
from gudgeon.pipeline.interfaces.points import surface_points
from gudgeon.pipeline.scenes.interface import Interface

STEEPEST = 0.2
"""Least cosine between the outward normals of a patch and that of its plane."""
SMOOTH = 1e-7
"""Weight of second differences of heights over that of nodes: what they change is below the error of the mesh."""
MOST_HEIGHTS = 40_000
"""Splines of a height at most."""
PIECES = 4
"""Parts of an edge at whose points cells of the height are looked for."""


def patch_chart(
    mesh: MeshRecord, surface: Surface, interface: Interface, key: str
) -> tuple[Json, np.ndarray, np.ndarray]:
    """Return chart, least and largest coordinates of a traction space on any smooth surface.

    Raises:
        InputError: `along` is missing or across the surface, or the surface is no height over its plane.
    """
    if interface.along is None:
        raise InputError(
            f"{key}.along: is missing; a traction space on a plane or a patch needs the direction of sliding"
        )
    points, vectors = surface_points(mesh.nodes, surface, PIECES)
    outward = vectors.sum(axis=0)
    along = np.asarray(interface.along, float)
    length = float(np.linalg.norm(along))
    normal = outward - along * (along @ outward) / max(length, 1e-300) ** 2 if length else outward * 0.0
    if not np.linalg.norm(normal) > STEEPEST * np.linalg.norm(outward):
        direction = list(interface.along)
        raise InputError(f"{key}.along: {direction} given, it must be a direction on the surface '{interface.surface}'")
    normal, along = normal / np.linalg.norm(normal), along / length
    unit_normals = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    if (steepest := float((unit_normals @ normal).min())) < STEEPEST:
        raise InputError(
            f"{key}: '{interface.surface}' turns by {np.degrees(np.arccos(np.clip(steepest, -1, 1))):.0f} degrees"
            f" from its mean plane, at most {np.degrees(np.arccos(STEEPEST)):.0f}; divide it into several surfaces"
        )
    nodes = mesh.nodes[np.unique(surface.facets)]
    chart: Json = {
        "kind": "patch", "origin": nodes.mean(axis=0).tolist(), "normal": normal.tolist(),
        "across": np.cross(along, normal).tolist(), "along": along.tolist(),
    }  # fmt: skip
    if interface.extent is not None:
        low, high = np.array(interface.extent).T
    else:
        coordinates = chart_coordinates(chart, nodes)
        low, high = coordinates.min(axis=0), coordinates.max(axis=0)
    return _with_height(chart, mesh, surface, (low, high), points, key), low, high


def _with_height(
    chart: Json, mesh: MeshRecord, surface: Surface, box: tuple[np.ndarray, np.ndarray], inner: np.ndarray, key: str
) -> Json:
    """Return a chart with the splines of its height, whose knots are as far apart as the corners of facets."""
    low, high = box
    triangles, _ = corner_triangles(surface.facets)
    corners = chart_coordinates(chart, mesh.nodes[triangles.ravel()]).reshape(-1, 3, 2)
    size = np.median(np.ptp(corners, axis=1), axis=0)
    cells = np.maximum(np.ceil((high - low) / size), 1).astype(int)
    if (cells + 3).prod() > MOST_HEIGHTS:
        raise InputError(
            f"{key}: its height needs {(cells + 3).prod()} splines, at most {MOST_HEIGHTS}; use a smaller surface"
        )
    grid = SplineGrid(chart, low, (high - low) / cells, cells + 3)
    nodes = mesh.nodes[np.unique(surface.facets)]
    origin, normal = np.asarray(chart["origin"]), np.asarray(chart["normal"])
    coordinates, height = chart_coordinates(chart, nodes), (nodes - origin) @ normal
    in_box = np.all((coordinates >= low - grid.spacing) & (coordinates <= high + grid.spacing), axis=1)
    numbers, values = spline_weights(grid, coordinates[in_box])
    starts = 16 * np.arange(len(numbers) + 1)
    A = sparse.csr_matrix((values.ravel(), numbers.ravel(), starts), shape=(len(numbers), grid.size))
    bends = _second_differences(grid.counts)
    coefficients = spsolve(sparse.csc_matrix(A.T @ A + SMOOTH * (bends.T @ bends)), A.T @ height[in_box])
    cell = np.floor((chart_coordinates(chart, inner) - low) / grid.spacing).astype(int)
    cell = cell[np.all((cell >= 0) & (cell < cells), axis=1)]
    cover = np.zeros(cells, int)
    cover[cell[:, 0], cell[:, 1]] = 1
    spline = {
        "low": low.tolist(), "step": grid.spacing.tolist(), "counts": grid.counts.tolist(),
        "heights": coefficients.tolist(), "cover": cover.ravel().tolist(),
    }  # fmt: skip
    return chart | spline


def _second_differences(counts: np.ndarray) -> sparse.csr_matrix:
    """Return the second differences of a grid's values along both of its directions, (d, size)."""
    blocks = []
    for axis in range(2):
        n = int(counts[axis])
        D = sparse.diags_array(
            [np.ones(n - 2), -2 * np.ones(n - 2), np.ones(n - 2)], offsets=[0, 1, 2], shape=(n - 2, n)
        )
        I = sparse.eye_array(int(counts[1 - axis]))
        blocks.append(sparse.kron(D, I) if axis == 0 else sparse.kron(I, D))
    return sparse.csr_matrix(sparse.vstack(blocks))


def distance(chart: Json, nodes: np.ndarray) -> float:
    """Return the largest distance of nodes of a surface (n, 3) from the height of a patch within its cells [m]."""
    grid = height_grid(chart)
    coordinates = chart_coordinates(chart, nodes)
    in_grid = np.all(
        (coordinates >= grid.start) & (coordinates <= grid.start + grid.spacing * (grid.counts - 3)), axis=1
    )
    height = (nodes[in_grid] - np.asarray(chart["origin"])) @ np.asarray(chart["normal"])
    return float(np.abs(height - heights(chart, coordinates[in_grid])).max(initial=0.0))


def nearest_kept(counts: np.ndarray, active: np.ndarray) -> np.ndarray:
    """Return for each function of a grid the nearest one that is kept, by steps, (f,)."""
    indices = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 2)
    have = np.flatnonzero(active)
    nearest = np.arange(len(active))
    for a in np.flatnonzero(~active):
        nearest[a] = have[int(((indices[have] - indices[a]) ** 2).sum(axis=1).argmin())]
    return nearest
