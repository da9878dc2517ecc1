"""Normal modes K Φ = M Φ Λ: extracted by the method that suits the body, and proof that none is missed.

Rigid modes that the supports leave are deflated. The modes are zero where the body is held.
"""

from dataclasses import dataclass

import numpy as np

from pipeline.errors import StageError
from pipeline.femodel import FEModel
from pipeline.linalg import factorise
from pipeline.modes import slepc
from pipeline.modes.blocks import block_pairs
from pipeline.modes.lanczos import SPARE, lanczos_pairs, lower_shift
from pipeline.modes.problem import Pairs, Problem

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
    inertia = _inertia(problem, pairs, count)
    if missed := int(inertia["inertia_found"] - inertia["inertia_expected"]):
        raise StageError(f"modes: the inertia count finds {missed:+d} modes beside the {count} extracted")
    vectors = vectors * np.where(vectors[np.abs(vectors).argmax(0), range(count)] < 0, -1, 1)
    values, quality = _verified(problem, vectors, floor)
    Phi = np.zeros((len(model.held), count))
    Phi[model.free] = vectors
    return NormalModes(np.sqrt(values), Phi, quality | inertia)


def _pairs(model: FEModel, problem: Problem, count: int) -> Pairs:
    """Return the lowest pairs by SLEPc where the environment asks for it, in blocks where that suits, or by Lanczos."""
    if slepc.command() is None:
        return block_pairs(model, problem, count) or lanczos_pairs(model, problem, count)
    shift = lower_shift(model, problem)
    return Pairs(*slepc.slepc_pairs(problem.K, problem.M, problem.rigid, shift, count + SPARE))


def _inertia(problem: Problem, pairs: Pairs, count: int) -> dict[str, float]:
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
        factor = factorise(problem.K - sigma * problem.M)
        negative = factor.negative_pivots()
        factor.free()
    return _count(sigma, negative - problem.rigid.shape[1], gap_after + 1)


def _count(shift: float, found: int, expected: int) -> dict[str, float]:
    return {"inertia_shift": float(shift), "inertia_found": found, "inertia_expected": expected}


def _verified(problem: Problem, Phi: np.ndarray, floor: float) -> tuple[np.ndarray, dict[str, float]]:
    """Return the modes' Rayleigh quotients, which carry less round-off than the method's own values, and quality."""
    forces, momenta = problem.K @ Phi, problem.M @ Phi
    values = np.einsum("dm,dm->m", Phi, forces) / np.einsum("dm,dm->m", Phi, momenta)
    residual = np.linalg.norm(forces - momenta * values, axis=0) / np.linalg.norm(forces, axis=0)
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
