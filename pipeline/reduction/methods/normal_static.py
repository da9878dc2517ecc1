"""Normal modes and static correction modes, all dynamic, as Kim et al. do: what they lack is dropped."""

from dataclasses import replace

from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.reduction.methods.macneal import macneal
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction
from gudgeon.pipeline.scenes.modes import ModesSettings


def normal_static(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body, free or held; contact on the result needs springs of its own."""
    return replace(macneal(model, rows, settings), residual_flexibility=None)
