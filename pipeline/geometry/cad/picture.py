"""Triangles of the faces of a CAD part, for pictures of it."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from gudgeon.pipeline.geometry.cad.faces import Face
from gudgeon.pipeline.geometry.cells import compacted
from gudgeon.pipeline.process.call import at_most

ACROSS = 40
"""Largest triangles along the part's extent."""
AROUND = 36
FINEST = 1 / 6
"""Least triangles on blends, over the largest."""
SECONDS = 60.0
"""CPU time after which a part is not meshed for a picture."""
TRIANGLE = 2
"""gmsh's number of three-node triangles."""


def triangles_of(gmsh: Any, faces: Sequence[Face], scale: float) -> dict[str, np.ndarray]:
    """Mesh the faces in gmsh's model and return their triangles, outward.

    Args:
        scale: Metres per unit of the model.

    Returns:
        `points` [m] (n, 3), `triangles` (t, 3), `owner`, place of the face of each triangle in `numbers` (t,), and
        `numbers` of the faces (f,).
    """
    size = faces[0].extent / scale / ACROSS
    for name, value in {"MeshSizeMax": size, "MeshSizeMin": FINEST * size, "MeshSizeFromCurvature": AROUND}.items():
        gmsh.option.setNumber(f"Mesh.{name}", value)
    mesh = gmsh.model.mesh
    mesh.clear()
    with at_most(SECONDS):
        mesh.generate(2)
    tags, positions, _ = mesh.getNodes()
    points = np.zeros((int(tags.max()) + 1, 3))
    points[tags.astype(int)] = positions.reshape(-1, 3)
    rows = [mesh.getElementsByType(TRIANGLE, face.number)[1].astype(int).reshape(-1, 3) for face in faces]
    used, triangles, _ = compacted(points, np.concatenate(rows))
    owner = np.repeat(np.arange(len(faces)), [len(r) for r in rows])
    numbers = np.array([face.number for face in faces])
    return {"points": used * scale, "triangles": triangles, "owner": owner, "numbers": numbers}
