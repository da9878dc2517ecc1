"""Input and result of every reduction, and the steps common to elastic ones: Ritz vectors of a basis, and R.

For any K-diagonal, M-orthonormal shapes Φ that are M-orthogonal to the rigid motions, Φ Λ⁻¹ Φᵀ K is the K-orthogonal
projection onto their span. The static flexibility that they lack is therefore R = B (G − Φ Λ⁻¹ Φᵀ) Bᵀ, positive
semidefinite, whether they are normal modes or not.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.modes import SHAPE_ERRORS
from gudgeon.pipeline.errors import StageError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.bounds import round_off
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.modes.normal import NormalModes
from gudgeon.pipeline.modes.problem import ORTHOGONALITY_TOLERANCE
from gudgeon.pipeline.modes.static import BLOCK, Residual, residual_shapes, ritz_pairs, static_shapes

DEFINITENESS_TOLERANCE = 1e-9
"""Negative eigenvalues that round-off may leave in R, each row scaled by the root of its total flexibility."""
SAGS = 1e-8
"""Share of the work of gravity on its static displacement that modes may lack. m modes of a cantilever lack m⁻⁵/60 of
it and m⁻⁵/20 of the sag of its end, 3e-8 where the work is this share."""
ROUND_OFFS = 10.0
"""Round-off of R over the round-off of the eigenvalues, at most."""


@dataclass(frozen=True)
class ContactRows:
    """All contact points, traction functions and loads of a component, interface after interface, then tangents."""

    B: sparse.csr_matrix
    """Displacement conjugate to each force: along the outward normal at a point, and so on, (c, dofs). The tangential
    rows come last."""
    pressures: np.ndarray
    """Contact forces [N] of the pressure fields that get a static shape, (c, k); zero on loads."""
    spans: Mapping[str, Sequence[int]] = field(default_factory=dict)
    """First and last + 1 row of each interface, by its name."""
    smooth: np.ndarray | None = None
    """Contact forces of the smooth pressures, and unit forces of loads, whose static response is wanted, (c, k)."""
    tangential_spans: Mapping[str, Sequence[int]] = field(default_factory=dict)
    """First and last + 1 tangential row of each interface on which friction acts."""
    weights: np.ndarray | None = None
    """Body forces whose static shape is kept besides, by unit gravity along some directions [N s²/m], (dofs, k)."""
    loads: np.ndarray | None = None
    """Which rows are those of loads and ties, (c,); None: none is."""

    @property
    def wanted(self) -> np.ndarray:
        """Contact forces of the smooth pressures, (c, k); (c, 0) if none are."""
        return np.empty((self.B.shape[0], 0)) if self.smooth is None else self.smooth

    def dofs(self, interface: str | None = None) -> np.ndarray:
        """Return the dofs on which a row of one interface, or any row, is not zero, (k,), ascending."""
        if interface is None:
            return np.unique(self.B.nonzero()[1])
        spans = [spans[interface] for spans in (self.spans, self.tangential_spans) if interface in spans]
        return np.unique(np.concatenate([self.B[slice(*span)].nonzero()[1] for span in spans]))


@dataclass(frozen=True)
class Reduction:
    """Result of a reduction: elastic coordinates, diagonal in mass and stiffness."""

    angular_frequencies: np.ndarray
    """[rad/s], (m,)."""
    Phi: np.ndarray
    """(dofs, m)"""
    normal_count: int
    residual_flexibility: np.ndarray | None
    """R [m/N for forces; other rows accordingly], (c, c); None if the reduction drops it."""
    quality: dict[str, Any]
    responses: np.ndarray | None = None
    """G Bᵀ of the smooth pressures, (dofs, k); None if the reduction has no elastic coordinates."""


def ritz_modes(model: FEModel, basis: np.ndarray) -> NormalModes:
    """Return the elastic Ritz vectors of a basis (dofs, k) that is zero where the body is held.

    Dependent directions are dropped and counted in `ritz_dropped`, see `ritz_pairs`; a second pass reduces the error of
    orthogonality to round-off.
    """
    rigid = model.rigid_modes
    M_rigid = model.M @ rigid
    shapes, values = basis, np.empty(0)
    for _ in range(2):
        values, shapes = ritz_pairs(model, shapes - rigid @ (M_rigid.T @ shapes))
    # If frequencies differ by orders of magnitude the passes leave 1e-10; a Newton step squares that.
    shapes = shapes @ (1.5 * np.eye(len(values)) - 0.5 * (shapes.T @ (model.M @ shapes)))
    dropped = basis.shape[1] - shapes.shape[1]
    return NormalModes(np.sqrt(values), shapes, {"ritz_dropped": dropped})


def lowest(modes: NormalModes, count: int) -> NormalModes:
    """Return the first `count` modes."""
    return NormalModes(modes.angular_frequencies[:count], modes.Phi[:, :count], modes.quality)


def completed(
    model: FEModel, rows: ContactRows, modes: NormalModes, flexibility: Flexibility | None = None
) -> Reduction:
    """Return kept normal modes or Ritz vectors with the static correction shapes of pressures and weights, and R.

    Static shapes are coupled in mass with Ritz vectors that are no normal modes: all are made diagonal together.

    Args:
        flexibility: Of the model, if it is factorised already.

    Raises:
        StageError: shapes are not orthogonal, or R is not symmetric and positive semidefinite.
    """
    residual = residual_shapes(model, rows.B, modes, np.column_stack([rows.pressures, rows.wanted]), flexibility)
    sagging = sagging_shapes(model, rows, modes, _weighed(model, rows, flexibility))
    errors = partial(_shape_errors, model, flexibility)
    return with_static(model, rows, modes, residual, sagging, errors)


def with_static(
    model: FEModel,
    rows: ContactRows,
    modes: NormalModes,
    residual: Residual,
    sagging: np.ndarray,
    shape_errors: Callable[[np.ndarray, np.ndarray], list[float]],
    *,
    error: float = 0.0,
) -> Reduction:
    """Return modes with static correction shapes, and R; see `completed`.

    Args:
        residual: With the fields of pressures and of what else is wanted.
        sagging: Residual displacement under weights that get a shape, (dofs, k).
        shape_errors: Of frequencies (k,) and shapes (dofs, k) that are no proven normal modes.
        error: Negative eigenvalues that R may have besides round-off, each row scaled as for `residual.scale`.
    """
    smooth = rows.wanted
    carried = (rows.B @ modes.Phi) / modes.angular_frequencies**2
    responses = residual.fields[:, rows.pressures.shape[1] :] + modes.Phi @ (carried.T @ smooth)
    lacking = _lacking(rows, modes, residual)
    residual = replace(residual, fields=np.column_stack([residual.fields[:, lacking], sagging]))
    static = static_shapes(model, rows.B, residual)
    Phi = np.column_stack([modes.Phi, static.Phi])
    frequencies = np.concatenate([modes.angular_frequencies, static.angular_frequencies])
    if "ritz_dropped" in modes.quality and static.Phi.shape[1]:
        together = ritz_modes(model, Phi)
        Phi, frequencies = together.Phi, together.angular_frequencies
    proven = 0 if "ritz_dropped" in modes.quality else len(modes.angular_frequencies)
    orthogonality = float(np.abs(Phi.T @ (model.M @ Phi) - np.eye(Phi.shape[1])).max()) if Phi.size else 0.0
    if orthogonality > ORTHOGONALITY_TOLERANCE:
        raise StageError(
            f"modes: orthogonality of static shapes {orthogonality:.2g}, allowed: {ORTHOGONALITY_TOLERANCE:g}"
        )
    R, lowest_eigenvalue = _definite(
        static.residual_flexibility, residual.scale, max(_noise(model, frequencies), error)
    )
    quality = modes.quality | {
        "basis_orthogonality": orthogonality,
        SHAPE_ERRORS: shape_errors(frequencies[proven:], Phi[:, proven:]),
        "static_dropped": rows.pressures.shape[1] + sagging.shape[1] - static.Phi.shape[1],
        "residual_lowest_eigenvalue": lowest_eigenvalue,
    }
    return Reduction(frequencies, Phi, len(modes.angular_frequencies), R, quality, responses)


def _shape_errors(
    model: FEModel, flexibility: Flexibility | None, frequencies: np.ndarray, shapes: np.ndarray
) -> list[float]:
    """Return (ω − ω')/ω of shapes (dofs, k), ω' from Rayleigh's quotient of x = G M φ, one inverse iteration, (k,).

    It is zero for a normal mode, and the error of the frequency where the shape is close to one. K x = M φ, so that
    ω'² = φᵀ M x / xᵀ M x.
    """
    if not shapes.shape[1]:
        return []
    factor, loads = flexibility or Flexibility(model), model.M @ shapes
    iterated = np.column_stack(
        [factor.solve(loads[:, start : start + BLOCK]) for start in range(0, loads.shape[1], BLOCK)]
    )
    if flexibility is None:
        factor.free()
    work, mass = (np.einsum("dk,dk->k", forces, iterated) for forces in (loads, model.M @ iterated))
    return np.clip(1 - np.sqrt(work / mass) / frequencies, 0.0, 1.0).tolist()


def _weighed(model: FEModel, rows: ContactRows, flexibility: Flexibility | None) -> np.ndarray:
    """Return the static displacement under weights, (dofs, k)."""
    if rows.weights is None or not rows.weights.shape[1]:
        return np.empty((len(model.held), 0))
    factor = flexibility or Flexibility(model)
    u_static = factor.solve(rows.weights)
    if flexibility is None:
        factor.free()
    return u_static


def sagging_shapes(model: FEModel, rows: ContactRows, modes: NormalModes, u_static: np.ndarray) -> np.ndarray:
    """Return what kept shapes lack of the static displacement under weights (dofs, k), where it does more work than
    `SAGS`."""
    if rows.weights is None or not u_static.shape[1]:
        return u_static
    if "ritz_dropped" in modes.quality:
        u_residual = u_static - (modes.Phi / modes.angular_frequencies**2) @ (modes.Phi.T @ rows.weights)
    else:
        u_residual = u_static
        for _ in range(2):  # Most of the first one cancels.
            u_residual = u_residual - modes.Phi @ (modes.Phi.T @ (model.M @ u_residual))
    work = np.einsum("dk,dk->k", rows.weights, u_static)
    return u_residual[:, np.einsum("dk,dk->k", rows.weights, u_residual) > SAGS * work]


def _lacking(rows: ContactRows, modes: NormalModes, residual: Residual) -> np.ndarray:
    """Return the numbers of the pressure fields whose residual displacement is above round-off, (k,)."""
    amplitudes = (rows.pressures.T @ (rows.B @ modes.Phi)) / modes.angular_frequencies
    compliance = np.einsum("ck,cd,dk->k", rows.pressures, residual.flexibility, rows.pressures, optimize=True)
    return np.flatnonzero(compliance > DEFINITENESS_TOLERANCE * (compliance + (amplitudes**2).sum(axis=1)))


def _noise(model: FEModel, frequencies: np.ndarray) -> float:
    """Return the round-off of R's scaled eigenvalues: fine meshes of beams are ill-conditioned."""
    if not len(frequencies):
        return DEFINITENESS_TOLERANCE
    return max(DEFINITENESS_TOLERANCE, ROUND_OFFS * round_off(model) / float(frequencies.min()) ** 2)


def _definite(R: np.ndarray, scale: np.ndarray, noise: float) -> tuple[np.ndarray, float]:
    """Return R without negative eigenvalues due to round-off, and its least scaled eigenvalue.

    Raises:
        StageError: an eigenvalue is below −noise.
    """
    rows = np.flatnonzero(R.any(axis=1))
    if not len(rows):
        return R, 0.0
    block, size = np.ix_(rows, rows), scale[rows]
    values, vectors = np.linalg.eigh(R[block] / np.outer(size, size))
    lowest_eigenvalue = float(values[0])
    if lowest_eigenvalue < -noise:
        raise StageError(
            f"modes: least scaled eigenvalue of residual flexibility {lowest_eigenvalue:.2g}, allowed: {-noise:.2g}"
        )
    if lowest_eigenvalue < 0:
        R = R.copy()
        R[block] -= (vectors * np.minimum(values, 0.0)) @ vectors.T * np.outer(size, size)
        R = 0.5 * (R + R.T)
    return R, lowest_eigenvalue


def reference_reaction(model: FEModel, reduction: Reduction, nodes: np.ndarray) -> float:
    """Return the largest share of a shape's forces that is unbalanced at the nodes (k,) of a reference surface.

    max over shapes of ‖r‖ / ‖K φ‖ with r = K φ − ω² M φ on the surface's free dofs; each dof is scaled by the root of
    its stiffness, so that forces and moments are comparable. Zero for normal modes, whose boundary there is natural.
    """
    on_surface = np.zeros(len(model.held), bool)
    model.by_node(on_surface)[nodes] = True
    weight = 1 / np.sqrt(model.K.diagonal())
    forces = (model.K @ reduction.Phi) * weight[:, None]
    R = forces - (model.M @ reduction.Phi) * reduction.angular_frequencies**2 * weight[:, None]
    free = ~model.held
    return float((np.linalg.norm(R[on_surface & free], axis=0) / np.linalg.norm(forces[free], axis=0)).max())
