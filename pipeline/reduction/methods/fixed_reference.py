"""Rigid attachment: shapes of the body with a reference surface clamped (Escalona, Hussien & Shabana 1998).

Shapes and rigid motions are made diagonal together, so that the rigid motions stay exact and the elastic coordinates
are those of a free body: a Ritz basis with an incorrect boundary condition at the reference.
"""

from dataclasses import replace

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.fem.supports import remaining_twists, surface_nodes
from gudgeon.pipeline.modes.normal import largest_count, normal_modes
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction, completed, ritz_modes
from gudgeon.pipeline.scenes.modes import ModesSettings


def fixed_reference(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body to the lowest modes of the body clamped at `settings.reference`."""
    key = "modes.reference"
    nodes = surface_nodes(model.mesh, settings.reference or "", key)
    constrained = model.held.copy()
    model.by_node(constrained)[nodes] = True
    free = len(remaining_twists(model, constrained, f"{key}: the nodes of {settings.reference}"))
    if free:
        raise InputError(f"{key}: '{settings.reference}' given, clamping it leaves {free} rigid motions free, not 0")
    clamped = replace(model, held=constrained, rigid_twists=np.empty((0, 6)))
    if settings.normal_count > (limit := largest_count(clamped)):
        raise InputError(f"modes.normal_count: {settings.normal_count} given, the clamped mesh has {limit} at most")
    shapes = normal_modes(clamped, settings.normal_count)
    modes = ritz_modes(model, shapes.Phi)
    quality = {f"clamped_{name}": value for name, value in shapes.quality.items()}
    return completed(model, rows, replace(modes, quality=modes.quality | quality))
