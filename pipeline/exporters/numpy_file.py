"""A reduced body as one .npz of NumPy, described in docs/export.md."""

from pathlib import Path

import numpy as np

from gudgeon.pipeline.exporters.reduced import ReducedBody
from gudgeon.pipeline.files import whole_file


def write(body: ReducedBody, folder: Path) -> list[Path]:
    """Write `NAME.npz` and return it."""
    path = folder / f"{body.name}.npz"
    count = len(body.rows)
    arrays = {
        "nodes": body.nodes, "labels": body.labels, "cells": body.mesh.cells, "cell_type": body.mesh.cell_type,
        "mass": body.morph.mass, "centre": body.morph.centre, "inertia": body.morph.inertia,
        "rigid_twists": body.morph.rigid_twists, "angular_frequencies": body.modal.angular_frequencies,
        "M": np.eye(len(body.stiffness)), "K": np.diag(body.stiffness), "shapes": body.shapes, "B": body.B,
        "R": np.zeros((0, 0)) if body.R is None else body.R,
        "row_names": np.array([row.name for row in body.rows], dtype=str),
        "row_units": np.array([row.unit for row in body.rows], dtype=str),
        "row_nodes": np.array([row.node for row in body.rows], int),
        "row_places": np.array([row.place for row in body.rows]).reshape(count, 3),
        "row_directions": np.array([row.direction for row in body.rows]).reshape(count, 3),
    }  # fmt: skip
    with whole_file(path) as scratch, open(scratch, "wb") as file:
        np.savez(file, allow_pickle=False, **arrays)
    return [path]
