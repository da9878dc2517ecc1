"""Semismooth Newton's method for the responses of all candidates of a step, and the residual that accepts a solution.

Every port has F(x) = x − its response to the measures y = y₀ + M x, zero at a solution: of unilateral contact
x − max(0, x − ρ y), of the tangents of a cone x − the projection of x − ρ y onto the disc μ fₙ (P. Alart, A. Curnier,
Comput. Methods Appl. Mech. Engrg. 92 (1991) 353-375). F is piecewise smooth; each step factors its derivative anew.
"""

import numpy as np

from gudgeon.solver.compiled import inner
from gudgeon.solver.integrators.elimination import eliminate
from gudgeon.solver.integrators.general.arrays import BILATERAL, CONE, DRIVEN, POSITION, SPRING, UNILATERAL
from gudgeon.solver.integrators.general.solution.responses import compliant_force, held_or_rubbed, presses

MOST_STEPS = 12
NEWTON = 5
"""Entry of the counts: steps of Newton's method."""
RIDGE = 1e-12
"""Added to the diagonal of the derivative, relative to it: rows of points that depend on each other are singular."""
ROUND_OFF = 1e-15
"""Residual of a solution that round-off leaves, over the force that would stop a port's free motion, that at the start,
and that which would move points by where they are held."""
UNBOUNDED = 1e14
"""Largest force over the one that would stop a port's free motion: none balances the motion, only round-off does."""
DIFFERENCE = 1e-7
"""Share of a measure by which the slope of a law is found."""


@inner
def natural_residual(constants, problem):  # type: ignore[no-untyped-def]
    """Return Σ F² of unilateral contact and friction, with the changes of the last sweep for ports of other kinds [N²].

    A sum: it is not a number where any part of it is not.
    """
    n, ports, total = problem.size[0], problem.ports, 0.0
    x, y, stiff, start = problem.x, problem.y, problem.stiff, problem.start
    kinds, sizes, friction, slipped = constants.kind, constants.size, constants.friction, problem.slipped
    for a in range(n):
        i = ports[a]
        if sizes[i] == 0:
            continue
        if stiff[a] == 0.0 and presses(kinds[i]):
            total += x[a] * x[a]  # No force moves it.
        elif kinds[i] == UNILATERAL or kinds[i] == CONE:
            wrong = y[a] * stiff[a]
            # No `max`, which is 0 where the force wanted is not a number.
            wrong = x[a] if x[a] - wrong <= 0.0 else wrong
            total += wrong * wrong
        else:
            for b in range(a, a + (sizes[i] if kinds[i] in (BILATERAL, DRIVEN) else 1)):
                total += (x[b] - start[b]) ** 2
        if sizes[i] == 3 and kinds[i] != DRIVEN:
            limit = (friction[i, 0] * x[a], friction[i, 1] * x[a])
            forces, measures = (x[a + 1], x[a + 2]), (y[a + 1], y[a + 2])
            first, second, _ = held_or_rubbed(stiff[a + 1], limit, slipped[i], forces, measures)
            total += (x[a + 1] - first) ** 2 + (x[a + 2] - second) ** 2
    return total


@inner
def allowed(constants, state, problem, tolerance, bound):  # type: ignore[no-untyped-def]
    """Return the residual of a solution [N]: a share of its largest force, or of its bound [N], or round-off.

    Measures keep the round-off of the forces at the start, which is all there is where no force is the solution. Those
    across are differences of places, whose round-off no force takes away where more points are held than can move.

    Forces of short steps are small differences of what would stop free motions; those of friction are within their
    cones, however little a point that is held across would move. Not a number, which no residual is below, where a
    force has grown beyond what round-off can tell from one without end.
    """
    x, stiff, largest, rough, across = problem.x, problem.stiff, 0.0, 0.0, 0
    placed, places = False, 0.0
    for a in range(problem.size[0]):
        i = problem.ports[a]
        largest = max(largest, abs(x[a]))
        if across > 0:
            across -= 1
            places += (state.anchor[i] * stiff[a]) ** 2 if placed else 0.0
        elif x[a] != 0.0:
            rough = max(rough, abs(problem.free[i]) * stiff[a])
        if constants.size[i] == 3 and constants.kind[i] != DRIVEN:
            across, placed = 2, constants.level[i] == POSITION
    if largest > UNBOUNDED * rough > 0.0:
        return np.nan
    return max(tolerance * min(largest, bound[0]), ROUND_OFF * max(rough, bound[1], np.sqrt(places)))


@inner
def renew(problem):  # type: ignore[no-untyped-def]
    """Set the measures by the unknowns: those kept up to date have the round-off of all unknowns on the way."""
    n = problem.size[0]
    x, y, columns = problem.x[:n], problem.y[:n], problem.columns
    for a in range(n):
        y[a] = problem.free[problem.ports[a]]
    for a in range(n):
        if x[a] != 0.0:
            column, amount = columns[a], x[a]
            for c in range(len(y)):
                y[c] += amount * column[c]


@inner
def newton(constants, state, problem, tolerance, bound):  # type: ignore[no-untyped-def]
    """Improve the unknowns until the residual is within a tolerance; False where it is not.

    Args:
        tolerance: Relative to the largest force, or to its bound [N].
        bound: Of the forces, and the largest one at the start [N].
    """
    n = problem.size[0]
    x, start = problem.x[:n], problem.start[:n]
    matrix, step = problem.derivative[:n, :n], problem.correction[:n]
    for _turn in range(MOST_STEPS):
        state.counts[NEWTON] += 1
        _derive(constants, state, problem, matrix, step)
        for a in range(n):
            matrix[a, a] += RIDGE * abs(matrix[a, a])
        if not eliminate(matrix, step):
            return False
        for a in range(n):
            x[a] -= step[a]
        for a in range(n):
            # The change of the other kinds that the residual takes.
            start[a] = x[a] + step[a]
        renew(problem)
        if natural_residual(constants, problem) <= allowed(constants, state, problem, tolerance, bound) ** 2:
            return True
    return False


@inner
def _derive(constants, state, problem, matrix, wrong):  # type: ignore[no-untyped-def]
    """Set F and its derivative, a row for each candidate."""
    n, ports, x, y, columns = problem.size[0], problem.ports, problem.x, problem.y, problem.columns
    matrix[:, :] = 0.0
    for a in range(n):
        i = ports[a]
        kind, size = constants.kind[i], constants.size[i]
        if size == 0:
            continue
        if kind == BILATERAL:
            _derive_rod(state.rod[constants.joint[i]], problem, a, matrix, wrong)
            continue
        if kind == DRIVEN:
            _derive_drive(constants.inverse[i : i + size, :size], problem, a, matrix, wrong)
            continue
        reach = columns[a, a]
        if reach <= 0.0 and presses(kind):
            wrong[a], matrix[a, a] = x[a], 1.0
        elif kind in (UNILATERAL, CONE):
            closed = x[a] - y[a] / reach > 0.0
            wrong[a] = y[a] / reach if closed else x[a]
            if closed:
                _add_row(columns, n, a, 1.0 / reach, matrix[a])
            else:
                matrix[a, a] = 1.0
        else:
            ends, before = constants.share[i] < 1.0, state.displacement[1, i]
            knots = constants.knots[constants.table[i, 0] : constants.table[i, 1]]
            given, free = (constants.law[i], state.approach[i], knots), y[a] - reach * x[a]
            force = compliant_force(kind == SPRING, given, (before, free), reach, constants.dt[0], ends)
            away = DIFFERENCE * (abs(free) + abs(before) + reach * abs(x[a]))
            other = compliant_force(kind == SPRING, given, (before, free - away), reach, constants.dt[0], ends)
            slope = (force - other) / away if away > 0.0 else 0.0
            wrong[a] = x[a] - force
            _add_row(columns, n, a, -slope, matrix[a])
            matrix[a, a] += 1.0 + slope * reach
        if size == 3:
            _derive_friction(constants.friction[i], problem, a, matrix, wrong)


@inner
def _add_row(columns, n, a, factor, row):  # type: ignore[no-untyped-def]
    """Add the derivative of a measure, times a factor."""
    for c in range(n):
        row[c] += factor * columns[c, a]


@inner
def _derive_friction(friction, problem, a, matrix, wrong):  # type: ignore[no-untyped-def]
    """Set F of the tangents of a cone and its derivative."""
    n, x, y, columns = problem.size[0], problem.x, problem.y, problem.columns
    slides = problem.slipped[problem.ports[a]]
    weight = problem.stiff[a + 1]
    first, second = x[a + 1] - weight * y[a + 1], x[a + 2] - weight * y[a + 2]
    size, normal = np.sqrt(first * first + second * second), max(0.0, x[a])
    if size <= (friction[1] if slides else friction[0]) * normal and normal > 0.0:
        for b in range(a + 1, a + 3):
            wrong[b] = weight * y[b]
            _add_row(columns, n, b, weight, matrix[b])
            if weight == 0.0 or columns[b, b] == 0.0:
                wrong[b], matrix[b, b] = x[b], 1.0
        return
    # What slips goes on to slip: between static and kinetic friction it would change without end.
    problem.slipped[problem.ports[a]] = True
    limit = friction[1] * normal
    along, across = (first / size, second / size) if size > 0.0 else (0.0, 0.0)
    turn = limit / size if size > 0.0 else 0.0
    for b in range(a + 1, a + 3):
        own, other = (along, across) if b == a + 1 else (across, along)
        other_b = a + 2 if b == a + 1 else a + 1
        wrong[b] = x[b] - limit * own
        # − turn (I − n nᵀ) (dx − weight dy)
        one, two = -turn * (1.0 - own * own), turn * own * other
        _add_row(columns, n, b, -one * weight, matrix[b])
        _add_row(columns, n, other_b, -two * weight, matrix[b])
        matrix[b, b] += 1.0 + one
        matrix[b, other_b] += two
        if x[a] > 0.0:
            matrix[b, a] -= friction[1] * own


@inner
def _derive_rod(along, problem, a, matrix, wrong):  # type: ignore[no-untyped-def]
    """Set F of a joint: its force is along the rod, and its point at the rod's length from its driven point."""
    n, x, y, columns = problem.size[0], problem.x, problem.y, problem.columns
    size = np.hypot(y[a], y[a + 1])
    first, second = y[a] / size, y[a + 1] / size
    reach = columns[a, a] + columns[a + 1, a + 1]
    wrong[a] = (size - along[2]) / reach
    _add_row(columns, n, a, first / reach, matrix[a])
    _add_row(columns, n, a + 1, second / reach, matrix[a])
    wrong[a + 1] = x[a + 1] * along[0] - x[a] * along[1]
    matrix[a + 1, a], matrix[a + 1, a + 1] = -along[1], along[0]


@inner
def _derive_drive(inverse, problem, a, matrix, wrong):  # type: ignore[no-untyped-def]
    """Set F of a drive: its ports are where they are given to be."""
    n, y = problem.size[0], problem.y
    for b in range(len(inverse)):
        wrong[a + b] = 0.0
        for c in range(len(inverse)):
            wrong[a + b] += inverse[b, c] * y[a + c]
            _add_row(problem.columns, n, a + c, inverse[b, c], matrix[a + b])
