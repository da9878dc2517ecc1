"""Static displacements and gauge values under unit forces: the linearised system at rest.

With Λ = diag ω² of the elastic coordinates e, the rigid ones r, the ports a that hold and a unit force at each port e,

    Λ q_e = W_aᵀ f + W_eᵀ F,   0 = W_aᵀ f + W_eᵀ F over r,   W_a q + (R_aa + S) f + R_ae F = 0.

Elastic coordinates are eliminated, which leaves C = W_a Λ⁻¹ W_aᵀ + R_aa + S over the ports and the balance of the rigid
motions. With the residual flexibility this is the static answer of the mesh, whatever modes are kept.
"""

from collections.abc import Sequence

import numpy as np

from gudgeon.solver.errors import SceneError
from gudgeon.solver.linear.state import Linearised, Place

BALANCED = 1e-8
"""Share of a force that may be left of it where ports hold a body: more is a body that moves freely."""
SMALLEST = 1e-13
"""Singular value over the largest one below which ports hold the same twice."""


def static_response(found: Linearised, forces: Sequence[Place], others: Sequence[Place]) -> np.ndarray:
    """Return what is read at places per unit force at others, (n, k).

    Raises:
        SceneError: a force moves a body that nothing holds.
    """
    a = found.holding[np.isfinite(found.compliance(0.0))]
    S = found.compliance(0.0)[np.isfinite(found.compliance(0.0))]
    system, at = found.system, np.array([place.port for place in forces])
    rigid, elastic = system.rigid, np.setdiff1d(np.arange(len(system.stiffness)), system.rigid)
    soft = 1 / system.stiffness[elastic]
    R = found.residual.sum(axis=0)
    W, pushed = found.rows[a], found.rows[at]
    C = (W[:, elastic] * soft) @ W[:, elastic].T + R[np.ix_(a, a)] + np.diag(S)
    apart = (W[:, elastic] * soft) @ pushed[:, elastic].T + R[np.ix_(a, at)]
    f, moved = _held(found, 0.5 * (C + C.T), W[:, rigid], apart, pushed[:, rigid], forces)
    answers = np.zeros((len(others), len(forces)))
    for number, place in enumerate(others):
        near, line = place.residual.sum(axis=0), place.row
        answers[number] = (line[elastic] * soft) @ (W[:, elastic].T @ f + pushed[:, elastic].T)
        answers[number] += line[rigid] @ moved + near[a] @ f + near[at]
    return answers


def _held(
    found: Linearised,
    C: np.ndarray,
    rows: np.ndarray,
    apart: np.ndarray,
    pushed: np.ndarray,
    forces: Sequence[Place],
) -> tuple[np.ndarray, np.ndarray]:
    """Return the forces of the ports (a, k) and the rigid motions (r, k) under unit forces at others.

    Args:
        C: Compliance of the ports, (a, a).
        rows: Of the ports over the rigid coordinates, (a, r).
        apart: Displacement of the ports by each force, (a, k).
        pushed: Rows of the forces over the rigid coordinates, (k, r).
        forces: Their places, for messages.
    """
    count, free = rows.shape
    size = 1 / np.sqrt(np.maximum(C.diagonal(), np.finfo(float).tiny))
    stiff = ~(C.diagonal() > 0)  # Between rigid bodies without compliance.
    size[stiff] = np.median(size[~stiff]) if (~stiff).any() else 1.0
    scaled = rows * size[:, None]
    motion = np.linalg.norm(scaled, axis=0)
    motion = 1 / np.where(motion > 0, motion, 1.0)
    matrix = np.block([[C * np.outer(size, size), scaled * motion], [(scaled * motion).T, np.zeros((free, free))]])
    right = -np.vstack([apart * size[:, None], pushed.T * motion[:, None]])
    answer = np.linalg.lstsq(matrix, right, rcond=SMALLEST)[0] if len(matrix) else right
    left = np.abs(matrix @ answer - right)[count:].max(axis=0, initial=0.0)
    given = np.abs(right[count:]).max(axis=0, initial=0.0)
    for number in np.flatnonzero(left > BALANCED * np.maximum(given, np.finfo(float).tiny)):
        moving = np.abs((matrix @ answer - right)[count:, number])
        owner = int(found.system.rigid[int(moving.argmax())])
        body = next(n for n, b in found.system.bodies.items() if b.coordinates.start <= owner < b.coordinates.stop)
        raise SceneError(
            f"--static: {forces[int(number)].label} moves body '{body}', which nothing holds; add supports, a motion,"
            " springs or bushings"
        )
    return answer[:count] * size[:, None], answer[count:] * motion[:, None]
