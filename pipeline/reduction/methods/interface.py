"""Characteristic interface modes: eigenmodes of the condensed boundary in place of its dofs (Castanier, Tan & Pierre
2001). `partial_interface` with no dof kept."""

from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.reduction.methods.partial_interface import partial_interface
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction
from gudgeon.pipeline.scenes.modes import ModesSettings


def interface(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body to interface modes and fixed-interface modes; `kept` has no effect."""
    return partial_interface(model, rows, settings.model_copy(update={"kept": ()}))
