"""Gauges of a reduced component: stress or strain per unit of each coordinate and contact force."""

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.modes import GaugeModes
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.interfaces.gauges import gauge_nodes
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.modes.static import BLOCK
from gudgeon.pipeline.reduction.couplings import per_square
from gudgeon.pipeline.reduction.methods.reduction import Reduction
from gudgeon.pipeline.scenes.component import Component


def gauge_modes(
    component: Component,
    gauges: dict[str, sparse.csr_matrix],
    model: FEModel,
    B: sparse.csr_matrix,
    own: Reduction,
    turning: np.ndarray | None = None,
) -> dict[str, GaugeModes]:
    """Return the gauge values of each coordinate, and their residual for each contact force and centrifugal load.

    If the reduction drops R, the residual is zero, and empty for the gauge of a surface.

    Args:
        gauges: Rows S of each over the model's dofs, (k, dofs).
        B: Displacement conjugate to each force, (C, dofs).
        own: The reduction, in the model's dofs.
        turning: Forces of `couplings.centrifugal_loads` over the model's dofs, (dofs, 6), if its bodies turn.
    """
    if not gauges:
        return {}
    S = sparse.csr_matrix(sparse.vstack(list(gauges.values())))
    rows, residual, has = S @ own.Phi, np.zeros((S.shape[0], B.shape[0])), own.residual_flexibility is not None
    if has:
        residual = _lacking(S, model, B, own)
    centrifugal = None
    if turning is not None:
        centrifugal = per_square(_lacking(S, model, sparse.csr_matrix(turning.T), own))
    found, first = {}, 0
    for name, lines in gauges.items():
        gauge, here = component.gauge[name], slice(first, first + lines.shape[0])
        first = here.stop
        nodes = None if gauge.surface is None else gauge_nodes(model.mesh, gauge, name)
        part = residual[here] if has or nodes is None else np.empty((lines.shape[0], 0))
        found[name] = GaugeModes(
            rows[here], part, gauge.unit, nodes, centrifugal=None if centrifugal is None else centrifugal[here]
        )
    return found


def _lacking(S: sparse.csr_matrix, model: FEModel, B: sparse.csr_matrix, own: Reduction) -> np.ndarray:
    """Return what the coordinates lack of S G Bᵀ, (k, C)."""
    return _static(S, model, B) - ((S @ own.Phi) / own.angular_frequencies**2) @ (B @ own.Phi).T


def _static(S: sparse.csr_matrix, model: FEModel, B: sparse.csr_matrix) -> np.ndarray:
    """Return S G Bᵀ, (k, C), solved for the side with fewer rows; G is symmetric."""
    flexibility = Flexibility(model)
    few, many = (S, B) if S.shape[0] <= B.shape[0] else (B, S)
    found = np.empty((many.shape[0], few.shape[0]))
    for start in range(0, few.shape[0], BLOCK):
        block = slice(start, start + BLOCK)
        found[:, block] = many @ flexibility.solve(few[block].T.toarray())
    flexibility.free()
    return found if few is B else found.T.copy()
