"""Tensor cubic B-splines of surfaces and their derivatives, in compiled functions."""

import numpy as np

from gudgeon.solver.compiled import inner

BORDER = 0.05
"""Cells by which a point may be beyond the end of a surface, which elastic motion moves: its splines go on there."""


@inner
def cubic(t):  # type: ignore[no-untyped-def]
    """Return the four cubic splines at a share t of an interval."""
    s = 1.0 - t
    return s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6


@inner
def cubic_rates(t):  # type: ignore[no-untyped-def]
    """Return their derivatives over t."""
    s = 1.0 - t
    return -0.5 * s * s, 1.5 * t * t - 2 * t, -1.5 * s * s + 2 * s, 0.5 * t * t


@inner
def cubic_second_rates(t):  # type: ignore[no-untyped-def]
    """Return their second derivatives over t."""
    return 1.0 - t, 3 * t - 2, 1 - 3 * t, t


@inner
def interval(x, cells):  # type: ignore[no-untyped-def]
    """Return the interval of a coordinate counted in intervals, −1 beyond their end."""
    if not -BORDER <= x <= cells + BORDER:
        return -1
    return min(max(int(np.floor(x)), 0), cells - 1)


@inner
def height_at(f, s, cell, x):  # type: ignore[no-untyped-def]
    """Return H and its derivatives, ss, st and tt last, at a place counted in intervals."""
    a, b = cubic(x[0] - cell[0]), cubic(x[1] - cell[1])
    da, db = cubic_rates(x[0] - cell[0]), cubic_rates(x[1] - cell[1])
    dda, ddb = cubic_second_rates(x[0] - cell[0]), cubic_second_rates(x[1] - cell[1])
    h0, hs, ht, hss, hst, htt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(4):
        row = f.cells[s, 2] + (cell[0] + i) * (f.cells[s, 1] + 3) + cell[1]
        for j in range(4):
            h = f.heights[row + j]
            h0, hs, ht = h0 + a[i] * b[j] * h, hs + da[i] * b[j] * h, ht + a[i] * db[j] * h
            hss, hst, htt = hss + dda[i] * b[j] * h, hst + da[i] * db[j] * h, htt + a[i] * ddb[j] * h
    u, v = 1 / f.step[s, 0], 1 / f.step[s, 1]
    return h0, hs * u, ht * v, hss * u * u, hst * u * v, htt * v * v
