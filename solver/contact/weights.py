"""Weights of points along the cubic splines of a traction space over which they slide."""

import numpy as np

from gudgeon.solver.compiled import entry, inner

SHORT = 1e-7
"""Distance slid in a step over the spacing below which the change of weights is round-off: their slopes tell it."""


@entry
def weigh(places, chart, width, corner, along):  # type: ignore[no-untyped-def]
    """Set which functions points touch, and their weights along.

    Args:
        places: Coordinate along of each point [m], the distance slid, and the first function across that each touches
            in the first line along, −1 beside the space; (c,), a number, (c,).
        chart: Start and spacing along [m], and number of the last line that is the first of four.
        width: Functions across.
        corner: Becomes the first function that each point touches, −1 beside the space, (c,).
        along: Becomes the values of the four splines, (4, c).
    """
    height, sigma, start = places
    shift, scale, highest = sigma - chart[0], 1 / chart[1], chart[2]
    p, q, r, s = along[0], along[1], along[2], along[3]
    # Few arrays in a loop, since vector code first tests whether they overlap.
    for i in range(len(height)):
        where = (height[i] + shift) * scale
        line = min(max(np.floor(where), 0.0), highest)
        p[i] = where - line
        inside = start[i] >= 0 and where >= -1e-9 and where <= highest + 1 + 1e-9
        corner[i] = start[i] + np.int64(line) * width if inside else -1
    for i in range(len(p)):
        t, u = p[i], 1 - p[i]
        q[i] = (3 * t * t * t - 6 * t * t + 4) / 6
        r[i] = (3 * u * u * u - 6 * u * u + 4) / 6
        s[i] = t * t * t / 6
    for i in range(len(p)):
        u = 1 - p[i]
        p[i] = u * u * u / 6


@inner
def slope(last, b):  # type: ignore[no-untyped-def]
    """Return how the weight b of four changes along, times the spacing, where the last one is given."""
    t = (6.0 * max(last, 0.0)) ** (1.0 / 3.0)
    u = 1.0 - t
    if b == 0:
        return -0.5 * u * u
    if b == 1:
        return 0.5 * t * (3.0 * t - 4.0)
    if b == 2:
        return 0.5 * u * (4.0 - 3.0 * u)
    return 0.5 * t * t
