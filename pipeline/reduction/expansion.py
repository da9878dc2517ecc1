"""Nodal displacements of a body from its coordinates: rigid twists of its design, then its elastic shapes."""

import numpy as np

from gudgeon.modaldb.records.modes import ModalRecord, MorphRecord
from gudgeon.pipeline.errors import StageError


def displacement(nodes: np.ndarray, morph: MorphRecord, modal: ModalRecord, coordinates: np.ndarray) -> np.ndarray:
    """Return u = Σ_k a_k (t_k + w_k × (x − c)) + Φ q, the small displacement of each node [m], (n, 3).

    Args:
        nodes: Nodal positions x of the design [m], (n, 3).
        morph: The design: its centre c and its rigid twists (t_k, w_k), (r, 6).
        modal: The modes: Φ, (n, 3, m).
        coordinates: Rigid coordinates a, then elastic ones q [m kg^½], (r + m,).

    Raises:
        StageError: the modal record holds no shapes, or other numbers of nodes or coordinates.
    """
    if modal.shapes is None:
        raise StageError("modes: the record contains no nodal shapes, so that only contact points have displacements")
    rigid_count = len(morph.rigid_twists)
    shape = (len(nodes), len(coordinates) - rigid_count)
    have = (modal.shapes.shape[0], modal.shapes.shape[2])
    if shape != have:
        raise StageError(f"modes: got {shape[0]} nodes and {shape[1]} elastic coordinates, the shapes have {have}")
    twist = coordinates[:rigid_count] @ morph.rigid_twists
    rigid = twist[:3] + np.cross(twist[3:], nodes - morph.centre)
    return rigid + modal.shapes @ coordinates[rigid_count:]
