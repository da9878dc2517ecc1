"""One step of Dormand and Prince's method of order 8 with projection, its estimated error, and its interpolation.

Coefficients are those of DOP853 (Hairer, Nørsett, Wanner, Solving ODE I, II.5 and II.10), which scipy has.
"""

from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853

from gudgeon.solver.compiled import copy, entry, inner, larger
from gudgeon.solver.integrators.mechanism.arrays import ANGLE, NONE, SPEED, SPIN, SURFACE, TURN, WIDTH
from gudgeon.solver.integrators.mechanism.constraints.rows import set_poses, set_poses_at, set_rows, violation
from gudgeon.solver.integrators.mechanism.constraints.solve import solve_least
from gudgeon.solver.integrators.mechanism.flexible.inertia import solve_inertia
from gudgeon.solver.integrators.mechanism.forces.bushings import set_bushings
from gudgeon.solver.integrators.mechanism.motion import (
    prepare,
    project_places,
    project_speeds,
    rates,
    remove_speed_lacks,
    worst_violation,
)
from gudgeon.solver.integrators.mechanism.rotation import normalise
from gudgeon.solver.integrators.mechanism.touching.kernel import (
    ARM,
    set_deflections,
    set_touches,
    wrench_on_journal,
)
from gudgeon.solver.integrators.mechanism.touching.pressing import set_pressing

ORDER = 8
MAIN = 12
"""Stages of a step; the next one is the first of the step that follows."""


class Tableau(NamedTuple):
    """Coefficients of a step of 12 stages, of the 13th at its end, and of 3 more for interpolation."""

    inner: np.ndarray
    """Weights of earlier slopes at each stage, (16, 16)."""
    end: np.ndarray
    """(12,)"""
    fifth: np.ndarray
    """Of the error of an embedded method of order 5, (13,)."""
    third: np.ndarray
    """(13,)"""
    dense: np.ndarray
    """(4, 16)"""


def tableau() -> tuple[Tableau, np.ndarray]:
    """Return the coefficients, and the times of the 16 stages over the step."""
    weights = np.zeros((16, 16))
    weights[:12, :12] = DOP853.A[:12, :12]
    weights[12, :12] = DOP853.B
    weights[13:, :] = DOP853.A_EXTRA
    times = np.concatenate([DOP853.C[:12], [1.0], DOP853.C_EXTRA])
    arrays = (weights, DOP853.B, DOP853.E5, DOP853.E3, DOP853.D)
    return Tableau(*(np.ascontiguousarray(one, float) for one in arrays)), times


class Course(NamedTuple):
    """What a step is taken with."""

    table: Tableau
    given: np.ndarray
    """Drives at the times of the stages, (16, d, 3)."""
    amounts: np.ndarray
    """Loads at these times, (16, l)."""
    weight: np.ndarray
    """Of the error of each number, of a spin that of the angular velocity, (13 n + SUMS,)."""
    project: np.ndarray
    """Whether stages are projected, too: near positions in which joints depend on each other, (1,)."""


@inner
def _set_slope(model, work, course, y, h, s):  # type: ignore[no-untyped-def]
    """Set the slope of a stage. Where stages are projected, rates are those of the nearest state that obeys the joints:
    a smooth function of the state, with the same values on the constraints, so that the order stays."""
    K, stage = work.slopes, work.stage
    for i in range(len(y)):
        stage[i] = y[i]
    for k in range(s):
        weight = h * course.table.inner[s, k]
        if weight != 0.0:
            for i in range(len(y)):
                stage[i] += weight * K[k, i]
    if course.project[0] and len(model.row_terms):
        project_places(model, work, stage, course.given[s])
        project_speeds(model, work, stage, course.given[s])
    rates(model, work, stage, course.given[s], course.amounts[s], K[s])


@inner
def _error(model, work, course, coefficients, h):  # type: ignore[no-untyped-def]
    """Return the largest weighted difference to an embedded method at the end of a step, where S is factored.

    Rates across the constraints do not count, which the projection at the end takes: those of a light body that holds a
    heavy one have the round-off of its reactions, in proportion to the step, so that no step were short enough.
    """
    K, apart = work.slopes, work.stage
    for i in range(len(apart)):
        total = 0.0
        for k in range(MAIN + 1):
            total += coefficients[k] * K[k, i]
        apart[i] = h * total
    _as_velocities(model, work, apart)
    if len(model.row_terms):
        remove_speed_lacks(model, work, apart)
    return _weighted(apart, course.weight)


@inner
def largest(model, work, apart, weight):  # type: ignore[no-untyped-def]
    """Return the largest weighted difference of a state, of spins as angular velocity and of modal momenta as rates, in
    which it leaves them; poses are set."""
    _as_velocities(model, work, apart)
    return _weighted(apart, weight)


@inner
def _weighted(apart, weight):  # type: ignore[no-untyped-def]
    """Return the largest weighted number."""
    worst = 0.0
    for i in range(len(apart)):
        worst = larger(worst, abs(apart[i] * weight[i]))
    return worst


@inner
def _as_velocities(model, work, apart):  # type: ignore[no-untyped-def]
    """Turn differences of spins into those of angular velocity, and of modal momenta into modal rates."""
    for b in range(len(model.mass)):
        if model.elastic[b, 0]:
            _as_rates(model, work, b, apart)
            continue
        s = WIDTH * b + SPIN
        x, y, z = apart[s], apart[s + 1], apart[s + 2]
        for i in range(3):
            apart[s + i] = work.back[b, i, 0] * x + work.back[b, i, 1] * y + work.back[b, i, 2] * z


@inner
def _as_rates(model, work, b, apart):  # type: ignore[no-untyped-def]
    """Turn differences of spin and modal momenta of a body into those of angular velocity and modal rates."""
    s, momentum, m = WIDTH * b + SPIN, model.elastic[b, 2], model.elastic[b, 0]
    values = work.light_error
    for i in range(3):
        values[i] = apart[s + i]
    for k in range(m):
        values[3 + k] = apart[momentum + k]
    solve_inertia(model, work, b, values)
    for i in range(3):
        apart[s + i] = values[i]
    for k in range(m):
        apart[momentum + k] = values[3 + k]


@entry
def step(model, work, course, y, h, out):  # type: ignore[no-untyped-def]
    """Set the state after a step h [s] from y, whose slope is the first of `slopes`.

    Returns:
        Estimated error, and the last motion of Newton's method.
    """
    K, size, table = work.slopes, len(y), course.table
    for s in range(1, MAIN):
        _set_slope(model, work, course, y, h, s)
    for i in range(size):
        total = 0.0
        for k in range(MAIN):
            total += table.end[k] * K[k, i]
        out[i] = y[i] + h * total
    left = 0.0
    for b in range(len(model.mass)):
        normalise(out[WIDTH * b + TURN : WIDTH * b + TURN + 4])
    if len(model.row_terms):
        left = project_places(model, work, out, course.given[MAIN])
        project_speeds(model, work, out, course.given[MAIN])
    rates(model, work, out, course.given[MAIN], course.amounts[MAIN], K[MAIN])
    fifth = _error(model, work, course, table.fifth, h)
    third = _error(model, work, course, table.third, h)
    if fifth == 0.0:
        return 0.0, left
    share = third / fifth  # Squares of either may underflow.
    return fifth / np.sqrt(1.0 + 0.01 * share * share), left


@entry
def interpolation(model, work, course, y, h):  # type: ignore[no-untyped-def]
    """Set the slopes of the three further stages of an accepted step from y."""
    for s in range(MAIN + 1, len(work.slopes)):
        _set_slope(model, work, course, y, h, s)


@entry
def begin(model, work, y, given, amounts):  # type: ignore[no-untyped-def]
    """Set the first slope of a step, at a state y."""
    rates(model, work, y, given, amounts, work.slopes[0])


@entry
def keep_angles(model, work, y):  # type: ignore[no-untyped-def]
    """Take the angles of an accepted state, from which later ones are continued.

    Returns:
        Squares of the largest velocity and angular velocity of a body.
    """
    set_poses(model, work, y)
    set_rows(model, work)
    for t in range(len(model.terms)):
        if model.terms[t, 0] == ANGLE:
            work.turned[t] = work.value[t]
    fastest, turning = 0.0, 0.0
    for b in range(len(model.mass)):
        v, w = y[WIDTH * b + SPEED : WIDTH * b + SPEED + 3], work.omega[b]
        fastest = larger(fastest, v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        turning = larger(turning, w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    return fastest, turning


@entry
def close(model, work, y, given):  # type: ignore[no-untyped-def]
    """Move bodies onto their constraints; return the violation left over its reach."""
    project_places(model, work, y, given)
    set_poses_at(model, work, y, given)
    set_rows(model, work)
    return worst_violation(model, work, given)


@entry
def match(model, work, y, given):  # type: ignore[no-untyped-def]
    """Change velocities so that they obey the constraints."""
    project_speeds(model, work, y, given)


@entry
def read(model, work, y, given, amounts, found):  # type: ignore[no-untyped-def]
    """Set a `Reading` of a state with drives (d, 3) and loads (l,) of its time."""
    prepare(model, work, y, given, amounts, work.lost)
    for j in range(len(model.owner)):
        found.angles[j], found.violations[j] = 0.0, 0.0
        for k in range(6):
            found.wrenches[j, k], found.holds[j, k] = 0.0, 0.0
    for i in range(len(model.touch_pair)):
        if model.touch_shape[i] == SURFACE:
            continue
        wrench = wrench_on_journal(model, work, i, work.touch[i, ARM : ARM + 3])
        for k in range(6):
            found.wrenches[model.touch_pair[i], k] += wrench[k]
            found.holds[model.touch_pair[i], k] += wrench[k]
    if not len(model.row_terms):
        return
    solve_least(work)
    copy(work.multiplier, found.multipliers)
    for t in range(len(model.terms)):
        if model.terms[t, 0] == ANGLE:
            found.angles[model.terms[t, 1]] = work.value[t]
    for i in range(len(model.row_terms)):
        j = model.row_pair[i]
        for part in range(2):
            t = model.row_terms[i, part]
            if t != NONE:
                for k in range(6):
                    push = work.multiplier[i] * model.factors[i, part] * work.slope[t, 1, k]
                    found.holds[model.terms[t, 1], k] += push
                    if j != NONE:
                        found.wrenches[j, k] += push
        if j != NONE:
            lacks = abs(violation(model, work, given, i)) / model.reach[i]
            if not lacks <= found.violations[j]:
                found.violations[j] = lacks


@entry
def observe(model, work, y):  # type: ignore[no-untyped-def]
    """Set angular velocities and modal rates of a state, in `omega` and `modal`, all points, bushings and sections."""
    set_poses(model, work, y)
    set_bushings(model, work)
    set_deflections(work, y)
    set_touches(model, work)
    set_pressing(model, work, y)
