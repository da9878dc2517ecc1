"""Pairs that slide: weights that follow, forces and displacements of the traction spaces, drag."""

import numpy as np

from gudgeon.solver.compiled import inner
from gudgeon.solver.contact.compliance import combine, gather, pack, scatter, window
from gudgeon.solver.contact.lcp import append

MARGIN = 1
"""Functions along kept up to date beside those of the window."""
FAR = 1e30
"""Gap of a point beyond its traction space [m]: no part is as large. Infinity times no force would be no number."""


@inner
def follow(modes, masters, matrix):  # type: ignore[no-untyped-def]
    """Move the sliding pairs; returns whether the matrix is out of date."""
    q, sigma, stale = modes.q, masters.sigma, False
    for k in range(len(matrix.space)):
        if matrix.space[k, 2] > 0:
            row, total = masters.slide[k], 0.0
            for i in range(len(q)):
                total += row[i] * q[i]
            masters.way[k] = total - sigma[0, k]
            sigma[1, k] = sigma[0, k]
            sigma[0, k] = total
            stale |= abs(total - sigma[2, k]) > masters.refresh[0] * masters.chart[k, 1]
    return stale


@inner
def keep_up(masters, matrix, k):  # type: ignore[no-untyped-def]
    """Bring the weights of a contact's points up to date, those of the end and those of the start of the step."""
    sigma, stand = masters.sigma, masters.stand
    if matrix.space[k, 2] == 0:
        return
    if stand[1, k] != sigma[1, k]:
        if stand[0, k] == sigma[1, k]:
            first, last = matrix.block[k, 0], matrix.block[k, 1]
            masters.corner[1, first:last] = masters.corner[0, first:last]
            masters.along[1, :, first:last] = masters.along[0, :, first:last]
        else:
            _weigh(masters, matrix, k, 1)
        stand[1, k] = sigma[1, k]
    if stand[0, k] != sigma[0, k]:
        _weigh(masters, matrix, k, 0)
        stand[0, k] = sigma[0, k]


@inner
def _weigh(masters, matrix, k, moment):  # type: ignore[no-untyped-def]
    """Set the spline weights along of a contact's points at the end (moment = 0) or at the start of the step (1)."""
    first, last, columns = matrix.block[k, 0], matrix.block[k, 1], matrix.space[k, 1]
    highest, chart, along = matrix.space[k, 2] - 4.0, masters.chart, masters.along
    shift, scale = masters.sigma[moment, k] - chart[k, 0], 1 / chart[k, 1]
    height, start, corner = masters.height[first:last], masters.start[first:last], masters.corner[moment, first:last]
    p, q, r, s = (
        along[moment, 0, first:last], along[moment, 1, first:last], along[moment, 2, first:last],
        along[moment, 3, first:last],
    )  # fmt: skip
    # Few arrays to a loop: vector units ask first whether they overlap.
    for i in range(len(height)):
        where = (height[i] + shift) * scale
        line = min(max(np.floor(where), 0.0), highest)
        p[i] = where - line
        inside = start[i] >= 0 and where >= -1e-9 and where <= highest + 1 + 1e-9
        corner[i] = start[i] + np.int64(line) * columns if inside else -1
    for i in range(len(p)):
        t, u = p[i], 1 - p[i]
        q[i] = (3 * t * t * t - 6 * t * t + 4) / 6
        r[i] = (3 * u * u * u - 6 * u * u + 4) / 6
        s[i] = t * t * t / 6
    for i in range(len(p)):
        u = 1 - p[i]
        p[i] = u * u * u / 6


@inner
def renew(points, masters, matrix, tally):  # type: ignore[no-untyped-def]
    """Let the matrix follow the weights, and factorise the active rows anew."""
    corner, space, block, filled, active = masters.corner[0], matrix.space, matrix.block, masters.filled, points.active
    matrix.era[0] += 1
    for k in range(len(space)):
        keep_up(masters, matrix, k)
        low, high = space[k, 2], 0
        for i in range(block[k, 0], block[k, 1]):
            if corner[i] >= 0:
                line = (corner[i] - space[k, 0]) // space[k, 1]
                low, high = min(low, line), max(high, line + 4)
        # Points move on until the next era.
        high = min(space[k, 2], high + 1)
        low = min(max(0, low - 1), high)
        matrix.window[k, 0], matrix.window[k, 1] = low, high
        low, high = max(0, low - MARGIN), min(space[k, 2], high + MARGIN)
        for line in range(low, high):
            if line < filled[k, 0] or line >= filled[k, 1]:
                _fill(masters, space[k, 0] + line * space[k, 1], space[k, 0] + (line + 1) * space[k, 1])
        filled[k, 0], filled[k, 1] = low, high
    matrix.corner[:] = corner
    matrix.along[:] = masters.along[0]
    masters.sigma[2] = masters.sigma[0]
    rows = active[: tally[0]].copy()
    tally[0] = 0
    for row in rows:
        if append(matrix, active, tally[0], points.factor, row):
            tally[0] += 1
    tally[3] += 1


@inner
def _fill(masters, first, last):  # type: ignore[no-untyped-def]
    """Set the residual displacement of functions that it was not kept of."""
    for f in range(first, last):
        row, strain, image = masters.residual[f], 0.0, 0.0
        for g in range(len(row)):
            strain += row[g] * masters.stress[g]
            image += row[g] * masters.onto[1, g]
        masters.strain[f], masters.image[f] = strain, image


@inner
def start_masters(masters):  # type: ignore[no-untyped-def]
    """Let the residual displacement of the traction spaces relax under the forces of the start of the step."""
    masters.onto[0] = masters.onto[1]
    strain, memory, image = masters.strain, masters.memory, masters.image
    for f in range(len(strain)):
        strain[f] = memory[0, f] * strain[f] + 2 * memory[1, f] * image[f]


@inner
def carry(modes, masters, matrix, k):  # type: ignore[no-untyped-def]
    """Set the inward displacement of the functions in a contact's window."""
    first, last = window(matrix, k)
    masters.inward[first:last] = masters.strain[first:last]
    own, q = masters.coordinates, modes.q[masters.span[0] : masters.span[1]]
    combine(masters.columns, own, q, len(own), 1.0, first, last, masters.inward)


@inner
def press_masters(masters, matrix, numbers, amounts, count):  # type: ignore[no-untyped-def]
    """Put half the forces of the end of the step onto the traction spaces and onto their bodies' coordinates."""
    onto, force = masters.onto[1], masters.force
    onto[:] = 0.0
    force[:] = 0.0
    low, high = scatter(matrix, masters.corner[0], masters.along[0], numbers, amounts, count, 0.5, onto)
    size = pack(onto, low, high, masters.numbers, masters.amounts)
    combine(masters.functions, masters.numbers, masters.amounts, size, 1.0, masters.span[0], masters.span[1], force)
    masters.size[0] = size


@inner
def strain_masters(masters, matrix):  # type: ignore[no-untyped-def]
    """Add to the residual displacement of the traction spaces what the forces of the end of the step do."""
    space, filled, strain, image, memory = matrix.space, masters.filled, masters.strain, masters.image, masters.memory
    image[:] = 0.0
    for k in range(len(filled)):
        first, last = space[k, 0] + filled[k, 0] * space[k, 1], space[k, 0] + filled[k, 1] * space[k, 1]
        combine(masters.residual, masters.numbers, masters.amounts, masters.size[0], 1.0, first, last, image)
    for f in range(len(strain)):
        strain[f] += 2 * memory[2, f] * image[f]


@inner
def catch_up(points, masters, matrix, numbers, amounts, count):  # type: ignore[no-untyped-def]
    """Add to the gaps the masters' displacement, with what the matrix, as it was made, misses of their response.

    Args:
        numbers, amounts: Rows that are expected to press, and their multipliers, the first `count`.
    """
    onto, work, shifted, corner, along = masters.onto[2], masters.work, points.shifted, masters.corner, masters.along
    onto[:] = 0.0
    low, high = scatter(matrix, corner[0], along[0], numbers, amounts, count, 1.0, onto)
    size = pack(onto, low, high, masters.numbers, masters.amounts)
    for k in range(len(matrix.block)):
        if matrix.near[k]:
            first, last = window(matrix, k)
            work[first:last] = masters.inward[first:last]
            combine(matrix.master, masters.numbers, masters.amounts, size, 1.0, first, last, work)
            gather(matrix, k, corner[0], along[0], work, shifted)
            first, last = matrix.block[k, 0], matrix.block[k, 1]
            combine(matrix.values, numbers, amounts, count, -1.0, first, last, shifted)
            combine(matrix.base, numbers, amounts, count, 1.0, first, last, shifted)


@inner
def drag_along(modes, points, masters, matrix):  # type: ignore[no-untyped-def]
    """Force of each deformed master along the way of sliding, λ̄ᵀ ΔN e / Δσ; it acts in the next step."""
    drag, way, corner, along, slip = masters.drag, masters.way, masters.corner, masters.along, masters.onto[2]
    slip[:] = 0.0
    first, last = len(slip), 0
    for n in range(points.counts[1]):
        i, k = points.pressed[1, n], 0
        while matrix.block[k, 1] <= i:
            k += 1
        now, then, width = corner[0, i], corner[1, i], matrix.space[k, 1]
        if way[k] != 0.0 and now >= 0 and then >= 0:
            amount = points.amounts[1, n] / way[k]
            for b in range(4):
                here, there = amount * along[0, b, i], amount * along[1, b, i]
                for a in range(4):
                    slip[now + b * width + a] += here * matrix.across[i, a]
                    slip[then + b * width + a] -= there * matrix.across[i, a]
            first, last = min(first, now, then), max(last, now + 3 * width + 4, then + 3 * width + 4)
    drag[:] = 0.0
    low, high = masters.span[0], masters.span[1]
    q, k = modes.q[low:high], 0
    for f in range(first, last):
        if slip[f] != 0.0:
            row, inward = masters.functions[f, low:high], masters.strain[f]
            for i in range(len(q)):
                inward += row[i] * q[i]
            while matrix.space[k, 0] + matrix.space[k, 1] * matrix.space[k, 2] <= f:
                k += 1
            drag[k] += slip[f] * inward
