"""Grids of poses with other errors, for the terms of an error budget that fields have: panels, and the grid."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from gudgeon.modaldb.keys import content_key
from gudgeon.modaldb.records.field import PoseGridRecord
from gudgeon.pipeline.stages.job import Job, grids_of
from gudgeon.pipeline.stages.keys.products import Product
from gudgeon.pipeline.stages.make import keep
from gudgeon.solver.forces.fields.pose_field import cell_errors

LEAST_POINTS = 7
"""Points of an axis from which every second one makes a grid of four or more."""
FALL = 7.0
"""Difference of a run with every second point over the error of all of them: forces of cubic splines are of order 3."""

Change = Callable[[PoseGridRecord], PoseGridRecord | None]


def by_panels(grid: PoseGridRecord) -> PoseGridRecord:
    """Return a grid whose capacitances are greater by their estimated error by panels.

    Galerkin's diagonal entries rise as panels are divided, and all change alike: one run tells what they lack.
    """
    return replace(grid, capacitance=grid.capacitance + np.sign(grid.capacitance) * grid.panel_error)


def by_points(grid: PoseGridRecord) -> PoseGridRecord | None:
    """Return a grid of every second point of its axes of seven or more; None where there is none."""
    chosen = {}
    for name, nodes in grid.axes.items():
        count = len(nodes)
        chosen[name] = np.unique([*range(0, count, 2), count - 1]) if count >= LEAST_POINTS else np.arange(count)
    if all(len(chosen[name]) == len(nodes) for name, nodes in grid.axes.items()):
        return None
    shape = tuple(map(len, grid.axes.values()))
    selection = np.ix_(*chosen.values())
    k = grid.capacitance.shape[1:]
    C, error = (values.reshape(*shape, *k)[selection] for values in (grid.capacitance, grid.panel_error))
    axes = {name: np.asarray(nodes)[chosen[name]] for name, nodes in grid.axes.items()}
    return replace(
        grid, axes=axes, capacitance=C.reshape(-1, *k), panel_error=error.reshape(-1, *k),
        cell_errors=cell_errors(list(axes.values()), C).ravel(),
    )  # fmt: skip


def changed_grids(job: Job, change: Change) -> dict[str, Any]:
    """Return the changes of a scene whose grids are changed, which the database then has; empty where none is."""
    records: dict[str, Any] = {}
    for name, key in grids_of(job.scene).items():
        if (changed := change(job.store.get(key, "posegrid"))) is None:
            continue
        inputs = {"grid": key, "change": change.__name__}
        copied = Product("posegrid", job.name, "posegrid", content_key(inputs), inputs)
        if not job.store.has(copied.key):
            keep(job.store, copied, changed)
        records[name] = {"record": copied.key}
    return {"force": records} if records else {}
