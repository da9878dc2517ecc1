"""Reduction recipes: each turns an FE model and its rows into elastic coordinates. A new one is a file and a
line here."""

from collections.abc import Callable

from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.reduction.recipes.attachment import attachment
from gudgeon.pipeline.reduction.recipes.craig_bampton import craig_bampton
from gudgeon.pipeline.reduction.recipes.fixed_reference import fixed_reference
from gudgeon.pipeline.reduction.recipes.interface import interface
from gudgeon.pipeline.reduction.recipes.macneal import macneal
from gudgeon.pipeline.reduction.recipes.normal_static import normal_static
from gudgeon.pipeline.reduction.recipes.partial_interface import partial_interface
from gudgeon.pipeline.reduction.recipes.reduction import ContactRows, Reduction
from gudgeon.pipeline.reduction.recipes.rigid import rigid
from gudgeon.pipeline.reduction.recipes.ritz import ritz
from gudgeon.pipeline.reduction.recipes.rubin import rubin
from gudgeon.pipeline.scenes.modes import ModesSettings

RECIPES: dict[str, Callable[[FEModel, ContactRows, ModesSettings], Reduction]] = {
    "macneal": macneal,
    "normal+static": normal_static,
    "craig-bampton": craig_bampton,
    "fixed-reference": fixed_reference,
    "ritz": ritz,
    "rubin": rubin,
    "attachment": attachment,
    "interface": interface,
    "partial-interface": partial_interface,
    "rigid": rigid,
}
