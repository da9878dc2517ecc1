"""Points that slide over traction spaces: rows of the state, as weighted sums of the ports of functions.

With weights N(σ) a point's displacement is u + N e of its own rows and those of the functions; a force on it is one on
its own rows and Nᵀ of it on the functions. Weights of the end of a step are known from the motion without the forces of
its end: these move points across the line of sliding. N changes the displacement by ΔN e in a step, whose work a force
along the line of sliding gives back in the next one.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.compiled import copy, inner
from gudgeon.solver.contact.pattern import between
from gudgeon.solver.contact.weights import SHORT, slope, weigh
from gudgeon.solver.integrators.general.rows import displaced, moved

NOW, BEFORE = range(2)
"""Weights of the end of a step and of its start."""
OPEN = 1e30
"""Gap of a point beside its surface [m]; not infinity, whose product with zero is not a number."""


class Slides(NamedTuple):
    """Points that slide over traction spaces, whose functions have ports. Shapes: g sliding contacts.

    The measure of such a point is its own and a weighted sum of those of 4 × 4 functions of cubic splines; its force
    acts on them with the same weights, which change from step to step.
    """

    ports: np.ndarray
    """First and last + 1 port of the points of each contact, (g, 2)."""
    surface: np.ndarray
    """First port of its functions, their number across, and lines of them along, (g, 3)."""
    functions: np.ndarray
    """Ports of the functions of all surfaces, (F,)."""
    window: np.ndarray
    """First and last + 1 port of the functions below its points, (g, 2)."""
    row: np.ndarray
    """∂σ/∂q of the distance slid, (g, m)."""
    chart: np.ndarray
    """Start and spacing along of each traction space [m], (g, 2)."""
    sigma: np.ndarray
    """Distance slid at the end of the step and a step ago [m], (2, g)."""
    drag: np.ndarray
    """Force along the line of sliding on the slope of the deformed surface [N], (g,)."""
    drag_impulse: np.ndarray
    """[N s], (g,)."""
    over: np.ndarray
    """Whether a port is one of a point that slides, (p,)."""
    width: np.ndarray
    """Functions across of its surface, (p,)."""
    height: np.ndarray
    """Coordinate along of each point at σ = 0 [m], (p,)."""
    start: np.ndarray
    """Port of the first function across that it touches in the first line along; −1 beside the surface, (p,)."""
    across: np.ndarray
    """Its weights across, (p, 4)."""
    corner: np.ndarray
    """Port of the first function that it touches at the end of the step and a step ago; −1 beside, (2, p)."""
    along: np.ndarray
    """Its weights along at these times, (2, 4, p)."""
    free: np.ndarray
    """Gap of a point without the forces of the step's end [m], (p,)."""
    inward: np.ndarray
    """Displacement of functions without these forces, and by them [m], (2, p)."""
    left: np.ndarray
    """How many points have left their surface with a force, (1,)."""


@inner
def over(slides, i, moment, values):  # type: ignore[no-untyped-def]
    """Return the weighted sum of values of ports over the functions that a port touches, 0 where it touches none."""
    total, corner, width = 0.0, slides.corner[moment, i], slides.width[i]
    if corner >= 0:
        for b in range(4):
            first = corner + b * width
            part = 0.0
            for a in range(4):
                part += slides.across[i, a] * values[first + a]
            total += slides.along[moment, b, i] * part
    return total


@inner
def _spread(slides, i, moment, amount, values):  # type: ignore[no-untyped-def]
    """Add an amount on a port to values of the functions that it touches, with their weights."""
    corner, width = slides.corner[moment, i], slides.width[i]
    if corner >= 0:
        for b in range(4):
            first, part = corner + b * width, amount * slides.along[moment, b, i]
            for a in range(4):
                values[first + a] += part * slides.across[i, a]


@inner
def _spread_slope(slides, i, amount, values):  # type: ignore[no-untyped-def]
    """Add an amount on a port to values of the functions that it touches, with the slopes of its weights along."""
    corner, width = slides.corner[NOW, i], slides.width[i]
    for b in range(4):
        first, part = corner + b * width, amount * slope(slides.along[NOW, 3, i], b)
        for a in range(4):
            values[first + a] += part * slides.across[i, a]


@inner
def moved_over(constants, slides, i, moment, q):  # type: ignore[no-untyped-def]
    """Return W q of a port with its surface."""
    total, corner, width = moved(constants.rows, i, q), slides.corner[moment, i], slides.width[i]
    if corner >= 0:
        for b in range(4):
            for a in range(4):
                weight = slides.along[moment, b, i] * slides.across[i, a]
                total += weight * moved(constants.rows, corner + b * width + a, q)
    return total


@inner
def displaced_over(constants, slides, i, moment, held):  # type: ignore[no-untyped-def]
    """Return the displacement [m] of a port with its surface by forces in the residual flexibility.

    Args:
        held: The forces, (s, p), and which are not zero.
    """
    forces, listed = held
    total = displaced(constants.residual, i, forces, listed)
    corner, width = slides.corner[moment, i], slides.width[i]
    if corner >= 0:
        for b in range(4):
            for a in range(4):
                weight = slides.along[moment, b, i] * slides.across[i, a]
                total += weight * displaced(constants.residual, corner + b * width + a, forces, listed)
    return total


@inner
def coupling(pattern, table, slides, j, i):  # type: ignore[no-untyped-def]
    """Return the measure of port i by a force on port j, both with their surfaces, of a table of ports.

    Where there are surfaces, each row of the table has all ports.
    """
    total, corner, width = between(pattern, table, j, i), slides.corner[NOW, j], slides.width[j]
    if slides.corner[NOW, i] >= 0:
        total += over(slides, i, NOW, table[pattern.at[j] : pattern.at[j] + len(pattern.at)])
    if corner >= 0:
        for b in range(4):
            for a in range(4):
                weight, at = slides.along[NOW, b, j] * slides.across[j, a], pattern.at[corner + b * width + a]
                total += weight * (table[at + i] + over(slides, i, NOW, table[at : at + len(pattern.at)]))
    return total


@inner
def slide(constants, state):  # type: ignore[no-untyped-def]
    """Set how far points have slid, their weights, and their gaps without the forces of the step's end [m].

    Returns:
        Whether any weight has changed.
    """
    slides, changed = state.slides, False
    for g in range(len(slides.chart)):
        row, total, first, last = slides.row[g], 0.0, slides.ports[g, 0], slides.ports[g, 1]
        for k in range(len(state.q)):
            total += row[k] * state.q[k]
        changed = changed or total != slides.sigma[NOW, g] or total != slides.sigma[BEFORE, g]
        slides.sigma[BEFORE, g] = slides.sigma[NOW, g]
        slides.sigma[NOW, g] = total
        copy(slides.corner[NOW, first:last], slides.corner[BEFORE, first:last])
        for b in range(4):
            copy(slides.along[NOW, b, first:last], slides.along[BEFORE, b, first:last])
        places = (slides.height[first:last], total, slides.start[first:last])
        chart = (slides.chart[g, 0], slides.chart[g, 1], slides.surface[g, 2] - 4.0)
        width = slides.surface[g, 1]
        weigh(places, chart, width, slides.corner[NOW, first:last], slides.along[NOW, :, first:last])
        _set_window(slides, g)
        for f in range(slides.window[g, 0], slides.window[g, 1]):
            by_forces = displaced(constants.residual, f, state.known, state.listed_known)
            slides.inward[0, f] = moved(constants.rows, f, state.q) + by_forces
        for i in range(first, last):
            slides.free[i] = OPEN
            if slides.corner[NOW, i] >= 0:
                own = moved(constants.rows, i, state.q)
                own += displaced(constants.residual, i, state.known, state.listed_known)
                slides.free[i] = constants.offset[i] + own + over(slides, i, NOW, slides.inward[0])
    return changed


@inner
def _set_window(slides, g):  # type: ignore[no-untyped-def]
    """Set the range of functions below the points of a contact."""
    begin, width, lines = slides.surface[g, 0], slides.surface[g, 1], slides.surface[g, 2]
    low, high = begin + width * lines, begin
    for i in range(slides.ports[g, 0], slides.ports[g, 1]):
        corner = slides.corner[NOW, i]
        if corner >= 0:
            line = begin + (corner - begin) // width * width
            low, high = min(low, line), max(high, line + 4 * width)
    slides.window[g, 0], slides.window[g, 1] = min(low, high), high


@inner
def gather_sliding(constants, slides, problem, a):  # type: ignore[no-untyped-def]
    """Set the column of a candidate with the surfaces of all."""
    n, ports, column, values = problem.size[0], problem.ports, problem.columns[a], slides.inward[1]
    j = ports[a]
    column[:n] = 0.0
    for g in range(len(slides.window)):
        values[slides.window[g, 0] : slides.window[g, 1]] = 0.0
    at, p = constants.pattern.at, len(constants.pattern.at)
    _add_source(constants.columns[at[j] : at[j] + p], slides, problem, 1.0, column)
    corner, width = slides.corner[NOW, j], slides.width[j]
    if corner >= 0:
        for b in range(4):
            for e in range(4):
                weight, place = slides.along[NOW, b, j] * slides.across[j, e], at[corner + b * width + e]
                _add_source(constants.columns[place : place + p], slides, problem, weight, column)
    for c in range(n):
        column[c] += over(slides, ports[c], NOW, values)


@inner
def _add_source(source, slides, problem, weight, column):  # type: ignore[no-untyped-def]
    """Add what a force on a port moves, to a column of the candidates and to the functions below points."""
    ports, values = problem.ports, slides.inward[1]
    for c in range(problem.size[0]):
        column[c] += weight * source[ports[c]]
    for g in range(len(slides.window)):
        for f in range(slides.window[g, 0], slides.window[g, 1]):
            values[f] += weight * source[f]


@inner
def press_surfaces(constants, state):  # type: ignore[no-untyped-def]
    """Set the forces on functions by those of the points that slide over them."""
    slides = state.slides
    for n in range(len(slides.functions)):
        state.unknown[slides.functions[n]] = state.extra[slides.functions[n]] = 0.0
    for g in range(len(slides.ports)):
        for i in range(slides.ports[g, 0], slides.ports[g, 1]):
            if state.unknown[i] != 0.0:
                _spread(slides, i, NOW, state.unknown[i], state.unknown)
            if state.extra[i] != 0.0:
                _spread(slides, i, NOW, state.extra[i], state.extra)
    for n in range(len(slides.functions)):
        f = slides.functions[n]
        if state.last[f] == 0.0 and state.unknown[f] != 0.0:
            state.response[1, f] = displaced(constants.residual, f, state.held, state.listed)


@inner
def reach_surfaces(constants, state, problem):  # type: ignore[no-untyped-def]
    """Set the displacement of the functions by the forces found [m]."""
    slides = state.slides
    for g in range(len(slides.window)):
        for f in range(slides.window[g, 0], slides.window[g, 1]):
            slides.inward[1, f] = _given_way(constants, state, problem, f)


@inner
def _given_way(constants, state, problem, i):  # type: ignore[no-untyped-def]
    """Return the displacement of a port, without its surface, by the forces found [m]."""
    total, slides, columns, inertia, at = 0.0, state.slides, constants.columns, constants.inertia, constants.pattern.at
    for a in range(problem.size[0]):
        j = problem.ports[a]
        total += columns[at[j] + i] * state.unknown[j] + inertia[at[j] + i] * state.extra[j]
    for g in range(len(slides.window)):
        for f in range(slides.window[g, 0], slides.window[g, 1]):
            total += columns[at[f] + i] * state.unknown[f] + inertia[at[f] + i] * state.extra[f]
    return total


@inner
def found_gap(constants, state, problem, i):  # type: ignore[no-untyped-def]
    """Return the gap [m] of a point that is no candidate, under the forces found, after `reach_surfaces`."""
    slides = state.slides
    return slides.free[i] + _given_way(constants, state, problem, i) + over(slides, i, NOW, slides.inward[1])


@inner
def pull_along(constants, state, force):  # type: ignore[no-untyped-def]
    """Add the generalised force of the drag of the last step."""
    slides = state.slides
    for g in range(len(slides.drag)):
        if slides.drag[g] != 0.0:
            slides.drag_impulse[g] += constants.dt[0] * slides.drag[g]
            row = slides.row[g]
            for k in range(len(force)):
                force[k] += slides.drag[g] * row[k]


@inner
def place_surfaces(constants, state):  # type: ignore[no-untyped-def]
    """Set the displacement of loaded functions by the residual flexibility at the end of the step [m]."""
    functions = state.slides.functions
    for n in range(len(functions)):
        f = functions[n]
        if state.unknown[f] != 0.0 or state.last[f] != 0.0:
            state.response[0, f] = displaced(constants.residual, f, state.held, state.listed)


@inner
def drag_along(constants, state):  # type: ignore[no-untyped-def]
    """Find the force [N] along the line of sliding on each deformed surface, λ̄ᵀ ΔN e / Δσ.

    Where ΔN is round-off, its slope takes the place of the quotient: a quotient of round-off by less is any force.
    """
    slides = state.slides
    slip = slides.inward[1]
    for g in range(len(slides.drag)):
        slid, total, spacing = slides.sigma[NOW, g] - slides.sigma[BEFORE, g], 0.0, slides.chart[g, 1]
        first = slides.surface[g, 0]
        last = first + slides.surface[g, 1] * slides.surface[g, 2]
        slip[first:last] = 0.0
        for i in range(slides.ports[g, 0], slides.ports[g, 1]):
            if state.mean[i] == 0.0 or slides.corner[NOW, i] < 0 or slides.corner[BEFORE, i] < 0:
                continue
            if abs(slid) > SHORT * spacing:
                _spread(slides, i, NOW, state.mean[i] / slid, slip)
                _spread(slides, i, BEFORE, -state.mean[i] / slid, slip)
            else:
                _spread_slope(slides, i, state.mean[i] / spacing, slip)
        for f in range(first, last):
            if slip[f] != 0.0:
                by_forces = displaced(constants.residual, f, state.held, state.listed)
                total += slip[f] * (moved(constants.rows, f, state.q) + by_forces)
        slides.drag[g] = total
