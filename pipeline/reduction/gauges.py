"""Gauges of a reduced component: stress or strain per unit of each coordinate and contact force."""

from typing import NamedTuple

import numpy as np
from scipy import sparse

from gudgeon.modaldb.records.modes import GaugeModes
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.interfaces.gauges import gauge_nodes
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.modes.static import BLOCK
from gudgeon.pipeline.reduction.couplings import centrifugal_fields, per_square
from gudgeon.pipeline.reduction.methods.reduction import Reduction
from gudgeon.pipeline.scenes.component import Component


class GaugeRows(NamedTuple):
    """Of each gauge over a model's dofs, (k, dofs)."""

    values: dict[str, sparse.csr_matrix]
    """S: its value per unit of each."""
    loads: dict[str, sparse.csr_matrix]
    """Of those of beams: what is to be added per unit of body forces, see `fibres.load_row`."""


def gauge_modes(
    component: Component,
    gauges: GaugeRows,
    model: FEModel,
    B: sparse.csr_matrix,
    reduction: Reduction,
    turning: np.ndarray | None = None,
    *,
    weighs: bool,
) -> dict[str, GaugeModes]:
    """Return the gauge values of each coordinate, and their residual for each contact force, gravity, centrifugal load.

    If the reduction drops R, the residual for forces is zero, and empty for the gauge of a surface. The inertia that
    balances forces on a free body is a body force, as gravity is.

    Args:
        B: Displacement conjugate to each force, (C, dofs).
        reduction: The reduction, in the model's dofs.
        turning: Forces of `couplings.centrifugal_loads` over the model's dofs, (dofs, 6), if its bodies turn.
        weighs: Whether gravity deforms the component.
    """
    if not gauges.values:
        return {}
    S, has = sparse.csr_matrix(sparse.vstack(list(gauges.values.values()))), reduction.residual_flexibility is not None
    rows, residual, weights, centrifugal = S @ reduction.Phi, np.zeros((S.shape[0], B.shape[0])), None, None
    if has:
        residual = _lacking(S, model, B, reduction) + _beside(gauges, model, B, 0.0)
    if weighs:
        unit = model.of_nodes(np.tile(model.directions, (len(model.nodes), 1, 1)))
        F = sparse.csr_matrix((model.M @ unit).T)
        weights = _lacking(S, model, F, reduction) + _beside(gauges, model, F, unit)
    if turning is not None:
        F = sparse.csr_matrix(turning.T)
        field = centrifugal_fields(model) if gauges.loads else 0.0
        centrifugal = per_square(_lacking(S, model, F, reduction) + _beside(gauges, model, F, field))
    modes, start = {}, 0
    for name, lines in gauges.values.items():
        gauge, span = component.gauge[name], slice(start, start + lines.shape[0])
        start = span.stop
        nodes = None if gauge.surface is None else gauge_nodes(model.mesh, gauge, name)
        span_residual = residual[span] if has or nodes is None else np.empty((lines.shape[0], 0))
        loads = (None if values is None else values[span] for values in (weights, centrifugal))
        modes[name] = GaugeModes(rows[span], span_residual, gauge.unit, nodes, *loads)
    return modes


def _beside(gauges: GaugeRows, model: FEModel, F: sparse.csr_matrix, unit: np.ndarray | float) -> np.ndarray | float:
    """Return what body forces within elements add to gauges of beams under forces, (k, C).

    Args:
        F: The forces, (C, dofs).
        unit: Field of the body forces that they are, (dofs, C); 0 of forces on nodes.
    """
    if not gauges.loads:
        return 0.0
    rigid = model.rigid_modes
    return sparse.vstack(list(gauges.loads.values())) @ (unit - rigid @ (F @ rigid).T)


def _lacking(S: sparse.csr_matrix, model: FEModel, B: sparse.csr_matrix, reduction: Reduction) -> np.ndarray:
    """Return what the coordinates lack of S G Bᵀ, (k, C)."""
    return _static(S, model, B) - ((S @ reduction.Phi) / reduction.angular_frequencies**2) @ (B @ reduction.Phi).T


def _static(S: sparse.csr_matrix, model: FEModel, B: sparse.csr_matrix) -> np.ndarray:
    """Return S G Bᵀ, (k, C), solved for the side with fewer rows; G is symmetric."""
    flexibility = Flexibility(model)
    few, many = (S, B) if S.shape[0] <= B.shape[0] else (B, S)
    answers = np.empty((many.shape[0], few.shape[0]))
    for start in range(0, few.shape[0], BLOCK):
        block = slice(start, start + BLOCK)
        answers[:, block] = many @ flexibility.solve(few[block].T.toarray())
    flexibility.free()
    return answers if few is B else answers.T.copy()
