"""Bases between which a run changes as a force passes over a body (Wu & Mani).

Basis k has the normal modes and Ritz vectors of the force at places of part k of the traction space, ends included:
what neighbours answer to a force at their border is the same. One factorisation serves all of them.
"""

from dataclasses import dataclass, replace

import numpy as np

from gudgeon.modaldb.records.modes import SplineGrid, SwapModes
from gudgeon.modaldb.records.traction import spread
from gudgeon.pipeline.errors import InputError, StageError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.normal import largest_count
from gudgeon.pipeline.modes.problem import ORTHOGONALITY_TOLERANCE
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction, ritz_modes
from gudgeon.pipeline.reduction.methods.ritz_vectors import RitzVectors
from gudgeon.pipeline.scenes.modes import Swap


@dataclass(frozen=True)
class Crossed:
    """The traction space that a force crosses."""

    interface: str
    space: SplineGrid
    across: float
    """Coordinate of the force [m]."""

    def borders(self, bases: int) -> np.ndarray:
        """Return the coordinates along of the ends of equal parts [m], (bases + 1,)."""
        start, size = self.space.start[1], self.space.spacing[1] * (self.space.counts[1] - 3)
        return start + size * np.arange(bases + 1) / bases


def swapped(
    model: FEModel, rows: ContactRows, reduction: Reduction, swap: Swap, crossed: Crossed
) -> tuple[Reduction, SwapModes]:
    """Return a reduction with the vectors of all bases behind its normal modes, and which basis has which.

    Shapes of `reduction` that are no normal modes become part of every basis.

    Raises:
        InputError: the force does not cross the space, or has too few independent vectors there.
        StageError: a basis is not orthonormal.
    """
    if reduction.Phi.shape[1] + swap.vectors > (limit := largest_count(model)):
        raise InputError(
            f"modes.swap.vectors: {swap.vectors} given in addition to {reduction.Phi.shape[1]} other shapes,"
            f" its mesh has {limit} in all; use fewer"
        )
    source, ends = RitzVectors(model), crossed.borders(swap.bases)
    frequencies, shapes = (
        [reduction.angular_frequencies[: reduction.normal_count]],
        [reduction.Phi[:, : reduction.normal_count]],
    )
    for k in range(swap.bases):
        along = np.linspace(ends[k], ends[k + 1], swap.vectors)
        loads = rows.B[slice(*rows.spans[crossed.interface])].T @ _loads(crossed, along).T
        count = reduction.Phi.shape[1] + swap.vectors
        basis, _ = source.krylov(loads, count, reduction.Phi)
        modes = ritz_modes(model, basis[:, reduction.normal_count :])
        if modes.Phi.shape[1] < (needed := count - reduction.normal_count):
            raise InputError(
                f"modes.swap.vectors: {swap.vectors} given, the force between {ends[k]:.4g} and {ends[k + 1]:.4g}"
                f" m along '{crossed.interface}' has {modes.Phi.shape[1] - needed + swap.vectors} independent ones"
                " in addition to the normal modes; use fewer"
            )
        frequencies.append(modes.angular_frequencies)
        shapes.append(modes.Phi)
    source.free()
    Phi = np.column_stack(shapes)
    basis_ids = np.repeat(np.arange(len(shapes)), [block.shape[1] for block in shapes])
    overlap = Phi.T @ (model.M @ Phi)
    alike = (basis_ids[:, None] == basis_ids) | (basis_ids == 0) | (basis_ids[:, None] == 0)
    error = float(np.abs(overlap - np.eye(len(basis_ids)))[alike].max())
    if error > ORTHOGONALITY_TOLERANCE:
        raise StageError(f"modes: orthogonality of bases {error:.2g}, allowed: {ORTHOGONALITY_TOLERANCE:g}")
    swap_modes = SwapModes(crossed.interface, basis_ids, ends[1:-1].copy(), overlap)
    quality = reduction.quality | {"swap_orthogonality": error}
    return replace(reduction, angular_frequencies=np.concatenate(frequencies), Phi=Phi, quality=quality), swap_modes


def _loads(crossed: Crossed, along: np.ndarray) -> np.ndarray:
    """Return a unit force at places along on all functions of the space, (p, F)."""
    space, positions = crossed.space, np.column_stack([np.full(len(along), crossed.across), along])
    low, high = space.start[0], space.start[0] + space.spacing[0] * (space.counts[0] - 3)
    if not low <= crossed.across <= high:
        raise InputError(
            f"modes.swap: the force is at {crossed.across:g} m across '{crossed.interface}', which reaches from"
            f" {low:.4g} to {high:.4g} m"
        )
    return spread(space, positions, np.ones(len(along)))
