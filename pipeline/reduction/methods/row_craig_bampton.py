"""Fixed-interface modes and constraint modes of the interfaces' own rows (Craig & Bampton 1968, with rows for dofs).

The interface coordinates are w = B u: displacements of contact points, functions of traction spaces and loads, where
`craig_bampton` takes every dof that a row touches. Fixed-interface modes are those of the body with B φ = 0, constraint
modes the static displacements under forces Bᵀ λ in balance, Φ_rᵀ Bᵀ λ = 0: with the rigid motions they follow any w.
With F = K − σM the constrained inverse is F⁻¹ − Y (B Y)⁺ Yᵀ, Y = F⁻¹ Bᵀ.
"""

from dataclasses import replace

import numpy as np
from scipy import linalg

from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.linalg import Solver, factorise
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.modes.lanczos import SPARE, inverse_lanczos, lower_shift
from gudgeon.pipeline.modes.problem import Problem, null_motions, whole_groups
from gudgeon.pipeline.modes.static import BLOCK
from gudgeon.pipeline.reduction.methods.craig_bampton import DENSE, EMPTY
from gudgeon.pipeline.reduction.methods.macneal import row_count
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction, completed, lowest, ritz_modes
from gudgeon.pipeline.scenes.modes import ModesSettings

DEPENDENT = 1e-12
"""Share of the largest compliance of scaled rows below which a combination of them moves with the others."""
HELD = 1e-8
"""Motion of the rows in a fixed-interface mode, of that which its largest displacement would give."""


class HeldFactor:
    """The inverse of K − σM of a body whose rows are held."""

    def __init__(self, factor: Solver, B: np.ndarray) -> None:
        """Condense a factor over n dofs on rows (c, n)."""
        self._factor, self._B = factor, B
        self._Y = np.column_stack([factor.solve(B[k : k + BLOCK].T.copy()) for k in range(0, len(B), BLOCK)])
        compliance = B @ self._Y
        size = np.sqrt(np.maximum(compliance.diagonal(), 0.0))
        size = 1 / np.where(size > 0, size, 1.0)
        self._stiffness = linalg.pinvh(compliance * np.outer(size, size), rtol=DEPENDENT) * np.outer(size, size)

    def held(self, columns: np.ndarray) -> np.ndarray:
        """Return columns (n, …) without the motion of the rows."""
        return columns - self._Y @ (self._stiffness @ (self._B @ columns))

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Return the displacement under loads, (n,) or (n, k)."""
        return self.held(self._factor.solve(loads))

    def free(self) -> None:
        """Release the memory of the factor."""
        self._factor.free()

    def negative_pivots(self) -> int:
        """Return the number of negative eigenvalues of K − σM without constraints."""
        return self._factor.negative_pivots()


def row_craig_bampton(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body to constraint modes of all rows and the lowest modes with all rows held."""
    count = row_count(rows, "row-craig-bampton")
    fixed, whole_count = fixed_modes(model, rows, settings.fixed_count)
    flexibility = Flexibility(model, rows.B)
    balanced = null_motions((rows.B @ model.rigid_modes).T, EMPTY * float(np.abs(model.rigid_modes).max(initial=0.0)))
    forces = balanced if model.rigid_modes.shape[1] else np.eye(count)
    static = [flexibility.solve((forces[k : k + BLOCK] @ rows.B).T) for k in range(0, len(forces), BLOCK)]
    modes = ritz_modes(model, np.column_stack([fixed, *static]))
    mode_count = len(modes.angular_frequencies)
    count_kept = settings.kept_of(mode_count)
    if mode_count < max(1, count_kept):
        raise InputError(
            f"modes.normal_count: {settings.normal_count} given, {count} rows and {settings.fixed_count} modes with"
            f" rows held have {mode_count} coordinates; request fewer, or 0 for all"
        )
    quality = modes.quality | {"held_rows": count, "whole_fixed_count": whole_count}
    reduction = completed(model, rows, lowest(replace(modes, quality=quality), count_kept), flexibility)
    flexibility.free()
    return reduction


def fixed_modes(model: FEModel, rows: ContactRows, count: int) -> tuple[np.ndarray, int]:
    """Return the lowest elastic modes of a body with all rows held, (dofs, count), and `whole_groups` of them.

    Raises:
        InputError: the held body has fewer modes.
        StageError: rows move in a mode.
    """
    problem, B = Problem.of(model), rows.B[:, model.free].toarray()
    # Rigid motions that no row notices remain, and are no modes.
    loose = null_motions(B @ problem.rigid, EMPTY * float(np.abs(problem.rigid).max(initial=0.0)))
    problem = replace(problem, rigid=problem.rigid @ loose.T)
    limit = B.shape[1] - np.linalg.matrix_rank(B) - len(loose)
    if count > limit:
        raise InputError(
            f"modes.fixed_count: {count} given, the body with its interfaces held has {limit} modes; refine the mesh or"
            " request fewer modes"
        )
    Phi = np.zeros((len(model.held), count))
    if count == 0:
        return Phi, 0
    if B.shape[1] <= DENSE or count + SPARE >= limit:
        N = linalg.null_space(B)
        K, M = (N.T @ (matrix @ N) for matrix in (problem.K, problem.M))
        values, vectors = linalg.eigh(K, M, subset_by_index=(0, len(loose) + min(count + SPARE, limit) - 1))
        Phi[model.free] = N @ vectors[:, len(loose) : len(loose) + count]
        return Phi, whole_groups(values[len(loose) :], count)
    shift = lower_shift(model, Problem.of(model))
    factor = HeldFactor(factorise(problem.K - shift * problem.M, definite=model.parts is not None), B)
    values, vectors = inverse_lanczos(problem, shift, count + SPARE, factor)
    vectors = problem.elastic(factor.held(vectors[:, np.argsort(values)[:count]]))
    moved = float(np.abs(B @ vectors).max() / (np.abs(B).sum(axis=1).max() * np.abs(vectors).max()))
    if not moved < HELD:
        raise StageError(f"modes: rows move by {moved:.2g} in a fixed-interface mode, allowed: {HELD:g}")
    Phi[model.free] = vectors
    return Phi, whole_groups(np.sort(values), count)
