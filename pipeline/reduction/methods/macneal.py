"""MacNeal's basis: normal modes, static correction shapes on request, and the residual flexibility of the rest without
mass (MacNeal 1971; massless contact boundary: Monjaraz-Tec, Gross & Krack 2022).

Three variants: without residual flexibility, as Kim et al., with Rubin's shapes of loads and ties, whose static answer
would be lost; Rubin's basis (1975), with the residual attachment modes of every row and their mass, so that the
residual displacement has coordinates of its own and R is round-off; and both at once, with Rubin's shapes of loads and
ties alone, for bodies that joints hold and that press on others by R.
"""

from dataclasses import replace

import numpy as np

from gudgeon.pipeline.errors import InputError
from gudgeon.pipeline.fem.model import FEModel
from gudgeon.pipeline.modes.normal import normal_modes, shared_flexibility
from gudgeon.pipeline.reduction.methods.craig_bampton import LARGEST_BOUNDARY
from gudgeon.pipeline.reduction.methods.reduction import ContactRows, Reduction, completed
from gudgeon.pipeline.scenes.modes import ModesSettings


def macneal(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body to its lowest normal modes and static correction."""
    flexibility = shared_flexibility(model, rows.B, settings.normal_count)
    reduction = completed(model, rows, normal_modes(model, settings.normal_count, flexibility), flexibility)
    if flexibility is not None:
        flexibility.free()
    return reduction


def normal_static(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body as `rubin_macneal`, without R: what loads and ties do at rest is in the shapes; contact then needs
    a penalty stiffness."""
    return replace(rubin_macneal(model, rows, settings), residual_flexibility=None)


def rubin(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body to normal modes and one shape for every row; `static_count` has no effect."""
    return macneal(model, replace(rows, pressures=np.eye(row_count(rows, "rubin"))), settings)


def rubin_macneal(model: FEModel, rows: ContactRows, settings: ModesSettings) -> Reduction:
    """Reduce a body to normal modes and one shape for every row of loads and ties, with R of the others."""
    loads = np.zeros(rows.B.shape[0], bool) if rows.loads is None else rows.loads
    pressures = np.column_stack([rows.pressures, np.eye(len(loads))[:, loads]])
    return macneal(model, replace(rows, pressures=pressures), settings)


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
