"""The responses of all candidates of a step together: sweeps over the ports with Anderson's mixing.

A sweep lets every block of ports respond to the measures y = y₀ + M x as they are (Gauss-Seidel), cones under-relaxed
(a projection onto the disc μ fₙ after one onto fₙ ≥ 0). The last sweeps are mixed so that their residuals cancel best
(D. G. Anderson, J. ACM 12 (1965) 547-560); M x is kept up to date, so that a sweep costs one product with M.
"""

import numpy as np

from gudgeon.solver.compiled import copy, embedded, entry, inner, unpacked
from gudgeon.solver.contact.pattern import first_from
from gudgeon.solver.integrators.general.arrays import (
    BILATERAL,
    CONE,
    DRIVEN,
    RUBBING_LAW,
    SPRING,
    UNILATERAL,
)
from gudgeon.solver.integrators.general.rows import add_row
from gudgeon.solver.integrators.general.slides import coupling, gather_sliding
from gudgeon.solver.integrators.general.solution.acting import begin_acting, choose, end_acting, list_acting, measure
from gudgeon.solver.integrators.general.solution.closed import close
from gudgeon.solver.integrators.general.solution.holding import make_reachable
from gudgeon.solver.integrators.general.solution.mixing import WINDOW, mix
from gudgeon.solver.integrators.general.solution.newton import allowed, natural_residual, newton, renew
from gudgeon.solver.integrators.general.solution.responses import (
    compliant_force,
    held_or_rubbed,
    presses,
    stiffness,
)

RELAXATION = 0.7
"""Of cones: two trials with the residual flexibility of a part need 40 sweeps with it, 55 at 1."""
GAIN = 1e6
"""Largest force over that of a port's own flexibility: forces that push each other in would grow without end."""
UNDECIDED = 40
"""Sweeps in which a cone may change between static and kinetic friction; where the force that holds it is between them,
it would do so without end."""
MOST_SWEEPS = 150
TOLERANCE = 1e-11
"""Residual of a solution, relative to the largest force, at which sweeps end."""
NEAR = 100.0
"""Change of the forces in a sweep over the residual that is allowed, above which the residual is not looked at."""
LOOKS = 4
"""Sweeps after which the residual that is allowed is found again, of changes that are not near to it."""
FIRST_SWEEPS = 6
"""Before Newton's method, which without them goes to and fro where slip turns round."""
LAST_TOLERANCE = 1e-9
"""As `TOLERANCE`, of Newton's method: the round-off of its factor."""


@entry
def solve(kept):  # type: ignore[no-untyped-def]
    """Find the unknowns and measures of all candidates from the unknowns that they have; False where none are found."""
    arrays = unpacked(kept)
    constants, state, problem = arrays.constants, arrays.state, arrays.problem
    if constants.plain:
        return close(constants, state, problem)
    ports, free, gap = problem.ports[: problem.size[0]], problem.free, state.gap
    for i in ports:
        free[i] = gap[i]
    for i in ports:
        if state.extra[i] != 0.0:
            add_means(constants, state, problem, i, state.extra[i])
    count, sound = begin_acting(state, problem), True
    if not constants.slides:
        measure(constants, state, problem, count)
    while sound and choose(constants, state, problem, count):
        list_acting(constants, problem, count)
        sound = _balanced(constants, state, problem)
        if not constants.slides:
            measure(constants, state, problem, count)
        for a in range(problem.size[0]):
            i = problem.ports[a]
            state.unknown[i], state.measure[i] = problem.x[a], problem.y[a]
    end_acting(problem, count)
    for i in ports:
        free[i] = state.measure[i]
    return sound


@embedded
def add_means(constants, state, problem, j, amount):  # type: ignore[no-untyped-def]
    """Add what a mean force of port j [N] does to the measures of the candidates."""
    if constants.slides:
        for a in range(problem.size[0]):
            i = problem.ports[a]
            problem.free[i] += amount * coupling(constants.pattern, constants.inertia, state.slides, j, i)
    else:
        add_row(constants.pattern, constants.inertia, (j, amount), problem.ports[: problem.size[0]], problem.free)


@inner
def _gather(constants, state, problem):  # type: ignore[no-untyped-def]
    """Gather the columns of the candidates."""
    n, pattern, ports = problem.size[0], constants.pattern, problem.ports
    for a in range(n):
        column, own = problem.columns[a], pattern.group[ports[a]]
        if constants.slides:
            gather_sliding(constants, state.slides, problem, a)
        else:
            column[:n] = 0.0
            for r in range(pattern.span[own, 0], pattern.span[own, 1]):
                first, last = pattern.runs[r, 0], pattern.runs[r, 1]
                source = constants.columns[pattern.at[ports[a]] + pattern.runs[r, 2] + first :]
                for c in range(first_from(ports, n, first), first_from(ports, n, last)):
                    column[c] = source[ports[c] - first]
        problem.weight[a] = np.sqrt(column[a])
    for a in range(n):
        problem.stiff[a] = stiffness(problem.columns, a, 1)
    for a in range(n):
        if constants.size[ports[a]] == 3 and constants.kind[ports[a]] != DRIVEN:
            problem.stiff[a + 1] = problem.stiff[a + 2] = stiffness(problem.columns, a + 1, 2)
    problem.size[1] = n


@inner
def _balanced(constants, state, problem):  # type: ignore[no-untyped-def]
    """Find the forces by sweeps, else by Newton's method after a few sweeps; False where neither does."""
    if problem.size[1] != problem.size[0]:
        _gather(constants, state, problem)
    found = _found(constants, state, problem)
    # Of points that no motion reaches at once, the forces against each other have no bound but those of slip.
    if not found and make_reachable(constants, state, problem):
        found = _found(constants, state, problem)
    if found:
        _release(constants, state, problem)
    return found


@inner
def _found(constants, state, problem):  # type: ignore[no-untyped-def]
    """As `_balanced`, of the places where points are held."""
    bound = _begin(constants, state, problem)
    found = _swept(constants, state, problem, (MOST_SWEEPS, WINDOW), bound)
    # From where sweeps came, then from a few: far from the forces the one goes to and fro, near to them the other.
    found = found or newton(constants, state, problem, LAST_TOLERANCE, bound)
    if not found:
        _begin(constants, state, problem)
        found = _swept(constants, state, problem, (FIRST_SWEEPS, 0), bound)
    return found or newton(constants, state, problem, LAST_TOLERANCE, bound)


@inner
def _release(constants, state, problem):  # type: ignore[no-untyped-def]
    """Open the contact whose response is no force: what is left of it within the tolerance would never end."""
    x, y, columns = problem.x[: problem.size[0]], problem.y[: problem.size[0]], problem.columns
    for a in range(len(x)):
        i = problem.ports[a]
        kind, size, reach = constants.kind[i], constants.size[i], columns[a, a]
        if size == 0 or not presses(kind):
            continue
        if reach <= 0.0:
            force = 0.0
        elif kind in (UNILATERAL, CONE):
            force = x[a] - y[a] / reach
        else:
            force = _lawful(constants, state, i, y[a] - reach * x[a], reach)
        if force <= 0.0:
            for b in range(a, a + size):
                _change(columns[b], x, y, b, 0.0)


@inner
def _lawful(constants, state, i, free, reach):  # type: ignore[no-untyped-def]
    """Return the force [N] of a law or spring whose displacement is `free` [m] without it."""
    ends, before = constants.share[i] < 1.0, state.displacement[1, i]
    knots = constants.knots[constants.table[i, 0] : constants.table[i, 1]]
    given = (constants.law[i], state.approach[i], knots)
    return compliant_force(constants.kind[i] == SPRING, given, (before, free), reach, constants.dt[0], ends)


@inner
def _begin(constants, state, problem):  # type: ignore[no-untyped-def]
    """Set unknowns and measures of the candidates to those of the unknowns at the start.

    Returns:
        Bound of the forces [N] that a residual is relative to, and the largest force at the start [N].
    """
    n, largest, held = problem.size[0], 0.0, 0.0
    x, y, columns = problem.x[:n], problem.y[:n], problem.columns
    for a in range(n):
        i = problem.ports[a]
        x[a], y[a] = state.unknown[i], problem.free[i] if constants.slides else state.measure[i]
        problem.slipped[i] = state.sliding[i]
    for a in range(n if constants.slides else 0):
        if x[a] != 0.0:
            column, amount = columns[a], x[a]
            for c in range(len(y)):
                y[c] += amount * column[c]
    for a in range(n):
        if columns[a, a] > 0.0:
            held = max(held, abs(x[a]))
            largest = max(largest, held, abs(problem.free[problem.ports[a]]) / columns[a, a])
    return GAIN * largest, held


@inner
def _swept(constants, state, problem, turns, bound):  # type: ignore[no-untyped-def]
    """Sweep over the candidates until the residual is within its tolerance; False where that takes too long.

    Args:
        turns: Largest number of sweeps, and how many are mixed.
        bound: As `_begin` returns both.
    """
    most, window = turns
    n = problem.size[0]
    x, start, weight = problem.x[:n], problem.start[:n], problem.weight[:n]
    before, within = 0.0, 0.0
    problem.size[4] = 0
    for sweep in range(most):
        copy(x, start)
        blocks = _sweep(constants, state, problem, sweep >= UNDECIDED)
        size, change = 0.0, 0.0
        if sweep % LOOKS == 0:
            within = allowed(constants, state, problem, TOLERANCE, bound)
        for a in range(n):
            size += (weight[a] * (x[a] - start[a])) ** 2
            change += (x[a] - start[a]) ** 2
        state.counts[3] += 1
        if sweep == 0 or change <= (NEAR * within) ** 2:
            within = allowed(constants, state, problem, TOLERANCE, bound)
            if natural_residual(constants, problem) <= within**2:
                renew(problem)
                if natural_residual(constants, problem) <= within**2:
                    return True
        if blocks == 1 and constants.size[problem.ports[0]] == 1 and size < np.inf:
            return True
        if sweep > 0 and size > 4.0 * before:
            problem.size[4] = 0
        before = size
        if window > 0 and sweep + 1 < most:
            problem.size[4] = mix(problem, n, sweep)
    return False


@inner
def _sweep(constants, state, problem, decided):  # type: ignore[no-untyped-def]
    """Let every block respond once; returns the number of blocks.

    Args:
        decided: Whether what slips goes on to slip in this step.
    """
    n, blocks, ports, kinds, sizes = problem.size[0], 0, problem.ports, constants.kind, constants.size
    x, y, columns, friction = problem.x[:n], problem.y[:n], problem.columns, constants.friction
    slipped, stiff = problem.slipped, problem.stiff
    for a in range(n):
        i = ports[a]
        kind, size = kinds[i], sizes[i]
        if size == 0:
            continue
        blocks += 1
        if kind == BILATERAL:
            _hold(state.rod[constants.joint[i]], a, x, y, columns)
        elif kind == DRIVEN:
            _drive(constants.inverse[i : i + size, :size], a, problem, (x, y))
        elif not _idle(kind, size, a, x, y):
            old, wrong = x[a], y[a] * stiff[a]
            if stiff[a] == 0.0 and presses(kind):
                normal = 0.0  # No force moves it.
            elif kind == UNILATERAL:
                normal = max(0.0, old - wrong)
            elif kind == CONE:
                normal = max(0.0, old - RELAXATION * wrong)
            else:
                normal = _lawful(constants, state, i, y[a] - columns[a, a] * old, columns[a, a])
                if kind == RUBBING_LAW and normal > 0.0:
                    normal = max(0.0, old + RELAXATION * (normal - old))
            if size == 3:
                limit, step = (friction[i, 0] * normal, friction[i, 1] * normal), normal - old
                forces = (x[a + 1], x[a + 2])
                measures = (y[a + 1] + step * columns[a, a + 1], y[a + 2] + step * columns[a, a + 2])
                first, second, slips = held_or_rubbed(stiff[a + 1], limit, slipped[i], forces, measures)
                slipped[i] = slipped[i] or (decided and slips)
                _change_three(columns, x, y, a, (normal, first, second))
            else:
                _change(columns[a], x, y, a, normal)
    return blocks


@inner
def _idle(kind, size, a, x, y):  # type: ignore[no-untyped-def]
    """Whether a unilateral port is open and stays so."""
    open_ = kind in (UNILATERAL, CONE) and x[a] == 0.0 and y[a] >= 0.0
    return open_ and (size == 1 or (x[a + 1] == 0.0 and x[a + 2] == 0.0))


@inner
def _change(column, x, y, a, value):  # type: ignore[no-untyped-def]
    """Set an unknown, and all measures by its change."""
    step = value - x[a]
    if step != 0.0:
        for c in range(len(y)):
            y[c] += step * column[c]
        x[a] = value


@inner
def _change_three(columns, x, y, a, values):  # type: ignore[no-untyped-def]
    """Set the unknowns of candidate a and of the two after it, and all measures by their changes."""
    one, two, three = values[0] - x[a], values[1] - x[a + 1], values[2] - x[a + 2]
    first, second, third = columns[a], columns[a + 1], columns[a + 2]
    for c in range(len(y)):
        y[c] += one * first[c] + (two * second[c] + three * third[c])
    x[a], x[a + 1], x[a + 2] = values


@inner
def _hold(along, a, x, y, columns):  # type: ignore[no-untyped-def]
    """Hold the distance of a joint's point from its driven point, by a force along the rod's direction in the step."""
    length = along[2]
    last = x[a] * along[0] + x[a + 1] * along[1]
    _change(columns[a], x, y, a, last * along[0])
    _change(columns[a + 1], x, y, a + 1, last * along[1])
    for _turn in range(2):
        size = np.hypot(y[a], y[a + 1])
        n0, n1 = y[a] / size, y[a + 1] / size
        give = n0 * (columns[a, a] * along[0] + columns[a + 1, a] * along[1])
        give += n1 * (columns[a, a + 1] * along[0] + columns[a + 1, a + 1] * along[1])
        force = (length - size) / give
        _change(columns[a], x, y, a, x[a] + force * along[0])
        _change(columns[a + 1], x, y, a + 1, x[a + 1] + force * along[1])


@inner
def _drive(inverse, a, problem, arrays):  # type: ignore[no-untyped-def]
    """Bring the ports of a drive, candidates from a on, to where they are given to be."""
    x, y = arrays
    for b in range(len(inverse)):
        for c in range(len(inverse)):
            x[a + b] -= inverse[b, c] * y[a + c]
    for b in range(len(inverse)):
        column, step = problem.columns[a + b], x[a + b] - problem.start[a + b]
        for c in range(len(y)):
            y[c] += step * column[c]
