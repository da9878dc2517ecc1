"""The outside of a mesh for the page: triangles to draw, and mode shapes on their nodes."""

import base64
from typing import Any, NamedTuple

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.geometry.cells import cell_of, flat_triangles, outer_facets
from gudgeon.pipeline.service.arrays import Wrong

MOST = 400_000
"""Triangles of a skin."""


class Skin(NamedTuple):
    """Triangles of a mesh that are seen."""

    nodes: np.ndarray
    """Node number of each point of the skin, (k,)."""
    triangles: np.ndarray
    """Points of each triangle, (t, 3)."""


def skin_of(mesh: MeshRecord) -> Skin:
    """Return the boundary of a solid, or all of a plane part, as flat triangles.

    Raises:
        Wrong: it is a line or a rigid body, or too large to draw.
    """
    cell = cell_of(mesh)
    if not cell.solid and cell.dimension != 2:
        raise Wrong(f"a mesh of {cell.name} has no surface to draw")
    triangles = flat_triangles(outer_facets(mesh) if cell.solid else mesh.cells)
    if len(triangles) > MOST:
        raise Wrong(f"{len(triangles)} triangles are more than {MOST}; export the record and draw it elsewhere", 413)
    nodes, numbers = np.unique(triangles, return_inverse=True)
    return Skin(nodes, numbers.reshape(-1, 3))


def packed(array: np.ndarray, dtype: str) -> str:
    """Return numbers as base64 of their bytes, for typed arrays of the page."""
    return base64.b64encode(np.ascontiguousarray(array, dtype).tobytes()).decode()


def skin_json(mesh: MeshRecord) -> dict[str, Any]:
    """Return points [m] as float32 and triangles as uint32 of a mesh's skin."""
    skin = skin_of(mesh)
    return {"points": packed(mesh.nodes[skin.nodes], "<f4"), "triangles": packed(skin.triangles, "<u4"),
            "extent": float(np.linalg.norm(np.ptp(mesh.nodes, axis=0)))}  # fmt: skip


def shape_bytes(shape: np.ndarray) -> bytes:
    """Return a mode shape at points (k, 3), scaled to a largest displacement of 1, as float32."""
    largest = float(np.sqrt((shape**2).sum(axis=1).max(initial=0.0)))
    return np.ascontiguousarray(shape / largest if largest > 0 else shape, "<f4").tobytes()
