"""Motion of a point that moves with nodes: as a rigid body, or by their mean motion."""

import numpy as np

UNIT_TWISTS = np.eye(6)
"""Translations, then rotations."""


def rigid_motion(positions: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return the displacement of positions (k, 3) in each unit motion of a point, (k, 3, 6)."""
    motion = [twist[:3] + np.cross(twist[3:], positions - point) for twist in UNIT_TWISTS]
    return np.stack(motion, axis=2)


def mean_motion(positions: np.ndarray, point: np.ndarray, weights: np.ndarray | None) -> np.ndarray:
    """Return the share of each node's displacement in each motion of a point, (6, k, 3).

    It is the rigid motion nearest to the nodes' displacements, by least squares: Σ w |u − t − θ × (x − p)|² is least.

    Args:
        positions: Of the nodes [m], (k, 3).
        point: [m], (3,).
        weights: w of the nodes, (k,); None of equal ones.
    """
    roots = np.ones(3 * len(positions)) if weights is None else np.sqrt(np.repeat(weights, 3))
    P = roots[:, None] * rigid_motion(positions, point).reshape(-1, 6)
    scale = np.linalg.norm(P, axis=0)
    shares = np.linalg.pinv(P / scale) / scale[:, None] * roots
    return np.asarray(shares.reshape(6, -1, 3))
