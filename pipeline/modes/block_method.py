"""The block method for solid and plane parts: block Lanczos with the flexibility G of the body as inverse.

The factor of K_c that G needs serves static columns too (`modes.static`). A second factor, of K − σM with σ in a gap
above the last wanted eigenvalue, counts by its inertia the eigenvalues below: Ritz values are upper bounds, so that as
many of them below the gap prove that none is missed. It is in single precision where the gap is wide enough.
"""

import numpy as np

from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.linalg import factorise
from gudgeon.pipeline.modes.block_lanczos import block_lanczos, capacity
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.modes.problem import Count, Pairs, Problem

LEAST_DOFS = 6000
"""For fewer dofs Lanczos with single columns is as fast."""
CLEAR = 1e-3
"""Least relative gap between eigenvalues that is wide enough for a count."""
SINGLE_FLOOR = float(np.finfo(np.float32).eps)


def suits(model: FEModel, count: int) -> bool:
    """Return whether the block method is the faster one for so many modes of a model."""
    free = len(model.free)
    return model.parts is None and free >= LEAST_DOFS and free >= 2 * capacity(count)


def block_pairs(model: FEModel, problem: Problem, count: int, flexibility: Flexibility | None = None) -> Pairs | None:
    """Return the lowest pairs; None if the method does not suit the model or did not converge.

    Args:
        flexibility: Of the model, if it is factorised already.
    """
    if not suits(model, count):
        return None
    factor = flexibility or Flexibility(model)
    pairs = block_lanczos(problem, factor.displaced, 0.0, count)
    if flexibility is None:
        factor.free()
    if pairs is None:
        return None
    return Pairs(pairs.values, pairs.vectors, _count_above(problem, pairs.values, count))


def _count_above(problem: Problem, values: np.ndarray, count: int) -> Count:
    """Return the inertia count with a shift in a gap above the last wanted one of ascending Ritz values.

    The inertia of a factor is exact for a matrix within round-off of the given one: the gap has to be wider.
    """
    lower, upper = values[count - 1 : -1], values[count:]
    uncertain = 2 * SINGLE_FLOOR * problem.highest
    clear = upper - lower > np.maximum(CLEAR * lower, uncertain)
    gap = int(np.argmax(clear)) if clear.any() else int(np.argmax(upper / lower))
    sigma = 0.5 * float(lower[gap] + upper[gap])
    factor = factorise(problem.K - sigma * problem.M, single=bool(clear.any()))
    below = factor.negative_pivots() - problem.rigid.shape[1]
    factor.free()
    return sigma, below
