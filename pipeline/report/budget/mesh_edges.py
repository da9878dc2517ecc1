"""Mean edges of meshes, which are the sizes in which their errors converge."""

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.geometry.cells import cell_blocks


def mean_edge(mesh: MeshRecord) -> float:
    """Return the mean length of the straight edges between corners of cells [m]."""
    ends = [mesh.nodes[block.nodes[:, block.cell.shape.edges]].reshape(-1, 2, 3) for block in cell_blocks(mesh)]
    return float(np.linalg.norm(np.diff(np.concatenate(ends), axis=1), axis=-1).mean())
