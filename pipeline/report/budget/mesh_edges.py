"""Mean edges of meshes, which are the sizes in which their errors converge."""

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.geometry.cells import cell_of


def mean_edge(mesh: MeshRecord) -> float:
    """Return the mean length of the straight edges between corners of cells [m]."""
    corners = mesh.nodes[mesh.cells[:, : cell_of(mesh).shape.corners]]
    i, j = np.triu_indices(corners.shape[1], 1)
    return float(np.linalg.norm(corners[:, i] - corners[:, j], axis=-1).mean())
