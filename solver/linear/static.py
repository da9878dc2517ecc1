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


def static_response(linearised: Linearised, forces: Sequence[Place], others: Sequence[Place]) -> np.ndarray:
    """Return what is read at places per unit force at others, (n, k).

    Raises:
        SceneError: a force moves a body that nothing holds.
    """
    a = linearised.holding[np.isfinite(linearised.compliance(0.0))]
    S = linearised.compliance(0.0)[np.isfinite(linearised.compliance(0.0))]
    system, force_ports = linearised.system, np.array([force.port for force in forces])
    rigid, elastic = system.rigid, np.setdiff1d(np.arange(len(system.stiffness)), system.rigid)
    soft = 1 / system.stiffness[elastic]
    R = linearised.residual.sum(axis=0)
    W, force_rows = linearised.rows[a], linearised.rows[force_ports]
    C = (W[:, elastic] * soft) @ W[:, elastic].T + R[np.ix_(a, a)] + np.diag(S)
    displacement = (W[:, elastic] * soft) @ force_rows[:, elastic].T + R[np.ix_(a, force_ports)]
    f, moved = _held(linearised, 0.5 * (C + C.T), W[:, rigid], displacement, force_rows[:, rigid], forces)
    answers = np.zeros((len(others), len(forces)))
    for i, p in enumerate(others):
        R_place, line = p.residual.sum(axis=0), p.row
        answers[i] = (line[elastic] * soft) @ (W[:, elastic].T @ f + force_rows[:, elastic].T)
        answers[i] += line[rigid] @ moved + R_place[a] @ f + R_place[force_ports]
    return answers


def _held(
    linearised: Linearised,
    C: np.ndarray,
    rows: np.ndarray,
    displacement: np.ndarray,
    force_rows: np.ndarray,
    forces: Sequence[Place],
) -> tuple[np.ndarray, np.ndarray]:
    """Return the forces of the ports (a, k) and the rigid motions (r, k) under unit forces at others.

    Args:
        C: Compliance of the ports, (a, a).
        rows: Of the ports over the rigid coordinates, (a, r).
        displacement: Displacement of the ports by each force, (a, k).
        force_rows: Rows of the forces over the rigid coordinates, (k, r).
        forces: Their places, for messages.
    """
    count, free = rows.shape
    size = 1 / np.sqrt(np.maximum(np.abs(C.diagonal()), np.finfo(float).tiny))
    stiff = C.diagonal() == 0  # Between rigid bodies without compliance.
    size[stiff] = np.median(size[~stiff]) if (~stiff).any() else 1.0
    scaled = rows * size[:, None]
    motion = np.linalg.norm(scaled, axis=0)
    motion = 1 / np.where(motion > 0, motion, 1.0)
    matrix = np.block([[C * np.outer(size, size), scaled * motion], [(scaled * motion).T, np.zeros((free, free))]])
    right = -np.vstack([displacement * size[:, None], force_rows.T * motion[:, None]])
    answer = np.linalg.lstsq(matrix, right, rcond=SMALLEST)[0] if len(matrix) else right
    residual = np.abs(matrix @ answer - right)[count:].max(axis=0, initial=0.0)
    magnitude = np.abs(right[count:]).max(axis=0, initial=0.0)
    for i in np.flatnonzero(residual > BALANCED * np.maximum(magnitude, np.finfo(float).tiny)):
        moving = np.abs((matrix @ answer - right)[count:, i])
        owner = int(linearised.system.rigid[int(moving.argmax())])
        body = next(n for n, b in linearised.system.bodies.items() if b.coordinates.start <= owner < b.coordinates.stop)
        raise SceneError(
            f"--static: {forces[int(i)].label} moves body '{body}', which nothing holds; add supports, a motion,"
            " springs or bushings"
        )
    return answer[:count] * size[:, None], answer[count:] * motion[:, None]
