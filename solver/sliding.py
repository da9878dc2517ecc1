"""Pairs that slide: weights that follow, forces and displacements of the traction spaces, drag."""

import numpy as np

from solver.compliance import inner
from solver.lcp import append

MARGIN = 4
"""Functions along kept up to date beside those that points touch."""


@inner
def follow(modes, points, masters, matrix):  # type: ignore[no-untyped-def]
    """Move the weights with the sliding pairs; returns whether the matrix is out of date."""
    q, space, sigma, chart, contact = modes.q, matrix.space, masters.sigma, masters.chart, points.contact
    place, along, height = masters.place, masters.along, masters.height
    stale = False
    masters.old_place[:] = place
    masters.old_along[:] = along
    for k in range(len(chart)):
        if space[k, 2] > 0:
            row, total = masters.slide[k], 0.0
            for i in range(len(q)):
                total += row[i] * q[i]
            masters.way[k] = total - sigma[0, k]
            sigma[0, k] = total
            stale |= abs(total - sigma[1, k]) > masters.refresh[0] * chart[k, 1]
    for i in range(len(height)):
        k = contact[i]
        last = space[k, 2] - 4
        if last < 0:
            continue
        where = (height[i] + sigma[0, k] - chart[k, 0]) / chart[k, 1]
        if place[i, 0] < 0 or where < -1e-9 or where > last + 1 + 1e-9:
            place[i, 1] = -1
            continue
        first = min(max(int(np.floor(where)), 0), last)
        t = where - first
        s = 1 - t
        place[i, 1] = first
        along[i, 0] = s * s * s / 6
        along[i, 1] = (3 * t * t * t - 6 * t * t + 4) / 6
        along[i, 2] = (3 * s * s * s - 6 * s * s + 4) / 6
        along[i, 3] = t * t * t / 6
    return stale


@inner
def renew(points, masters, matrix, tally):  # type: ignore[no-untyped-def]
    """Let the matrix follow the weights, and factorise the active rows anew."""
    place, space, window, filled = masters.place, matrix.space, matrix.window, masters.filled
    residual, stress, strain, active = masters.residual, masters.stress, masters.strain, points.active
    matrix.era[0] += 1
    matrix.place[:, 1] = place[:, 1]
    matrix.along[:] = masters.along
    for k in range(len(window)):
        low, high = space[k, 2], 0
        for i in range(len(place)):
            if points.contact[i] == k and place[i, 1] >= 0:
                low, high = min(low, place[i, 1]), max(high, place[i, 1] + 4)
        # Points move on until the next era.
        high = min(space[k, 2], high + 1)
        low = min(max(0, low - 1), high)
        window[k, 0], window[k, 1] = low, high
        low, high = max(0, low - MARGIN), min(space[k, 2], high + MARGIN)
        for j in range(low, high):
            if j < filled[k, 0] or j >= filled[k, 1]:
                for f in range(space[k, 0] + j * space[k, 1], space[k, 0] + (j + 1) * space[k, 1]):
                    total = 0.0
                    for g in range(len(stress)):
                        total += residual[f, g] * stress[g]
                    strain[f] = total
        filled[k, 0], filled[k, 1] = low, high
    masters.sigma[1] = masters.sigma[0]
    count = tally[0]
    rows = active[:count].copy()
    tally[0] = 0
    for row in rows:
        if append(matrix, active, tally[0], points.factor, row):
            tally[0] += 1
    tally[3] += 1


@inner
def scatter(matrix, contact, place, along, multipliers, share, out):  # type: ignore[no-untyped-def]
    """Add share · Nᵀ λ to `out`, (F,)."""
    space, across = matrix.space, matrix.across
    for i in range(len(multipliers)):
        if multipliers[i] != 0.0 and place[i, 1] >= 0:
            k, amount = contact[i], share * multipliers[i]
            for b in range(4):
                f = space[k, 0] + (place[i, 1] + b) * space[k, 1] + place[i, 0]
                for a in range(4):
                    out[f + a] += along[i, b] * across[i, a] * amount


@inner
def push_masters(modes, masters, onto):  # type: ignore[no-untyped-def]
    """Move the masters' coordinates by forces on the functions."""
    q, v, push, force, functions = modes.q, modes.v, modes.push, modes.force, masters.functions
    first, last = masters.span[0], masters.span[1]
    total = np.zeros(last - first)
    for f in range(len(onto)):
        if onto[f] != 0.0:
            for k in range(first, last):
                total[k - first] += onto[f] * functions[f, k]
    for k in range(first, last):
        force[k] += total[k - first]
        q[k] += push[0, k] * total[k - first]
        v[k] += push[1, k] * total[k - first]


@inner
def strain_masters(masters, matrix, onto, moment):  # type: ignore[no-untyped-def]
    """Add to the residual displacement of the traction spaces, where it is kept, what half forces `onto` do.

    Args:
        moment: 1 for forces at the start of the step, 2 for those at its end.
    """
    space, filled, strain, residual, share = (
        matrix.space, masters.filled, masters.strain, masters.residual, masters.memory[moment],
    )  # fmt: skip
    for g in range(len(onto)):
        if onto[g] != 0.0:
            amount = 2 * onto[g]
            for k in range(len(filled)):
                first, last = space[k, 0] + filled[k, 0] * space[k, 1], space[k, 0] + filled[k, 1] * space[k, 1]
                for f in range(first, last):
                    strain[f] += share[f] * residual[g, f] * amount


@inner
def move_masters(modes, masters, matrix):  # type: ignore[no-untyped-def]
    """Set the inward displacement of the functions in the windows."""
    q, columns, inward, space, window = modes.q, masters.columns, masters.inward, matrix.space, matrix.window
    inward[:] = masters.strain
    for k in range(masters.span[0], masters.span[1]):
        amount = q[k]
        for number in range(len(window)):
            base, width = space[number, 0], space[number, 1]
            for f in range(base + window[number, 0] * width, base + window[number, 1] * width):
                inward[f] += columns[k, f] * amount


@inner
def image_of(matrix, onto, image):  # type: ignore[no-untyped-def]
    """Set image = M onto, within the windows, (F,)."""
    space, window, master = matrix.space, matrix.window, matrix.master
    image[:] = 0.0
    for g in range(len(onto)):
        if onto[g] != 0.0:
            amount = onto[g]
            for k in range(len(window)):
                base, width = space[k, 0], space[k, 1]
                for f in range(base + window[k, 0] * width, base + window[k, 1] * width):
                    image[f] += master[g, f] * amount


@inner
def drag_along(points, masters, matrix):  # type: ignore[no-untyped-def]
    """Force of each deformed master along the way of sliding, λ̄ᵀ ΔN e / Δσ; it acts in the next step."""
    drag, way, contact, force = masters.drag, masters.way, points.contact, points.multipliers
    space, across, inward = matrix.space, matrix.across, masters.inward
    place, along, old_place, old_along = masters.place, masters.along, masters.old_place, masters.old_along
    drag[:] = 0.0
    for i in range(len(force)):
        k = contact[i]
        if force[i] != 0.0 and way[k] != 0.0 and old_place[i, 1] >= 0 and place[i, 1] >= 0:
            change, width = 0.0, space[k, 1]
            now = space[k, 0] + place[i, 1] * width + place[i, 0]
            then = space[k, 0] + old_place[i, 1] * width + place[i, 0]
            for b in range(4):
                for a in range(4):
                    change += along[i, b] * across[i, a] * inward[now + b * width + a]
                    change -= old_along[i, b] * across[i, a] * inward[then + b * width + a]
            drag[k] += force[i] * change / way[k]
