"""Normal modes and static correction modes, all with mass, as Kim et al.: residual flexibility is dropped."""

from dataclasses import replace

from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.reduction.methods.macneal import macneal
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction
from gudgeon.pipeline.scenes.modes import ModesSettings


def normal_static(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body as `macneal`, without R; contact then needs a penalty stiffness."""
    return replace(macneal(model, rows, settings), residual_flexibility=None)
