"""Attachment modes with inertia relief, G Bᵀ, as the only coordinates: static displacements under unit loads on each
row, with their mass."""

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.flexibility import Flexibility
from gudgeon.pipeline.modes.static import BLOCK
from gudgeon.pipeline.reduction.methods.macneal import row_count
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction, completed, lowest, ritz_modes
from gudgeon.pipeline.scenes.modes import ModesSettings


def attachment(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body to Ritz vectors of its attachment modes."""
    count, flexibility = row_count(rows, "attachment"), Flexibility(model, rows.B)
    shapes = np.empty((rows.B.shape[1], count))
    for start in range(0, count, BLOCK):
        columns = slice(start, start + BLOCK)
        shapes[:, columns] = flexibility.solve(rows.B[columns].T.toarray())
    modes = ritz_modes(model, shapes) if count else None
    mode_count = len(modes.angular_frequencies) if modes else 0
    count_kept = settings.kept_of(mode_count)
    if modes is None or mode_count < count_kept:
        raise InputError(
            f"modes.normal_count: {settings.normal_count} given, the {count} rows of the interfaces have {mode_count}"
            " independent attachment modes; request fewer, or 0 for all"
        )
    reduction = completed(model, rows, lowest(modes, count_kept), flexibility)
    flexibility.free()
    return reduction
