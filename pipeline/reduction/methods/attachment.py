"""Attachment modes with inertia relief, G Bᵀ, as the only coordinates: static answers to unit loads on each row, made
dynamic."""

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.static import BLOCK, Flexibility
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction, completed, lowest, ritz_modes
from gudgeon.pipeline.reduction.methods.rubin import row_count
from gudgeon.pipeline.scenes.modes import ModesSettings


def attachment(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body, free or held.

    Raises:
        InputError: the rows have fewer independent shapes than are asked for, or too many; its key begins with `modes`.
        StageError: a shape fails its own check.
    """
    count, flexibility = row_count(rows, "attachment"), Flexibility(model)
    shapes = np.empty((rows.B.shape[1], count))
    for start in range(0, count, BLOCK):
        at = slice(start, start + BLOCK)
        shapes[:, at] = flexibility.solve(rows.B[at].T.toarray())
    modes = ritz_modes(model, shapes) if count else None
    found = len(modes.angular_frequencies) if modes else 0
    if modes is None or found < settings.normal_count:
        raise InputError(
            f"modes.normal_count: {settings.normal_count} given, the interfaces' {count} rows have {found} independent"
            " attachment modes; ask for fewer, or 0 for all"
        )
    reduction = completed(model, rows, lowest(modes, settings.normal_count or found), flexibility)
    flexibility.free()
    return reduction
