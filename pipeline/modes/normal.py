"""Normal modes K Φ = M Φ Λ by the method that suits the body, and the proof that none is missed.

Rigid modes that the supports leave are deflated. The modes are zero where the body is held.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.model import FEModel, LineStiffness
from gudgeon.pipeline.linalg import EvenedFactor, factorise
from gudgeon.pipeline.modes import slepc
from gudgeon.pipeline.modes.block_method import block_pairs, suits
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.modes.lanczos import SPARE, lanczos_pairs, lower_shift
from gudgeon.pipeline.modes.problem import Pairs, Problem, count_shift, whole_groups

SMALL_MIXING = 1e-5
"""Largest coefficient of round-off mixing between modes for which one step of perturbation is exact."""
MIXING_LIMIT = 1e-2
"""eps·max(K_ii/M_ii) over the first eigenvalue: above it, round-off mixes rigid and elastic modes (tets of aspect
1000), although every residual is still 1e-16."""
CAUSES = "Possible causes: slivers, extreme contrast of stiffness, ν close to 0.5, parts connected along an edge only"
"""Of a stiffness whose round-off is as large as its lowest eigenvalues."""


@dataclass(frozen=True)
class NormalModes:
    """Elastic modes."""

    angular_frequencies: np.ndarray
    """[rad/s], (m,), ascending."""
    Phi: np.ndarray
    """Mass-orthonormal, orthogonal to the rigid modes, (dofs, m)."""
    quality: dict[str, float]


def largest_count(model: FEModel) -> int:
    """Return how many elastic modes Lanczos can extract from a model, beside the spare ones."""
    return len(model.free) - len(model.rigid_twists) - 3


def normal_modes(model: FEModel, count: int, flexibility: Flexibility | None = None) -> NormalModes:
    """Return the lowest `count` elastic modes.

    Args:
        flexibility: Of the model, if it is factorised already.

    Raises:
        StageError: rigid and elastic modes cannot be separated, a mode was missed, or a residual is too large.
    """
    if count > largest_count(model):
        raise StageError(
            f"modes: {count} normal modes requested, the mesh has {len(model.free)} free dofs; refine the mesh or"
            " request fewer modes"
        )
    problem = Problem.of(model)
    floor = np.finfo(float).eps * problem.highest
    pairs = _pairs(model, problem, count, flexibility)
    values, vectors = pairs.values, pairs.vectors[:, :count]
    if floor > MIXING_LIMIT * values[0]:
        raise StageError(
            f"modes: {'rigid and elastic modes' if problem.rigid.shape[1] else 'the lowest modes and round-off'} cannot"
            f" be separated: the round-off of eigenvalues is {floor:.2g} rad²/s², the first eigenvalue"
            f" {values[0]:.2g} rad²/s². {CAUSES}"
        )
    inertia = _inertia(model, problem, pairs, count)
    if missed := inertia["inertia_found"] - inertia["inertia_expected"]:
        raise StageError(
            f"modes: the inertia count finds {missed:+d} modes in addition to the {count} extracted. {CAUSES}"
        )
    vectors = vectors * np.where(vectors[np.abs(vectors).argmax(0), range(count)] < 0, -1, 1)
    Phi = np.zeros((len(model.held), count))
    Phi[model.free] = vectors
    exact = None
    if model.parts is not None:
        Phi, exact = _unmixed(model.parts, Phi)
        vectors = Phi[model.free]
    values, quality = _verified(problem, vectors, exact)
    return NormalModes(np.sqrt(values), Phi, quality | inertia | {"whole_count": whole_groups(pairs.values, count)})


def _unmixed(elements: LineStiffness, Phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return modes (dofs, m) without the mixing by round-off of K, and their eigenvalues [rad²/s²], (m,).

    ΦᵀKΦ by elements is diagonal but for round-off E: one step of perturbation, φⱼ + Σᵢ φᵢ Eᵢⱼ/(λⱼ − λᵢ), removes it.
    """
    projected = elements.product(Phi)
    values = projected.diagonal()
    differences = values - values[:, None]
    np.fill_diagonal(differences, np.inf)
    with np.errstate(divide="ignore"):
        mixed = projected / differences
    np.fill_diagonal(mixed, 0.0)
    if np.abs(mixed).max(initial=0.0) < SMALL_MIXING:
        Phi = Phi + Phi @ mixed
        values = elements.product(Phi).diagonal()
    return Phi, values


def shared_flexibility(model: FEModel, rows: sparse.csr_matrix, count: int) -> Flexibility | None:
    """Return the flexibility of a model at rows (c, dofs) if `normal_modes` takes it for so many modes, else None."""
    return Flexibility(model, rows) if slepc.command() is None and suits(model, count) else None


def _pairs(model: FEModel, problem: Problem, count: int, flexibility: Flexibility | None) -> Pairs:
    """Return the lowest pairs by SLEPc if the environment configures it, else by the block method or Lanczos."""
    if slepc.command() is None:
        return block_pairs(model, problem, count, flexibility) or lanczos_pairs(model, problem, count)
    shift = lower_shift(model, problem)
    return Pairs(*slepc.slepc_pairs(problem.K, problem.M, problem.rigid, shift, count + SPARE))


def _inertia(model: FEModel, problem: Problem, pairs: Pairs, count: int) -> dict[str, float]:
    """Return a shift in the gap above the last wanted pair, and how many elastic eigenvalues and pairs are below."""
    if pairs.proven is not None:
        sigma, below = pairs.proven
        expected = int((pairs.values < sigma).sum())
    else:
        sigma, expected = count_shift(pairs.values, count)
        if slepc.command() is not None:
            negative = slepc.slepc_negative_pivots(problem.K, problem.M, sigma)
        else:
            shifted = problem.K - sigma * problem.M
            factor = factorise(shifted) if model.parts is None else EvenedFactor(shifted)
            negative = factor.negative_pivots()
            factor.free()
        below = negative - problem.rigid.shape[1]
    return {"inertia_shift": sigma, "inertia_found": below, "inertia_expected": expected}


def _verified(problem: Problem, Phi: np.ndarray, exact: np.ndarray | None) -> tuple[np.ndarray, dict[str, float]]:
    """Return the modes' Rayleigh quotients, which have less round-off than the extracted values, and quality.

    Args:
        exact: ΦᵀKΦ by elements, if there is one, (m,).
    """
    forces, momenta = problem.K @ Phi, problem.M @ Phi
    values = np.einsum("dm,dm->m", Phi, forces) if exact is None else exact
    values = values / np.einsum("dm,dm->m", Phi, momenta)
    # Forces and moments of beams have different units: each is scaled by the mass of its dof.
    weight = 1.0 if exact is None else 1 / np.sqrt(problem.M.diagonal())[:, None]
    residual = np.linalg.norm((forces - momenta * values) * weight, axis=0) / np.linalg.norm(forces * weight, axis=0)
    basis = np.column_stack([problem.rigid, Phi])
    gram = basis.T @ np.column_stack([problem.M_rigid, momenta])
    orthogonality = float(np.abs(gram - np.eye(basis.shape[1])).max())
    problem.refuse_inexact(values, residual, orthogonality)
    return values, {
        "residual": float(residual.max()),
        "orthogonality": orthogonality,
        "modes_missed": 0,
        "rigid_floor": np.finfo(float).eps * problem.highest / float(values[0]),
    }
