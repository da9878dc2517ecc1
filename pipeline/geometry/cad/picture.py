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
MOST_ON_EDGES = 20_000
"""Nodes on edges, above which curved faces get no finer triangles: of parts with a thousand fillets."""
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
    mesh = gmsh.model.mesh
    with at_most(SECONDS):
        for finest, around in ((FINEST * size, AROUND), (size, 0)):
            options = {"MeshSizeMax": size, "MeshSizeMin": finest, "MeshSizeFromCurvature": around}
            for name, value in options.items():
                gmsh.option.setNumber(f"Mesh.{name}", value)
            mesh.clear()
            mesh.generate(1)
            if len(mesh.getNodes()[0]) <= MOST_ON_EDGES:
                break
        mesh.generate(2)
    tags, positions, _ = mesh.getNodes()
    points = np.zeros((int(tags.max()) + 1, 3))
    points[tags.astype(int)] = positions.reshape(-1, 3)
    rows = [mesh.getElementsByType(TRIANGLE, face.number)[1].astype(int).reshape(-1, 3) for face in faces]
    used, triangles, _ = compacted(points, np.concatenate(rows))
    owner = np.repeat(np.arange(len(faces)), [len(r) for r in rows])
    numbers = np.array([face.number for face in faces])
    return {"points": used * scale, "triangles": triangles, "owner": owner, "numbers": numbers}
