"""The arrays of bodies that deform, filled up to the most elastic coordinates that a body has."""

from collections.abc import Sequence

import numpy as np

from gudgeon.solver.integrators.turning.arrays import CURL, WIDTH
from gudgeon.solver.integrators.turning.flexible.frame import Frame, moments
from gudgeon.solver.integrators.turning.parts import Point


def flexible_arrays(frames: Sequence[Frame], points: Sequence[Point]) -> dict[str, np.ndarray]:
    """Return the arrays of the bodies' elastic coordinates, filled with zeros up to the most that a body has."""
    counts = [len(f.stiffness) for f in frames]
    n, largest, total = len(counts), max(counts), sum(counts)
    start = WIDTH * n + np.cumsum([0, *counts[:-1]])
    shapes = {
        "second": (n, CURL), "lever": (n, CURL + 3, largest), "pair": (n, largest, CURL + 3, largest),
        "modal_root": (n, largest, largest), "modal_stiffness": (n, largest), "modal_damping": (n, largest),
        "point_rows": (len(points), 6, largest), "point_bend": (len(points), 6, largest, largest),
    }  # fmt: skip
    arrays = {name: np.zeros(shape) for name, shape in shapes.items()}
    for b, (frame, m) in enumerate(zip(frames, counts, strict=True)):
        arrays["second"][b] = moments(frame.second)[:CURL]
        arrays["lever"][b, :, :m] = moments(frame.lever).T
        arrays["pair"][b, :m, :, :m] = moments(frame.pair).transpose(0, 2, 1)
        arrays["modal_root"][b, :m, :m], arrays["modal_stiffness"][b, :m] = frame.root, frame.stiffness
        arrays["modal_damping"][b, :m] = frame.damping
    for p, point in enumerate(points):
        m = point.rows.shape[1]
        arrays["point_rows"][p, :, :m], arrays["point_bend"][p, :, :m, :m] = point.rows, point.bend
    below = np.tril(arrays["modal_root"], -1)
    return arrays | {
        "elastic": np.column_stack([counts, start, start + total]).astype(np.int64),
        "orthogonal": (~below.any(axis=(1, 2))).astype(np.int64),
        "bends": arrays["point_bend"].any(axis=(1, 2, 3)).astype(np.int64),
    }
