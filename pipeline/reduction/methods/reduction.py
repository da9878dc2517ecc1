"""What every reduction is given and gives back, and what all elastic ones do: Ritz shapes of a basis, and what is left.

For any K-diagonal, M-orthonormal shapes Φ that are M-orthogonal to the rigid motions, Φ Λ⁻¹ Φᵀ K is the K-orthogonal
projection onto their span. What they lack in statics is therefore R = B (G − Φ Λ⁻¹ Φᵀ) Bᵀ, positive semidefinite,
whether they are normal modes or not.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy import linalg, sparse

from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.normal import NormalModes
from gudgeon.pipeline.modes.static import RANK_TOLERANCE, Flexibility, Residual, residual_shapes, static_shapes

ORTHOGONALITY_TOLERANCE = 1e-10
"""Of all shapes in M: the reductions reach 1e-12 on solids, plane parts, bars and beams."""
DEFINITENESS_TOLERANCE = 1e-9
"""Negative eigenvalues that round-off may leave in R, each row scaled by the root of its whole flexibility."""

ROUND_OFFS = 10.0
"""How often the model's round-off floor may come into R."""


@dataclass(frozen=True)
class ContactRows:
    """All contact points, traction functions and loads of a component, interface after interface."""

    B: sparse.csr_matrix
    """Displacement conjugate to each force: along the outward normal at a point, and so on, (c, dofs)."""
    pressures: np.ndarray
    """Contact forces [N] of the pressure fields that ask for a static shape, (c, k); none on loads."""
    spans: Mapping[str, Sequence[int]] = field(default_factory=dict)
    """First and last + 1 row of each interface, by its name."""


@dataclass(frozen=True)
class Reduction:
    """Elastic coordinates, diagonal in mass and stiffness."""

    angular_frequencies: np.ndarray
    """[rad/s], (m,)."""
    Phi: np.ndarray
    """(dofs, m)"""
    normal_count: int
    residual_flexibility: np.ndarray | None
    """[m/N and the like], (c, c)"""
    quality: dict[str, Any]


def ritz_modes(model: FEModel, basis: np.ndarray) -> NormalModes:
    """Return the elastic Ritz vectors of a basis: (K − λ M) projected on what it holds beside the rigid motions.

    Directions of less than `RANK_TOLERANCE` of the largest are dropped and counted in `ritz_dropped`. The basis is
    made K-orthonormal first and the mass diagonalised, so that the lowest frequencies are the most exact; a second
    pass brings orthogonality to round-off.

    Args:
        basis: (dofs, k), zero where the body is held.
    """
    rigid = model.rigid_modes
    M_rigid = model.M @ rigid
    shapes, values = basis, np.empty(0)
    for _ in range(2):
        shapes = shapes - rigid @ (M_rigid.T @ shapes)
        stiffness = shapes.T @ (model.K @ shapes)
        scale = 1 / np.sqrt(np.maximum(stiffness.diagonal(), np.finfo(float).tiny))
        strength, directions = linalg.eigh(stiffness * scale * scale[:, None])
        kept = strength > RANK_TOLERANCE * strength[-1]
        shapes = shapes @ ((directions[:, kept] / np.sqrt(strength[kept])) * scale[:, None])
        inverse, Z = linalg.eigh(shapes.T @ (model.M @ shapes))
        values, Z = 1 / inverse[::-1], Z[:, ::-1]
        shapes = shapes @ (Z * np.sqrt(values))
    # Of vectors whose frequencies are orders apart the passes leave 1e-10; a Newton step squares that.
    shapes = shapes @ (1.5 * np.eye(len(values)) - 0.5 * (shapes.T @ (model.M @ shapes)))
    dropped = basis.shape[1] - shapes.shape[1]
    return NormalModes(np.sqrt(values), shapes, {"ritz_dropped": dropped})


def lowest(modes: NormalModes, count: int) -> NormalModes:
    """Return the first `count` modes."""
    return NormalModes(modes.angular_frequencies[:count], modes.Phi[:, :count], modes.quality)


def completed(
    model: FEModel, rows: ContactRows, kept: NormalModes, flexibility: Flexibility | None = None
) -> Reduction:
    """Add the static correction shapes that are asked for, and R of all that is left.

    Static shapes beside Ritz vectors that are no normal modes couple with them in mass: all are made diagonal together.

    Args:
        kept: Normal modes or Ritz vectors.
        flexibility: A factor of the model's stiffness, where there is one already.

    Raises:
        StageError: a shape fails its own check.
    """
    residual = residual_shapes(model, rows.B, kept, rows.pressures, flexibility)
    lacking = _lacking(rows, kept, residual)
    residual = replace(residual, fields=residual.fields[:, lacking])
    static = static_shapes(model, rows.B, residual, rows.pressures[:, lacking])
    Phi = np.column_stack([kept.Phi, static.Phi])
    frequencies = np.concatenate([kept.angular_frequencies, static.angular_frequencies])
    if "ritz_dropped" in kept.quality and static.Phi.shape[1]:
        together = ritz_modes(model, Phi)
        Phi, frequencies = together.Phi, together.angular_frequencies
    orthogonality = float(np.abs(Phi.T @ (model.M @ Phi) - np.eye(Phi.shape[1])).max()) if Phi.size else 0.0
    if orthogonality > ORTHOGONALITY_TOLERANCE:
        raise StageError(f"modes: static shapes are orthogonal to {orthogonality:.2g} only")
    R = static.residual_flexibility
    R, least = _definite(R, residual.scale, _noise(model, frequencies))
    quality = kept.quality | {
        "basis_orthogonality": orthogonality,
        "static_dropped": static.dropped + rows.pressures.shape[1] - len(lacking),
        "residual_lowest_eigenvalue": least,
    }
    return Reduction(frequencies, Phi, len(kept.angular_frequencies), R, quality)


def _lacking(rows: ContactRows, kept: NormalModes, residual: Residual) -> np.ndarray:
    """Return the pressure fields whose static answer the kept shapes lack by more than round-off, (k,)."""
    own = (rows.pressures.T @ (rows.B @ kept.Phi)) / kept.angular_frequencies
    rest = np.einsum("ck,cd,dk->k", rows.pressures, residual.flexibility, rows.pressures, optimize=True)
    return np.flatnonzero(rest > DEFINITENESS_TOLERANCE * (rest + (own**2).sum(axis=1)))


def _noise(model: FEModel, frequencies: np.ndarray) -> float:
    """Return what round-off may make of R's scaled eigenvalues: fine meshes of beams are badly conditioned."""
    if not len(frequencies):
        return DEFINITENESS_TOLERANCE
    free = model.free
    top = float((model.K.diagonal()[free] / model.M.diagonal()[free]).max())
    return max(DEFINITENESS_TOLERANCE, ROUND_OFFS * np.finfo(float).eps * top / float(frequencies.min()) ** 2)


def _definite(R: np.ndarray, scale: np.ndarray, noise: float) -> tuple[np.ndarray, float]:
    """Return R without the negative eigenvalues that round-off leaves, and the least of those, scaled.

    Raises:
        StageError: one is larger than that.
    """
    felt = np.flatnonzero(R.any(axis=1))
    if not len(felt):
        return R, 0.0
    block, size = np.ix_(felt, felt), scale[felt]
    values, vectors = np.linalg.eigh(R[block] / np.outer(size, size))
    least = float(values[0])
    if least < -noise:
        raise StageError(f"modes: residual flexibility has a scaled eigenvalue {least:.2g}, it must not be negative")
    if least < 0:
        R = R.copy()
        R[block] -= (vectors * np.minimum(values, 0.0)) @ vectors.T * np.outer(size, size)
    return R, least


def reference_reaction(model: FEModel, reduction: Reduction, nodes: np.ndarray) -> float:
    """Return the largest share of a shape's forces that is left unbalanced at a reference surface.

    max over shapes of ‖r‖ / ‖K φ‖ with r = K φ − ω² M φ on the reference's free dofs; each dof is scaled by the root
    of its own stiffness, so that forces and moments compare. Zero for normal modes, whose boundary there is natural.

    Args:
        nodes: Of the reference surface, (k,).
    """
    d = len(model.directions)
    at = np.zeros(len(model.held), bool)
    at[(d * nodes[:, None] + np.arange(d)).ravel()] = True
    weight = 1 / np.sqrt(model.K.diagonal())
    forces = (model.K @ reduction.Phi) * weight[:, None]
    rest = forces - (model.M @ reduction.Phi) * reduction.angular_frequencies**2 * weight[:, None]
    free = ~model.held
    return float((np.linalg.norm(rest[at & free], axis=0) / np.linalg.norm(forces[free], axis=0)).max())
