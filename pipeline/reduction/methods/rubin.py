"""Rubin's basis: free-interface normal modes and the residual attachment modes of every row, their mass kept (Rubin
1975). Beside `macneal` the residual has coordinates of its own; nothing is left for R."""

from dataclasses import replace

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.reduction.methods.craig_bampton import LARGEST_BOUNDARY
from gudgeon.pipeline.reduction.methods.macneal import macneal
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction
from gudgeon.pipeline.scenes.modes import ModesSettings


def rubin(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body, free or held; `static_count` does not matter, every row has its shape.

    Raises:
        InputError: there are more rows than is sensible; its key begins with `modes`.
        StageError: a shape fails its own check.
    """
    return macneal(model, replace(rows, pressures=np.eye(row_count(rows, "rubin"))), settings)


def row_count(rows: ContactRows, reduction: str) -> int:
    """Return how many rows there are to have a shape each.

    Raises:
        InputError: more than is sensible.
    """
    count = rows.B.shape[0]
    if count > LARGEST_BOUNDARY:
        raise InputError(
            f"modes.reduction: '{reduction}' given, it makes a shape of each of the interfaces' {count} rows, at most"
            f" {LARGEST_BOUNDARY}; coarsen the mesh or take smaller interfaces"
        )
    return count
