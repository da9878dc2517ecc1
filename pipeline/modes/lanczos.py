"""Shift-invert Lanczos by ARPACK, one right-hand side at a time: for any model, and the reference of the block method.

The shift is negative where rigid motions are left. A body that is held has none: K of its free dofs is definite and
the shift is zero.
"""

from collections.abc import Callable

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.linalg import EvenedFactor, Solver, factorise
from gudgeon.pipeline.modes.problem import Pairs, Problem, grounding, whole_groups

SPARE = 2
"""Pairs beyond the wanted ones, so that there is a gap above the last wanted one for the inertia count."""
REACH = 1e6
"""Largest eigenvalue over the first up to which one shift serves: round-off of the inverse grows with this ratio."""


def lanczos_pairs(model: FEModel, problem: Problem, count: int) -> Pairs:
    """Return the lowest `count` pairs, and as many more as it takes to see a gap above them, at least `SPARE`.

    Raises:
        StageError: ARPACK did not converge.
    """
    spare, limit = SPARE, problem.K.shape[0] - problem.rigid.shape[1] - 1
    pairs = _lowest(model, problem, count, count + spare)
    while whole_groups(pairs.values, count) == len(pairs.values) < limit:
        spare *= 2
        pairs = _lowest(model, problem, count, min(count + spare, limit))
    return pairs


def _lowest(model: FEModel, problem: Problem, count: int, extracted: int) -> Pairs:
    shift = lower_shift(model, problem)
    factor = factorise(problem.K - shift * problem.M, definite=model.parts is not None)
    pairs = _in_order(*inverse_lanczos(problem, shift, extracted, factor))
    if model.parts is None:
        return pairs
    high = int(np.searchsorted(pairs.values, REACH * pairs.values[0]))
    return pairs if high >= count else _high_again(problem, pairs, high)


def _in_order(values: np.ndarray, vectors: np.ndarray) -> Pairs:
    order = np.argsort(values)
    return Pairs(values[order], vectors[:, order])


def _high_again(problem: Problem, pairs: Pairs, high: int) -> Pairs:
    """Return pairs with those from an index on replaced by what Lanczos finds around a shift amidst them.

    Bending of a line spreads eigenvalues as the fourth power of their number. The shift is in the gap above the middle,
    so that none of the densely spaced lower ones is farther than the spare ones above the last.
    """
    values = pairs.values
    above = min(int(np.searchsorted(values, 0.5 * (values[high] + values[-1]))), len(values) - 2)
    shift = 0.5 * float(values[above] + values[above + 1])
    target = min(len(values) - high + 3 * SPARE, problem.K.shape[0] - 1)
    high_pairs = _in_order(*inverse_lanczos(problem, shift, target, EvenedFactor(problem.K - shift * problem.M)))
    start = int(np.searchsorted(high_pairs.values, 0.5 * (values[high - 1] + values[high])))
    span = slice(start, start + len(values) - high)
    low = pairs.vectors[:, :high]
    vectors = high_pairs.vectors[:, span]
    vectors = vectors - low @ (low.conj().T @ (problem.M @ vectors))
    return Pairs(np.concatenate([values[:high], high_pairs.values[span]]), np.hstack([low, vectors]))


def inverse_lanczos(problem: Problem, shift: float, count: int, factor: Solver) -> tuple[np.ndarray, np.ndarray]:
    """Return the elastic eigenpairs nearest to a shift, unordered: λ [rad²/s²], (count,), and vectors (free, count).

    ARPACK accepts a pair at a residual of eps^⅔ where the inverse of its eigenvalue is below that, which is too early
    for small parts, whose eigenvalues are large numbers in SI. It works therefore in a unit close to the lowest ones.

    Args:
        shift: σ [rad²/s²].
        factor: Of K − σM; its memory is released.

    Raises:
        StageError: ARPACK did not converge.
    """
    K, M = problem.K, problem.M

    def invert(load: np.ndarray) -> np.ndarray:
        return problem.elastic(factor.solve(np.ravel(load)))

    start = problem.elastic(np.random.default_rng(0).standard_normal(K.shape[0]).astype(K.dtype))
    sizes = [float(np.real(np.vdot(v, M @ v))) for v in (start, invert(M @ start))]
    unit = float(np.exp2(np.round(0.5 * np.log2(sizes[0] / sizes[1]))))
    inverse = LinearOperator(K.shape, lambda load: unit * invert(load), dtype=K.dtype)
    try:
        values, vectors = eigsh(K, count, M=M, sigma=shift / unit, v0=start, OPinv=inverse)
    except ArpackError as error:
        raise StageError(
            f"modes: the Lanczos iteration with shift {shift:.3g} rad²/s² did not converge ({error})"
        ) from error
    finally:
        factor.free()
    # Near σ = 0 the inverse amplifies the rigid motions that round-off leaves, more with each step of the iteration.
    return unit * values, problem.elastic(vectors)


def lower_shift(model: FEModel, problem: Problem) -> float:
    """Return a shift [rad²/s²] below all elastic eigenvalues: negative if rigid motions are left, else zero."""
    if not problem.rigid.shape[1]:
        return 0.0
    # Smooth fields do not bend rotations of a line and do not vanish at supports: there a static solution estimates.
    if model.held.any() or model.rotations.any():
        return -static_estimate(problem, lambda K: factorise(K, definite=True))
    return -_smooth_estimate(model)


def _smooth_estimate(model: FEModel) -> float:
    """Return 1 % of the least Rayleigh quotient of quadratic fields [rad²/s²]: below the first elastic eigenvalue."""
    arm = model.nodes - model.properties.centre
    rigid = model.rigid_modes
    quotients = []
    for square in (arm**2).T:
        for along in model.directions.T:
            u = model.of_nodes(np.outer(square, along))
            u -= rigid @ (rigid.T @ (model.M @ u))
            mass = float(u @ (model.M @ u))
            if mass > 0:
                quotients.append(float(u @ (model.K @ u)) / mass)
    return min(q for q in quotients if q > 0) / 100


def static_estimate(problem: Problem, factorised: Callable[[sparse.csr_matrix], Solver]) -> float:
    """Return 1 % of the Rayleigh quotient of a static solution [rad²/s²]: below the first elastic eigenvalue."""
    K, M, rigid = problem.K, problem.M, problem.rigid
    free = np.setdiff1d(np.arange(K.shape[0]), grounding(rigid))
    factor = factorised(sparse.csr_matrix(K[free][:, free]))
    u = np.random.default_rng(0).standard_normal(K.shape[0]).astype(K.dtype)
    for _ in range(2):
        load = M @ u
        load -= problem.M_rigid @ (rigid.conj().T @ load)
        u = np.zeros(K.shape[0], K.dtype)
        u[free] = factor.solve(load[free])
        u -= rigid @ (rigid.conj().T @ (M @ u))
    factor.free()
    return float(np.real(np.vdot(u, K @ u)) / np.real(np.vdot(u, M @ u))) / 100
