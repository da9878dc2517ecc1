"""Reduction recipes: each turns an FE model and its rows into elastic coordinates. A new one is a file and a
line here."""

from collections.abc import Callable

from pipeline.femodel import FEModel
from pipeline.recipes.attachment import attachment
from pipeline.recipes.craig_bampton import craig_bampton
from pipeline.recipes.fixed_reference import fixed_reference
from pipeline.recipes.interface import interface
from pipeline.recipes.macneal import macneal
from pipeline.recipes.normal_static import normal_static
from pipeline.recipes.partial_interface import partial_interface
from pipeline.recipes.reduction import ContactRows, Reduction
from pipeline.recipes.rigid import rigid
from pipeline.recipes.ritz import ritz
from pipeline.recipes.rubin import rubin
from pipeline.settings import ModesSettings

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
