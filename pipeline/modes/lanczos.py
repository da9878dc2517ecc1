"""Shift-invert Lanczos by ARPACK, one right-hand side at a time: for any model, and the oracle of the block method.

The shift is negative where rigid motions are left. A body that is held has none: K of its free dofs is definite and
the shift is zero.
"""

import numpy as np
from scipy import linalg, sparse
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.linalg import factorise
from gudgeon.pipeline.modes.problem import Pairs, Problem

SPARE = 2
"""Pairs beyond the wanted ones, so that the inertia count has a gap above the last wanted one to stand in."""


def lanczos_pairs(model: FEModel, problem: Problem, count: int) -> Pairs:
    """Return the lowest `count` pairs, and two more.

    Raises:
        StageError: ARPACK gave up.
    """
    shift = lower_shift(model, problem)
    factor = factorise(problem.K - shift * problem.M, definite=model.parts is not None)

    def invert(load: np.ndarray) -> np.ndarray:
        return problem.elastic(factor.solve(np.ravel(load)))

    start = problem.elastic(np.random.default_rng(0).standard_normal(problem.K.shape[0]))
    unit = eigenvalue_unit(invert(problem.M @ start), start, problem.M)
    inverse = LinearOperator(problem.K.shape, lambda load: unit * invert(load), dtype=float)
    try:
        values, vectors = eigsh(problem.K, count + SPARE, M=problem.M, sigma=shift / unit, v0=start, OPinv=inverse)
    except ArpackError as error:
        raise StageError(f"modes: Lanczos gave up with shift {shift:.3g} rad²/s² ({error})") from error
    finally:
        factor.free()
    order = np.argsort(values)
    return Pairs(unit * values[order], vectors[:, order])


def eigenvalue_unit(answer: np.ndarray, start: np.ndarray, M: sparse.csr_matrix) -> float:
    """Return a power of two next to the lowest eigenvalues [rad²/s²], in which ARPACK is to count.

    It takes a pair for converged by eps^⅔ where the inverse of its eigenvalue is below that: small parts, whose
    eigenvalues are large numbers in SI, would be given up early.

    Args:
        answer: (K − σM)⁻¹ M start, (n,).
    """
    sizes = [float(np.real(np.vdot(one, M @ one))) for one in (start, answer)]
    return float(np.exp2(np.round(0.5 * np.log2(sizes[0] / sizes[1]))))


def lower_shift(model: FEModel, problem: Problem) -> float:
    """Return a shift [rad²/s²] below all elastic eigenvalues: zero where nothing moves rigidly, else negative."""
    if not problem.rigid.shape[1]:
        return 0.0
    # Smooth fields bend neither a line's rotations nor know what is held: there a static answer estimates.
    smooth = not (model.held.any() or model.rotations.any())
    return -(_first_estimate(model) if smooth else _static_estimate(problem))


def _first_estimate(model: FEModel) -> float:
    """Return an eigenvalue scale [rad²/s²] below the first elastic one: least quotient of smooth fields / 100."""
    arm = model.nodes - model.properties.centre
    rigid = model.rigid_modes
    quotients = []
    for axis in range(3):
        for other in range(3):
            field = np.zeros_like(arm)
            field[:, other] = arm[:, axis] ** 2
            u = (field @ model.directions.T).ravel()
            u -= rigid @ (rigid.T @ (model.M @ u))
            mass = float(u @ (model.M @ u))
            if mass > 0:
                quotients.append(float(u @ (model.K @ u)) / mass)
    return min(q for q in quotients if q > 0) / 100


def _static_estimate(problem: Problem) -> float:
    """Return an eigenvalue scale [rad²/s²] below the first elastic one: the quotient of a static answer / 100."""
    K, M, rigid = problem.K, problem.M, problem.rigid
    grounded = linalg.qr(rigid.T, mode="economic", pivoting=True)[2][: rigid.shape[1]]
    free = np.setdiff1d(np.arange(K.shape[0]), grounded)
    factor = factorise(sparse.csr_matrix(K[free][:, free]), definite=True)
    u = np.random.default_rng(0).standard_normal(K.shape[0])
    for _ in range(2):
        load = M @ u
        load -= (M @ rigid) @ (rigid.T @ load)
        u = np.zeros(K.shape[0])
        u[free] = factor.solve(load[free])
        u -= rigid @ (rigid.T @ (M @ u))
    factor.free()
    return float(u @ (K @ u)) / float(u @ (M @ u)) / 100
