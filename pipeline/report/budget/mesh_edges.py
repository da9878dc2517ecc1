"""Mean edges of meshes, which are the sizes in which their errors converge."""

import numpy as np

from gudgeon.modaldb.records.mesh import MeshRecord

CELLS = {"tetra10": (4, 3), "triangle6": (3, 2), "line3": (2, 1), "beam2": (2, 2), "beam3": (2, 2), "frame2": (2, 2)}
"""Type of cell → its corners, and the dofs of a node."""


def mean_edge(mesh: MeshRecord) -> float:
    """Return the mean length of the straight edges between corners of cells [m]."""
    corners = mesh.nodes[mesh.cells[:, : CELLS[mesh.cell_type][0]]]
    i, j = np.triu_indices(corners.shape[1], 1)
    return float(np.linalg.norm(corners[:, i] - corners[:, j], axis=-1).mean())
