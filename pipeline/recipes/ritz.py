"""Load-dependent Ritz vectors: K X₁ = Bᵀ, K Xᵢ₊₁ = M Xᵢ (Wilson, Yuan & Dickens 1982; Wu & Mani 2002).

One factorisation serves all blocks and R. On a body with rigid motions K⁻¹ is G, with inertia relief. Where the rows
are more than half of the vectors wanted, the first block takes their most flexible load patterns, the leading
eigenvectors of B G Bᵀ with each row scaled by the root of its own flexibility.

Vectors that grow out of round-off take no part in what the loads do: only those are kept whose share
of a row's flexibility, (bφ)²/ω² over the sum of all, stands out.
"""

from dataclasses import replace

import numpy as np
from scipy import linalg

from pipeline.errors import InputError
from pipeline.femodel import FEModel
from pipeline.modes.normal import NormalModes
from pipeline.modes.static import RANK_TOLERANCE, Flexibility, residual_shapes
from pipeline.recipes.reduction import ContactRows, Reduction, completed, lowest, ritz_modes
from pipeline.settings import ModesSettings

PARTICIPATION = 1e-8
"""Share of a row's flexibility below which a vector is round-off: those of an axial blow on a rod lie above 1e-6, what
grew along bending and torsion below 1e-10."""


def ritz(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body, free or held, by vectors that its loads excite.

    Raises:
        InputError: there is no load to start from, or the loads excite fewer vectors; its key begins with `modes`.
        StageError: a shape fails its own check.
    """
    wanted = settings.ritz_count or 2 * settings.normal_count
    flexibility = Flexibility(model)
    loads = _load_patterns(model, rows, flexibility, max(wanted // 2, 1))
    vectors, dropped = _krylov(model, flexibility, rows.B.T @ loads, wanted)
    modes = ritz_modes(model, vectors)
    excited = _excited(rows, modes)
    if len(excited) < settings.normal_count:
        raise InputError(
            f"modes.normal_count: {settings.normal_count} given, the interfaces' loads excite {len(excited)} of the"
            f" {wanted} vectors; raise modes.ritz_count or ask for fewer"
        )
    modes = replace(modes, angular_frequencies=modes.angular_frequencies[excited], Phi=modes.Phi[:, excited])
    quality = modes.quality | {
        "ritz_loads": loads.shape[1],
        "ritz_vectors": vectors.shape[1],
        "ritz_excited": len(excited),
        "ritz_dropped": modes.quality["ritz_dropped"] + dropped,
    }
    kept = lowest(replace(modes, quality=quality), settings.normal_count)
    reduction = completed(model, rows, kept, flexibility)
    flexibility.free()
    return reduction


def _excited(rows: ContactRows, modes: NormalModes) -> np.ndarray:
    """Return the numbers of the modes that take part in what the rows' loads do."""
    share = (rows.B @ modes.Phi) ** 2 / modes.angular_frequencies**2
    whole = share.sum(axis=1, keepdims=True)
    return np.flatnonzero((share / np.where(whole > 0, whole, 1.0)).max(axis=0) > PARTICIPATION)


def _load_patterns(model: FEModel, rows: ContactRows, flexibility: Flexibility, most: int) -> np.ndarray:
    """Return independent load patterns over the rows, the most flexible first, (c, k), k at most `most`."""
    if not rows.B.shape[0]:
        raise InputError("modes.recipe: 'ritz' given, it needs at least one interface to load the component")
    nothing = NormalModes(np.empty(0), np.empty((rows.B.shape[1], 0)), {})
    whole = residual_shapes(model, rows.B, nothing, np.empty((rows.B.shape[0], 0)), flexibility)
    strength, patterns = linalg.eigh(whole.flexibility / np.outer(whole.scale, whole.scale))
    order = np.argsort(-strength)[:most]
    order = order[strength[order] > RANK_TOLERANCE * strength[-1]]
    return patterns[:, order] / whole.scale[:, None]


def _krylov(model: FEModel, flexibility: Flexibility, loads: np.ndarray, wanted: int) -> tuple[np.ndarray, int]:
    """Return M-orthonormal vectors, elastic ones only, and how many dependent ones were dropped."""
    basis, dropped = np.empty((loads.shape[0], 0)), 0
    while basis.shape[1] < wanted and loads.shape[1]:
        block = flexibility.solve(loads)
        block = block / np.sqrt(np.einsum("dk,dk->k", block, model.M @ block))
        for _ in range(2):
            block = block - basis @ (basis.T @ (model.M @ block))
        strength, directions = linalg.eigh(block.T @ (model.M @ block))
        kept = np.flatnonzero(strength > RANK_TOLERANCE)[::-1]
        dropped += len(strength) - len(kept)
        kept = kept[: wanted - basis.shape[1]]
        block = block @ (directions[:, kept] / np.sqrt(strength[kept]))
        # What the rank test kept of a nearly dependent block is orthogonal to few digits: once more.
        block = block - basis @ (basis.T @ (model.M @ block))
        basis = np.column_stack([basis, block])
        loads = model.M @ block
    return basis, dropped
