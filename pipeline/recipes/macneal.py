"""MacNeal's basis: normal modes, static correction shapes if asked, and the residual flexibility of the rest without
mass (MacNeal 1971; massless contact boundary: Monjaraz-Tec, Gross & Krack 2022)."""

import numpy as np

from pipeline.errors import StageError
from pipeline.model import FEModel
from pipeline.modes.normal import normal_modes
from pipeline.modes.static import residual_shapes, static_shapes
from pipeline.recipes.reduction import ContactRows, Reduction
from pipeline.settings import ModesSettings

ORTHOGONALITY_TOLERANCE = 1e-8
"""Of static shapes against normal modes: they come through one more factorisation."""
DEFINITENESS_TOLERANCE = 1e-9
"""Negative eigenvalues that round-off may leave in R, each row scaled by the root of its whole flexibility."""


def macneal(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body, free or held.

    Raises:
        StageError: a shape fails its own check.
    """
    normal = normal_modes(model, settings.normal_count)
    residual = residual_shapes(model, rows.B, normal, rows.pressures)
    static = static_shapes(model, rows.B, residual, rows.pressures)
    Phi = np.column_stack([normal.Phi, static.Phi])
    orthogonality = float(np.abs(Phi.T @ (model.M @ Phi) - np.eye(Phi.shape[1])).max()) if Phi.size else 0.0
    if orthogonality > ORTHOGONALITY_TOLERANCE:
        raise StageError(f"modes: static shapes are orthogonal to {orthogonality:.2g} only")
    R = static.residual_flexibility
    lowest = float(np.linalg.eigvalsh(R / np.outer(residual.scale, residual.scale))[0]) if len(R) else 0.0
    if lowest < -DEFINITENESS_TOLERANCE:
        raise StageError(f"modes: residual flexibility has a scaled eigenvalue {lowest:.2g}, it must not be negative")
    quality = normal.quality | {
        "basis_orthogonality": orthogonality,
        "static_dropped": static.dropped,
        "residual_lowest_eigenvalue": lowest,
    }
    frequencies = np.concatenate([normal.angular_frequencies, static.angular_frequencies])
    return Reduction(frequencies, Phi, len(normal.angular_frequencies), R, quality)
