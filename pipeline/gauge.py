"""Stress read at a station of a beam: σ = E z θ′ at a fibre, which is −E z w″ where there is no shear."""

import numpy as np
from scipy import sparse

from modaldb.schema import GaugeModes, MeshRecord
from pipeline.elements.beam import turn_gradient
from pipeline.femodel import FEModel
from pipeline.geometry.beam import SIDES, Beam
from pipeline.material import Material
from pipeline.modes.normal import NormalModes
from pipeline.modes.static import residual_shapes
from pipeline.recipes.reduction import Reduction
from pipeline.settings import Gauge


def gauge_row(mesh: MeshRecord, beam: Beam, material: Material, gauge: Gauge) -> np.ndarray:
    """Return the stress of a gauge per unit of each dof, (1, dofs)."""
    node = int(mesh.surfaces[gauge.station].facets[0, 0])
    z = SIDES[gauge.fibre] * beam.section.height / 2
    return material.E * z * turn_gradient(mesh, node)[None]


def gauge_modes(
    gauges: dict[str, np.ndarray], model: FEModel, B: sparse.csr_matrix, reduction: Reduction
) -> dict[str, GaugeModes]:
    """Return what gauges read of a reduced body, S Φ and S (G − Φ Λ⁻¹ Φᵀ) Bᵀ.

    The residual is zero where the recipe makes none: what the coordinates lack is dropped there.

    Args:
        gauges: Rows S of each over the dofs, (k, dofs).
        B: Displacement conjugate to each force, (C, dofs).
    """
    if not gauges:
        return {}
    rest = np.zeros((B.shape[1], B.shape[0]))
    if reduction.residual_flexibility is not None:
        kept = NormalModes(reduction.angular_frequencies, reduction.Phi, {})
        rest = residual_shapes(model, B, kept, np.eye(B.shape[0])).fields
    return {name: GaugeModes(S @ reduction.Phi, S @ rest, "Pa") for name, S in gauges.items()}
