"""Sliding pairs: moving weights, forces and displacements of the traction spaces, drag."""

from gudgeon.solver.compiled import copy, inner
from gudgeon.solver.contact.compliance import Listed, combine, gather, pack, scatter, window
from gudgeon.solver.contact.lcp import append, drop_expected
from gudgeon.solver.contact.weights import SHORT, slope, weigh
from gudgeon.solver.integrators.implicit.open_contacts import least

MARGIN = 1
"""Functions along, on either side of the window, whose displacement is computed too."""
FAR = 1e30
"""Gap of a point beyond its traction space [m]; not infinity, whose product with a zero force is NaN."""


@inner
def update_sliding_distance(modes, masters, matrix):  # type: ignore[no-untyped-def]
    """Find how far [m] each pair has slid; returns whether the matrix is out of date."""
    q, sigma, stale = modes.q, masters.sigma, False
    for k in range(len(matrix.space)):
        if matrix.space[k, 2] > 0:
            row, total = masters.slide[k], 0.0
            for i in range(len(q)):
                total += row[i] * q[i]
            masters.slid[k] = total - sigma[0, k]
            sigma[1, k] = sigma[0, k]
            sigma[0, k] = total
            stale |= abs(total - sigma[2, k]) > masters.refresh[0] * masters.chart[k, 1]
    return stale


@inner
def update_weights(masters, matrix, k):  # type: ignore[no-untyped-def]
    """Bring the weights of a contact's points up to date, those of the end and those of the start of the step."""
    sigma, weights_at = masters.sigma, masters.weights_at
    if matrix.space[k, 2] == 0:
        return
    if weights_at[1, k] != sigma[1, k]:
        if weights_at[0, k] == sigma[1, k]:
            first, last = matrix.block[k, 0], matrix.block[k, 1]
            copy(masters.corner[0, first:last], masters.corner[1, first:last])
            for b in range(4):
                copy(masters.along[0, b, first:last], masters.along[1, b, first:last])
        else:
            _weigh(masters, matrix, k, 1)
        weights_at[1, k] = sigma[1, k]
    if weights_at[0, k] != sigma[0, k]:
        _weigh(masters, matrix, k, 0)
        weights_at[0, k] = sigma[0, k]


@inner
def _weigh(masters, matrix, k, moment):  # type: ignore[no-untyped-def]
    """Set the spline weights along of a contact's points at the end (moment = 0) or at the start of the step (1)."""
    first, last, chart = matrix.block[k, 0], matrix.block[k, 1], masters.chart
    places = (masters.height[first:last], masters.sigma[moment, k], masters.start[first:last])
    known = (chart[k, 0], chart[k, 1], matrix.space[k, 2] - 4.0)
    weigh(places, known, matrix.space[k, 1], masters.corner[moment, first:last], masters.along[moment, :, first:last])


@inner
def rebuild_matrix(masters, matrix, active):  # type: ignore[no-untyped-def]
    """Build the contact matrix [m/N] with the weights of the end of the step, and factorise its active rows."""
    corner, space, block, filled = masters.corner[0], matrix.space, matrix.block, masters.filled
    matrix.era[0] += 1
    copy(matrix.candidate, matrix.known)
    for k in range(len(space)):
        update_weights(masters, matrix, k)
        low, high = space[k, 2], 0
        for i in range(block[k, 0], block[k, 1]):
            if corner[i] >= 0:
                line = (corner[i] - space[k, 0]) // space[k, 1]
                low, high = min(low, line), max(high, line + 4)
        # A margin for the motion of the points until the next era.
        high = min(space[k, 2], high + 1)
        low = min(max(0, low - 1), high)
        matrix.window[k, 0], matrix.window[k, 1] = low, high
        low, high = max(0, low - MARGIN), min(space[k, 2], high + MARGIN)
        for line in range(low, high):
            if line < filled[k, 0] or line >= filled[k, 1]:
                _fill(masters, space[k, 0] + line * space[k, 1], space[k, 0] + (line + 1) * space[k, 1])
        filled[k, 0], filled[k, 1] = low, high
    copy(corner, matrix.corner)
    for b in range(4):
        copy(masters.along[0, b], matrix.along[b])
    copy(masters.sigma[0], masters.sigma[2])
    size = active.size[0]
    active.size[:2] = 0
    for a in range(size):
        append(matrix, active, active.rows[a])


@inner
def _fill(masters, first, last):  # type: ignore[no-untyped-def]
    """Compute the residual displacement [m] of functions that were outside of the range so far."""
    for f in range(first, last):
        row, displacement, response = masters.residual[f], 0.0, 0.0
        for g in range(len(row)):
            displacement += row[g] * masters.residual_force[g]
            response += row[g] * masters.function_forces[1, g]
        masters.residual_displacement[f], masters.response[f] = displacement, response


@inner
def start_masters(masters):  # type: ignore[no-untyped-def]
    """Relax the residual displacement [m] of the traction spaces under the forces of the start of the step."""
    copy(masters.function_forces[1], masters.function_forces[0])
    displacement, memory, response = masters.residual_displacement, masters.memory, masters.response
    for f in range(len(displacement)):
        displacement[f] = memory[0, f] * displacement[f] + 2 * memory[1, f] * response[f]


@inner
def surface_displacement(modes, masters, matrix, k):  # type: ignore[no-untyped-def]
    """Set the inward displacement [m] of the functions in a contact's window."""
    first, last = window(matrix, k)
    copy(masters.residual_displacement[first:last], masters.inward[first:last])
    own, q = masters.coordinates, modes.q[masters.span[0] : masters.span[1]]
    combine(masters.columns, Listed(own, q, len(own)), 1.0, first, last, masters.inward)


@inner
def press_masters(masters, matrix, listed):  # type: ignore[no-untyped-def]
    """Set the forces [N] on traction spaces and their bodies' coordinates by half the multipliers of the step's end."""
    onto, force = masters.function_forces[1], masters.force
    onto[:] = 0.0
    force[:] = 0.0
    low, high = scatter(matrix, masters.corner[0], masters.along[0], listed, 0.5, onto)
    size = pack(onto, low, high, masters.numbers, masters.amounts)
    found = Listed(masters.numbers, masters.amounts, size)
    combine(masters.functions, found, 1.0, masters.span[0], masters.span[1], force)
    masters.size[0] = size


@inner
def displace_masters(masters, matrix):  # type: ignore[no-untyped-def]
    """Add the effect of the forces of the step's end to the residual displacement [m] of the traction spaces."""
    space, filled, displacement, memory = matrix.space, masters.filled, masters.residual_displacement, masters.memory
    response, listed = masters.response, Listed(masters.numbers, masters.amounts, masters.size[0])
    response[:] = 0.0
    for k in range(len(filled)):
        first, last = space[k, 0] + filled[k, 0] * space[k, 1], space[k, 0] + filled[k, 1] * space[k, 1]
        combine(masters.residual, listed, 1.0, first, last, response)
    for f in range(len(displacement)):
        displacement[f] += 2 * memory[2, f] * response[f]


@inner
def press_as_expected(points, masters, matrix, expected, how):  # type: ignore[no-untyped-def]
    """Set the gaps [m] to those under the expected forces, whatever the age of the matrix.

    Where the space's largest displacement leaves a point clearly open, its gap is the bound by it: see `is_bound`.

    Args:
        points: Its gaps are those under the forces of the step's start.
        expected: Multipliers of the end of the step as they are expected [N], `Listed`.
        how: Whether those are others than at its start, and whether no gap may be a bound.
    """
    changed, exact = how
    onto, work, shifted, active = masters.function_forces[2], masters.work, points.shifted, points.active
    active.expected[:] = 0.0
    for n in range(expected.size):
        active.expected[expected.numbers[n]] = expected.amounts[n]
    corner, along = masters.corner, masters.along
    onto[:] = 0.0
    low, high = scatter(matrix, corner[0], along[0], expected, 1.0, onto)
    size = pack(onto, low, high, masters.numbers, masters.amounts)
    found = Listed(masters.numbers, masters.amounts, size)
    if changed:
        _list_change(points)
    for k in range(len(matrix.block)):
        if matrix.candidate[k]:
            first, last = window(matrix, k)
            copy(masters.inward[first:last], work[first:last])
            combine(matrix.master, found, 1.0, first, last, work)
            deepest = 0.0 if exact else min(0.0, least(work[first:last]))
            first, last = matrix.block[k, 0], matrix.block[k, 1]
            _bound(corner[0, first:last], shifted[first:last], masters.near[first:last], deepest)
            gather(matrix, k, masters.near, along[0], work, shifted)
            if changed:
                _add_change(points, matrix.base, first, last)
    _drop_open(matrix, shifted, active, expected)


@inner
def _list_change(points):  # type: ignore[no-untyped-def]
    """Set by how much the multipliers of closed rows change in the step [N], in the order of their list.

    They stand where r at its end will.
    """
    for n in range(points.counts[1]):
        points.end_residual_force[n] = points.amounts[1, n] - points.last[points.pressed[1, n]]


@inner
def _add_change(points, base, first, last):  # type: ignore[no-untyped-def]
    """Add to the gaps of rows first to last − 1 what multipliers do that change in the step [m]."""
    change = Listed(points.pressed[1], points.end_residual_force, points.counts[1])
    combine(base, change, 1.0, first, last, points.shifted)
    for n in range(points.counts[0]):
        i = points.pressed[0, n]
        if points.multipliers[i] == 0.0:
            row, gaps, amount = base[i, first:last], points.shifted[first:last], points.last[i]
            for j in range(len(gaps)):
                gaps[j] -= amount * row[j]


@inner
def _bound(corner, gaps, near, deepest):  # type: ignore[no-untyped-def]
    """Set the corners of points, none where twice the deepest displacement of the space [m] does not close a gap.

    Weights are positive and add up to one at most, so that a gap closes by the deepest displacement at most.
    """
    for i in range(len(gaps)):
        near[i] = corner[i] if deepest == 0.0 or gaps[i] <= -2.0 * deepest else -1
    for i in range(len(gaps)):
        gaps[i] += deepest if near[i] != corner[i] else 0.0


@inner
def is_bound(points, masters):  # type: ignore[no-untyped-def]
    """Whether a row is closed whose gap is a bound, so that exact gaps are needed."""
    for a in range(points.active.size[0]):
        row = points.active.rows[a]
        if masters.near[row] != masters.corner[0, row]:
            return True
    return False


@inner
def _drop_open(matrix, shifted, active, expected):  # type: ignore[no-untyped-def]
    """Take off the gaps [m] what is expected of rows that a new matrix has left open."""
    closed = active.closed[0]
    closed[:] = False
    for a in range(active.size[0]):
        closed[active.rows[a]] = True
    for n in range(expected.size):
        if not closed[expected.numbers[n]]:
            drop_expected(matrix, shifted, active, expected.numbers[n])


@inner
def drag_along(modes, points, masters, matrix):  # type: ignore[no-untyped-def]
    """Find the force [N] of each deformed master along the line of sliding, λ̄ᵀ ΔN e / Δσ; it acts in the next step.

    Where ΔN is round-off, its slope takes the place of the quotient: a quotient of round-off by less is any force.
    """
    drag, slid, corner, along = masters.drag, masters.slid, masters.corner, masters.along
    slip = masters.function_forces[2]
    slip[:] = 0.0
    first, last = len(slip), 0
    for n in range(points.counts[1]):
        i, k = points.pressed[1, n], 0
        while matrix.block[k, 1] <= i:
            k += 1
        now, then, width = corner[0, i], corner[1, i], matrix.space[k, 1]
        if now >= 0 and then >= 0:
            spacing = masters.chart[k, 1]
            short = abs(slid[k]) <= SHORT * spacing
            amount = points.amounts[1, n] / (spacing if short else slid[k])
            for b in range(4):
                here = amount * (slope(along[0, 3, i], b) if short else along[0, b, i])
                there = 0.0 if short else amount * along[1, b, i]
                for a in range(4):
                    slip[now + b * width + a] += here * matrix.across[i, a]
                    slip[then + b * width + a] -= there * matrix.across[i, a]
            first, last = min(first, now, then), max(last, now + 3 * width + 4, then + 3 * width + 4)
    drag[:] = 0.0
    low, high = masters.span[0], masters.span[1]
    q, k = modes.q[low:high], 0
    for f in range(first, last):
        if slip[f] != 0.0:
            row, inward = masters.functions[f, low:high], masters.residual_displacement[f]
            for i in range(len(q)):
                inward += row[i] * q[i]
            while matrix.space[k, 0] + matrix.space[k, 1] * matrix.space[k, 2] <= f:
                k += 1
            drag[k] += slip[f] * inward
