"""The way `inverse`: Ritz vectors and static responses, improved by the factor of another design.

A step solves with the residuals r = K X − M X Λ and takes the Ritz pairs of the span of X, G r and the last direction
(LOBPCG; Knyazev 2001), with the flexibility G of a stored design as preconditioner. The static responses take
steps of preconditioned conjugate gradients, column by column; 2 Fᵀ Y − Yᵀ K Y is stationary in them.
"""

from collections.abc import Callable

import numpy as np
from scipy import linalg

from gudgeon.pipeline.design_change.projection import Projection, Target, independent
from gudgeon.pipeline.design_change.ways.answer import Answer, Search

Displaced = Callable[[np.ndarray], np.ndarray]

SETTLED = 0.1
"""Change of an estimate by the last step of conjugate gradients over the estimate, at most."""
ROUND_OFF = 1e-12
"""The same over the compliance: a smaller change is round-off."""
MOST = 10
"""Steps of conjugate gradients, at most."""


def enriched(search: Search) -> Answer | None:
    """Return a body in the basis of a family and of what the last step found.

    Displacements outside this basis have the flexibility that they have in the stored designs.
    """
    if search.step is None:
        return None
    displacements = search.step.displacements
    extended = Projection(search.target, displacements, search.projection)
    flexibility = extended.flexibility + search.family.remainder(search.projection, displacements)
    return Answer(extended, flexibility, search.step.direction)


def refined(
    target: Target, displaced: Displaced, vectors: tuple[np.ndarray, np.ndarray], direction: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return Ritz values (m,), vectors and the direction of a step (dofs, m).

    Args:
        displaced: Displacement under balanced forces (dofs, k) by a factor.
        vectors: Ritz values [rad²/s²], (m,), and vectors (dofs, m).
        direction: Of the step before, (dofs, d).
    """
    values, X = vectors
    K, M = target.model.K, target.model.M
    KX, MX = K @ X, M @ X
    added = displaced(target.balanced(KX - MX * values))
    if direction is not None:
        added = np.column_stack([added, direction])
    S = np.column_stack([X, added])
    stiffness, mass = (S.T @ np.column_stack(pair) for pair in ((KX, K @ added), (MX, M @ added)))
    turn = independent(stiffness)
    inverse_values, Z = linalg.eigh(turn.T @ (0.5 * (mass + mass.T)) @ turn)
    values = 1 / inverse_values[::-1][: len(values)]
    Z = turn @ Z[:, ::-1][:, : len(values)] * np.sqrt(values)
    count = X.shape[1]
    return values, S @ Z, S[:, count:] @ Z[count:]


def settled(
    target: Target,
    displaced: Displaced,
    loads: np.ndarray,
    responses: np.ndarray,
    reference: np.ndarray,
    negligible: float = 0.0,
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Return settled responses (dofs, k), their compliance (k, k), and whether it settled within `MOST` steps.

    Args:
        displaced: Displacement under balanced forces (dofs, k) by a factor.
        loads: Forces on the rows, (c, k).
        responses: Displacements Y to begin with, without rigid motions, (dofs, k).
        reference: Compliance of each load whose error is estimated, (k,).
        negligible: Change of an estimate over the compliance that need not settle.
    """
    forces = target.balanced(target.B.T @ loads)
    Y, R = responses, target.balanced(forces - target.model.K @ responses)
    compliance = stationary(forces, Y, R)
    direction, size = np.zeros_like(Y), np.ones(Y.shape[1])
    for step in range(MOST):
        Z = displaced(R)
        product = np.einsum("dk,dk->k", R, Z)
        direction = Z + direction * (product / size if step else 0.0)
        size = np.maximum(product, np.finfo(float).tiny)
        K_direction = target.balanced(target.model.K @ direction)
        length = product / np.maximum(np.einsum("dk,dk->k", direction, K_direction), np.finfo(float).tiny)
        Y, R = Y + direction * length, R - K_direction * length
        before, compliance = compliance, stationary(forces, Y, R)
        change, estimate = np.abs((compliance - before).diagonal()), np.abs(compliance.diagonal() - reference)
        if (change <= SETTLED * estimate + max(ROUND_OFF, negligible) * reference).all():
            return Y, compliance, True
    return Y, compliance, False


def stationary(F: np.ndarray, Y: np.ndarray, R: np.ndarray) -> np.ndarray:
    """Return FᵀY + YᵀF − YᵀKY for forces F and residuals R = F − K Y (dofs, k), (k, k)."""
    S = F.T @ Y
    return S + S.T - Y.T @ (F - R)
