"""Reductions: each turns an FE model and its contact rows into elastic coordinates.

A new one is a file, or a function beside the one that it varies, and a line here. Bodies may be free or held. A
reduction raises an `InputError`, whose key begins with `modes`, if the settings do not suit the body, and a
`StageError` if its shapes do not pass their own checks.
"""

from collections.abc import Callable

from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.reduction.methods.attachment import attachment
from gudgeon.pipeline.reduction.methods.craig_bampton import craig_bampton
from gudgeon.pipeline.reduction.methods.fixed_reference import fixed_reference
from gudgeon.pipeline.reduction.methods.macneal import macneal, normal_static, rubin, rubin_macneal
from gudgeon.pipeline.reduction.methods.partial_interface import interface, partial_interface
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction
from gudgeon.pipeline.reduction.methods.rigid import rigid
from gudgeon.pipeline.reduction.methods.ritz import ritz
from gudgeon.pipeline.reduction.methods.row_craig_bampton import row_craig_bampton
from gudgeon.pipeline.scenes.modes import ModesSettings

Method = Callable[[FEModel, ContactRows, ModesSettings], Reduction]

REDUCTIONS: dict[str, Method] = {
    "macneal": macneal,
    "normal+static": normal_static,
    "craig-bampton": craig_bampton,
    "row-craig-bampton": row_craig_bampton,
    "fixed-reference": fixed_reference,
    "ritz": ritz,
    "rubin": rubin,
    "rubin-macneal": rubin_macneal,
    "attachment": attachment,
    "interface": interface,
    "partial-interface": partial_interface,
    "rigid": rigid,
}
