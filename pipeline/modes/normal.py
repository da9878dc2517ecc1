"""Normal modes K Φ = M Φ Λ: extracted by the method that suits the body, and proof that none is missed.

Rigid modes that the supports leave are deflated. The modes are zero where the body is held.
"""

from dataclasses import dataclass

import numpy as np

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.model import FEModel, LineStiffness
from gudgeon.pipeline.linalg import evened, factorise
from gudgeon.pipeline.modes import slepc
from gudgeon.pipeline.modes.block_method import block_pairs
from gudgeon.pipeline.modes.lanczos import SPARE, lanczos_pairs, lower_shift
from gudgeon.pipeline.modes.problem import Pairs, Problem

RESIDUAL_TOLERANCE = 1e-8
"""‖KΦ − MΦΛ‖ / ‖KΦ‖ per mode: Lanczos at full precision gives 1e-10 or better on tet10 solids."""
ROUND_OFF_SHARE = 10.0
"""The residual may be this much of the round-off floor over the mode's eigenvalue: bending of fine beams reaches it."""
ORTHOGONALITY_TOLERANCE = 1e-10
SMALL_MIXING = 1e-5
"""Of modes by round-off, up to which one step of perturbation is exact."""
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
    problem = Problem.of(model)
    floor = np.finfo(float).eps * problem.highest
    pairs = _pairs(model, problem, count)
    values, vectors = pairs.values, pairs.vectors[:, :count]
    if floor > MIXING_LIMIT * values[0]:
        raise StageError(
            f"modes: {'rigid and elastic modes' if problem.rigid.shape[1] else 'the lowest modes and round-off'} cannot"
            f" be told apart (round-off floor {floor:.2g}, first eigenvalue {values[0]:.2g} rad²/s²); the mesh has"
            " slivers, extreme contrast, ν next to 0.5, or parts that hang together by an edge only"
        )
    inertia = _inertia(model, problem, pairs, count)
    if missed := int(inertia["inertia_found"] - inertia["inertia_expected"]):
        raise StageError(f"modes: the inertia count finds {missed:+d} modes beside the {count} extracted")
    vectors = vectors * np.where(vectors[np.abs(vectors).argmax(0), range(count)] < 0, -1, 1)
    Phi = np.zeros((len(model.held), count))
    Phi[model.free] = vectors
    exact = None
    if model.parts is not None:
        Phi, exact = _parted(model.parts, Phi)
        vectors = Phi[model.free]
    values, quality = _verified(problem, vectors, floor, exact)
    return NormalModes(np.sqrt(values), Phi, quality | inertia)


def _parted(parts: LineStiffness, Phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return modes (dofs, m) without what round-off of K mixed into them, and their eigenvalues [rad²/s²], (m,).

    ΦᵀKΦ by elements is diagonal but for round-off E: one step of perturbation, φⱼ + Σᵢ φᵢ Eᵢⱼ/(λⱼ − λᵢ), takes it out.
    """
    projected = parts.product(Phi)
    values = projected.diagonal()
    apart = values - values[:, None]
    np.fill_diagonal(apart, np.inf)
    with np.errstate(divide="ignore"):
        mixed = projected / apart
    np.fill_diagonal(mixed, 0.0)
    if np.abs(mixed).max(initial=0.0) < SMALL_MIXING:
        Phi = Phi + Phi @ mixed
        values = parts.product(Phi).diagonal()
    return Phi, values


def _pairs(model: FEModel, problem: Problem, count: int) -> Pairs:
    """Return the lowest pairs by SLEPc where the environment asks for it, in blocks where that suits, or by Lanczos."""
    if slepc.command() is None:
        return block_pairs(model, problem, count) or lanczos_pairs(model, problem, count)
    shift = lower_shift(model, problem)
    return Pairs(*slepc.slepc_pairs(problem.K, problem.M, problem.rigid, shift, count + SPARE))


def _inertia(model: FEModel, problem: Problem, pairs: Pairs, count: int) -> dict[str, float]:
    """Return a shift in the gap after the last wanted pair, how many elastic eigenvalues are below it, and pairs."""
    if pairs.proven is not None:
        sigma, below = pairs.proven
        return _count(sigma, below, int((pairs.values < sigma).sum()))
    values, gap_after = pairs.values, count - 1
    # A double mode across the cut leaves no gap: the next gap upward serves as well.
    while gap_after + 1 < len(values) - 1 and values[gap_after + 1] / values[gap_after] - 1 < 1e-6:
        gap_after += 1
    sigma = 0.5 * (values[gap_after] + values[gap_after + 1])
    if slepc.command() is not None:
        negative = slepc.slepc_negative_pivots(problem.K, problem.M, sigma)
    else:
        shifted = problem.K - sigma * problem.M
        factor = factorise(shifted if model.parts is None else evened(shifted))
        negative = factor.negative_pivots()
        factor.free()
    return _count(sigma, negative - problem.rigid.shape[1], gap_after + 1)


def _count(shift: float, found: int, expected: int) -> dict[str, float]:
    return {"inertia_shift": float(shift), "inertia_found": found, "inertia_expected": expected}


def _verified(
    problem: Problem, Phi: np.ndarray, floor: float, exact: np.ndarray | None
) -> tuple[np.ndarray, dict[str, float]]:
    """Return the modes' Rayleigh quotients, which carry less round-off than the method's own values, and quality.

    Args:
        exact: The quotients, where elements gave them, (m,).
    """
    forces, momenta = problem.K @ Phi, problem.M @ Phi
    values = np.einsum("dm,dm->m", Phi, forces) if exact is None else exact
    values = values / np.einsum("dm,dm->m", Phi, momenta)
    # Forces and moments of beams have units of their own: each is measured by the mass that it moves.
    weight = 1.0 if exact is None else 1 / np.sqrt(problem.M.diagonal())[:, None]
    residual = np.linalg.norm((forces - momenta * values) * weight, axis=0) / np.linalg.norm(forces * weight, axis=0)
    basis = np.column_stack([problem.rigid, Phi])
    gram = basis.T @ np.column_stack([problem.M_rigid, momenta])
    orthogonality = float(np.abs(gram - np.eye(basis.shape[1])).max())
    allowed = np.maximum(RESIDUAL_TOLERANCE, ROUND_OFF_SHARE * floor / values)
    if np.any(residual > allowed) or orthogonality > ORTHOGONALITY_TOLERANCE:
        raise StageError(f"modes: residual {residual.max():.2g}, orthogonality {orthogonality:.2g}: not accepted")
    return values, {
        "residual": float(residual.max()),
        "orthogonality": orthogonality,
        "modes_missed": 0,
        "rigid_floor": floor / float(values[0]),
    }
