"""Load-dependent Ritz vectors as a reduction: K X₁ = Bᵀ, K Xᵢ₊₁ = M Xᵢ, see `RitzVectors`.

One factorisation serves all blocks and R. If the rows are more than half of the wanted vectors, the first block
are their most flexible load patterns, the leading eigenvectors of B G Bᵀ with each row scaled by the root of its
flexibility.

Vectors that originate from round-off are not excited by the loads: a vector is kept only if its share of a row's
flexibility, (bφ)²/ω² over the sum of all, is above `PARTICIPATION`.
"""

from dataclasses import replace

import numpy as np
from scipy import linalg

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.modes.normal import NormalModes
from gudgeon.pipeline.modes.static import RANK_TOLERANCE, residual_shapes
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction, completed, lowest, ritz_modes
from gudgeon.pipeline.reduction.methods.ritz_vectors import RitzVectors
from gudgeon.pipeline.scenes.modes import ModesSettings

PARTICIPATION = 1e-8
"""Share of a row's flexibility below which a vector is round-off: under an axial impact on a rod, axial vectors have
more than 1e-6, bending and torsion less than 1e-10."""


def ritz(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body to the Ritz vectors that loads on its interfaces excite."""
    vector_count = settings.ritz_count or 2 * settings.normal_count
    source = RitzVectors(model)
    loads = _load_patterns(model, rows, source.flexibility, max(vector_count // 2, 1))
    vectors, dropped = source.krylov(rows.B.T @ loads, vector_count)
    modes = ritz_modes(model, vectors)
    excited = _excited(rows, modes)
    if len(excited) < settings.normal_count:
        raise InputError(
            f"modes.normal_count: {settings.normal_count} given, loads on the interfaces excite {len(excited)} of the"
            f" {vector_count} vectors; increase modes.ritz_count or reduce modes.normal_count"
        )
    modes = replace(modes, angular_frequencies=modes.angular_frequencies[excited], Phi=modes.Phi[:, excited])
    quality = modes.quality | {
        "ritz_loads": loads.shape[1],
        "ritz_vectors": vectors.shape[1],
        "ritz_excited": len(excited),
        "ritz_dropped": modes.quality["ritz_dropped"] + dropped,
    }
    lowest_modes = lowest(replace(modes, quality=quality), settings.normal_count)
    reduction = completed(model, rows, lowest_modes, source.flexibility)
    source.free()
    return reduction


def _excited(rows: ContactRows, modes: NormalModes) -> np.ndarray:
    """Return the numbers of the modes that loads on the rows excite."""
    compliances = (rows.B @ modes.Phi) ** 2 / modes.angular_frequencies**2
    totals = compliances.sum(axis=1, keepdims=True)
    return np.flatnonzero((compliances / np.where(totals > 0, totals, 1.0)).max(axis=0) > PARTICIPATION)


def _load_patterns(model: FEModel, rows: ContactRows, flexibility: Flexibility, limit: int) -> np.ndarray:
    """Return independent load patterns over the rows, the most flexible first, (c, k), k at most `limit`."""
    if not rows.B.shape[0]:
        raise InputError("modes.reduction: 'ritz' given, it needs at least one interface to load the component")
    nothing = NormalModes(np.empty(0), np.empty((rows.B.shape[1], 0)), {})
    residual = residual_shapes(model, rows.B, nothing, np.empty((rows.B.shape[0], 0)), flexibility)
    strength, patterns = linalg.eigh(residual.flexibility / np.outer(residual.scale, residual.scale))
    order = np.argsort(-strength)[:limit]
    order = order[strength[order] > RANK_TOLERANCE * strength[-1]]
    return patterns[:, order] / residual.scale[:, None]
