"""Normal modes K Φ = M Φ Λ: shift-invert Lanczos, and proof that none is missed.

Rigid modes that the supports leave are deflated, and the shift is negative then. A body that is held has none: K of
its free dofs is definite and the shift is zero. The modes are zero where the body is held.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg, sparse
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from pipeline.errors import StageError
from pipeline.femodel import FEModel
from pipeline.linalg import factorise

RESIDUAL_TOLERANCE = 1e-8
"""‖KΦ − MΦΛ‖ / ‖KΦ‖ per mode: Lanczos at full precision gives 1e-10 or better on tet10 solids."""
ROUND_OFF_SHARE = 10.0
"""The residual may be this much of the round-off floor over the mode's eigenvalue: bending of fine beams reaches it."""
ORTHOGONALITY_TOLERANCE = 1e-10
MIXING_LIMIT = 1e-2
"""eps·max(K_ii/M_ii) over the first eigenvalue: above it, round-off mixes rigid and elastic modes (tets of aspect
1000), although every residual still reads 1e-16."""


@dataclass(frozen=True)
class NormalModes:
    """Elastic modes."""

    angular_frequencies: np.ndarray
    """[rad/s], (m,), ascending."""
    Phi: np.ndarray
    """Mass-orthonormal, orthogonal to the rigid modes, (dofs, m)."""
    quality: dict[str, float]


@dataclass(frozen=True)
class _Problem:
    """The dofs that no support holds."""

    K: sparse.csr_matrix
    M: sparse.csr_matrix
    rigid: np.ndarray


def largest_count(model: FEModel) -> int:
    """Return how many elastic modes Lanczos can extract of a model, two spare ones aside."""
    return len(model.free) - len(model.rigid_twists) - 3


def normal_modes(model: FEModel, count: int) -> NormalModes:
    """Extract the lowest `count` elastic modes.

    Raises:
        StageError: rigid and elastic modes cannot be told apart, a mode was missed, or a residual is too large.
    """
    if count > largest_count(model):
        raise StageError(
            f"modes: {count} normal modes asked of a mesh with {len(model.free)} free dofs; refine it or ask for fewer"
        )
    problem = _Problem(*model.free_matrices(), model.rigid_modes[model.free])
    K, M, rigid = problem.K, problem.M, problem.rigid
    floor = np.finfo(float).eps * float((K.diagonal() / M.diagonal()).max())
    # Smooth fields bend neither a line's rotations nor know what is held: there a static answer estimates.
    smooth = not (model.held.any() or model.rotations.any())
    shift = -(_first_estimate(model) if smooth else _static_estimate(problem)) if rigid.shape[1] else 0.0
    factor = factorise(K - shift * M)
    M_rigid = M @ rigid

    def invert(load: np.ndarray) -> np.ndarray:
        answer = factor.solve(np.ravel(load))
        return answer - rigid @ (M_rigid.T @ answer)

    start = np.random.default_rng(0).standard_normal(K.shape[0])
    start -= rigid @ (M_rigid.T @ start)
    # Two more than wanted, so that the inertia count has a gap above the last wanted one to stand in.
    try:
        values, vectors = eigsh(
            K, count + 2, M=M, sigma=shift, v0=start, OPinv=LinearOperator(K.shape, invert, dtype=float)
        )
    except ArpackError as error:
        raise StageError(f"modes: Lanczos gave up with shift {shift:.3g} rad²/s² ({error})") from error
    finally:
        factor.free()
    order = np.argsort(values)
    values, vectors = values[order], vectors[:, order]
    if floor > MIXING_LIMIT * values[0]:
        raise StageError(
            f"modes: {'rigid and elastic modes' if rigid.shape[1] else 'the lowest modes and round-off'} cannot be told"
            f" apart (round-off floor {floor:.2g}, first eigenvalue {values[0]:.2g} rad²/s²); the mesh has slivers,"
            " extreme contrast, ν next to 0.5, or parts that hang together by an edge only"
        )
    missed = _count_below(problem, values, count) - count
    if missed:
        raise StageError(f"modes: the inertia count finds {missed:+d} modes beside the {count} extracted")
    vectors = vectors[:, :count] * np.where(vectors[np.abs(vectors[:, :count]).argmax(0), range(count)] < 0, -1, 1)
    quality = _verified(problem, values[:count], vectors, floor)
    Phi = np.zeros((len(model.held), count))
    Phi[model.free] = vectors
    return NormalModes(np.sqrt(values[:count]), Phi, quality)


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


def _static_estimate(problem: _Problem) -> float:
    """Return an eigenvalue scale [rad²/s²] below the first elastic one: the quotient of a static answer / 100."""
    K, M, rigid = problem.K, problem.M, problem.rigid
    grounded = linalg.qr(rigid.T, mode="economic", pivoting=True)[2][: rigid.shape[1]]
    free = np.setdiff1d(np.arange(K.shape[0]), grounded)
    factor = factorise(sparse.csr_matrix(K[free][:, free]))
    u = np.random.default_rng(0).standard_normal(K.shape[0])
    for _ in range(2):
        load = M @ u
        load -= (M @ rigid) @ (rigid.T @ load)
        u = np.zeros(K.shape[0])
        u[free] = factor.solve(load[free])
        u -= rigid @ (rigid.T @ (M @ u))
    factor.free()
    return float(u @ (K @ u)) / float(u @ (M @ u)) / 100


def _count_below(problem: _Problem, values: np.ndarray, count: int) -> int:
    """Count elastic eigenvalues below the gap after the last wanted one, by the inertia of K − σM."""
    gap_after = count - 1
    # A double mode across the cut leaves no gap: the next gap upward serves as well.
    while gap_after + 1 < len(values) - 1 and values[gap_after + 1] / values[gap_after] - 1 < 1e-6:
        gap_after += 1
    sigma = 0.5 * (values[gap_after] + values[gap_after + 1])
    factor = factorise(problem.K - sigma * problem.M)
    below = factor.negative_pivots() - problem.rigid.shape[1]
    factor.free()
    return below - (gap_after + 1 - count)


def _verified(problem: _Problem, values: np.ndarray, Phi: np.ndarray, floor: float) -> dict[str, float]:
    K, M = problem.K, problem.M
    forces = K @ Phi
    residual = np.linalg.norm(forces - (M @ Phi) * values, axis=0) / np.linalg.norm(forces, axis=0)
    basis = np.column_stack([problem.rigid, Phi])
    orthogonality = float(np.abs(basis.T @ (M @ basis) - np.eye(basis.shape[1])).max())
    allowed = np.maximum(RESIDUAL_TOLERANCE, ROUND_OFF_SHARE * floor / values)
    if np.any(residual > allowed) or orthogonality > ORTHOGONALITY_TOLERANCE:
        raise StageError(f"modes: residual {residual.max():.2g}, orthogonality {orthogonality:.2g}: not accepted")
    return {
        "residual": float(residual.max()),
        "orthogonality": orthogonality,
        "modes_missed": 0,
        "rigid_floor": floor / float(values[0]),
    }
