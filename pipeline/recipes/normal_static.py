"""Normal modes and static correction modes, all dynamic, as Kim et al. do: what they lack is dropped."""

from dataclasses import replace

from pipeline.femodel import FEModel
from pipeline.recipes.macneal import macneal
from pipeline.recipes.reduction import ContactRows, Reduction
from pipeline.settings import ModesSettings


def normal_static(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body, free or held; contact on the result needs springs of its own."""
    return replace(macneal(model, rows, settings), residual_flexibility=None)
