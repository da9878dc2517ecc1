"""Rubin's basis: free-interface normal modes and the residual attachment modes of every row, with their mass (Rubin
1975). Compared with `macneal` the residual displacement has coordinates of its own; R is round-off."""

from dataclasses import replace

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.reduction.methods.craig_bampton import LARGEST_BOUNDARY
from gudgeon.pipeline.reduction.methods.macneal import macneal
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction
from gudgeon.pipeline.scenes.modes import ModesSettings


def rubin(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body to normal modes and one shape for every row; `static_count` has no effect."""
    return macneal(model, replace(rows, pressures=np.eye(row_count(rows, "rubin"))), settings)


def row_count(rows: ContactRows, reduction: str) -> int:
    """Return the number of rows for a reduction that makes one shape for each.

    Raises:
        InputError: it exceeds `LARGEST_BOUNDARY`.
    """
    count = rows.B.shape[0]
    if count > LARGEST_BOUNDARY:
        raise InputError(
            f"modes.reduction: '{reduction}' given, it makes one shape for each of the {count} rows of the interfaces,"
            f" allowed: {LARGEST_BOUNDARY}; coarsen the mesh or use smaller interfaces"
        )
    return count
