"""One implicit step: collocation at the points of Lobatto with the joints held at each stage, in compiled functions.

Each stage obeys the equations of motion and the rates of the joints' rows (index 2), so that multipliers are unknowns
beside the state. Places drift by the error of the step alone and are projected at its end, as of explicit steps; the
projection takes stiff modes as they resist over the step, so that it does not let them vibrate.
"""

import numpy as np

from gudgeon.solver.compiled import copy, entry, inner, larger
from gudgeon.solver.integrators.mechanism.arrays import PLACE, SPEED, SPIN, TURN, WIDTH
from gudgeon.solver.integrators.mechanism.collocation.convergence import FOUND, OPEN, verdict
from gudgeon.solver.integrators.mechanism.collocation.stage import balance, imbalance, set_stage
from gudgeon.solver.integrators.mechanism.constraints.rows import set_poses
from gudgeon.solver.integrators.mechanism.forces.bushings import set_bushings
from gudgeon.solver.integrators.mechanism.implicit.matrix import keep_start, set_systems, solve_system
from gudgeon.solver.integrators.mechanism.motion import project_places, project_speeds, rates
from gudgeon.solver.integrators.mechanism.rotation import normalise

ITERATIONS = 10
"""Of Newton's method at most."""


@inner
def _set_stages(model, work, newton, course, y):  # type: ignore[no-untyped-def]
    """Set rates of all stages and lacks of their rows."""
    for i in range(len(newton.stages)):
        for j in range(len(y)):
            newton.state[j] = y[j] + newton.stages[i, j]
        copy(newton.multipliers[i], work.multiplier)
        set_stage(model, work, newton.state, course.given[1 + i], course.amounts[1 + i], newton.slopes[i])
        copy(work.right, newton.lacks[i])
    newton.counts[0] += len(newton.stages)


@inner
def _part(z):  # type: ignore[no-untyped-def]
    """Return the larger part of a complex number."""
    return max(abs(z.real), abs(z.imag))


@inner
def _size(model, newton, weight):  # type: ignore[no-untyped-def]
    """Return the largest weighted change in an eigenvector; of momenta as that of velocities."""
    worst = 0.0
    for b in range(len(model.mass)):
        s, q, momentum = WIDTH * b, model.elastic[b, 1], model.elastic[b, 2]
        for i in range(3):
            worst = larger(worst, _part(newton.change[s + PLACE + i]) * weight[s + PLACE + i])
            worst = larger(worst, _part(newton.moved[b, i]) * weight[s + SPEED + i])
            worst = larger(worst, _part(newton.moved[b, 3 + i]) * weight[s + SPIN + i])
        for i in range(4):
            worst = larger(worst, _part(newton.change[s + TURN + i]) * weight[s + TURN + i])
        for k in range(model.elastic[b, 0]):
            worst = larger(worst, _part(newton.change[q + k]) * weight[q + k])
            worst = larger(worst, _part(newton.moved[b, 6 + k]) * weight[momentum + k])
    return worst


@inner
def _change(model, newton, course, y):  # type: ignore[no-untyped-def]
    """Change stages and multipliers by a step of Newton's method; return its size."""
    worst, stages = 0.0, len(newton.stages)
    for i in range(stages):
        for j in range(len(y)):
            newton.step[i, j] = 0.0
        for j in range(len(newton.multiplier)):
            newton.multiplier_step[i, j] = 0.0
    for k in range(len(course.times)):
        for j in range(len(y)):
            newton.right[j] = 0.0
        for j in range(len(newton.lack)):
            newton.lack[j] = 0.0
        for i in range(stages):
            share, own = course.there[k, i], course.times[k] * course.there[k, i]
            for j in range(len(y)):
                slope = newton.slopes[i, j] + course.start[i] * newton.begin[j]
                newton.right[j] += share * slope - own * newton.stages[i, j]
            for j in range(len(newton.lack)):
                newton.lack[j] += share * newton.lacks[i, j]
        solve_system(model, newton, y, k, course.times[k])
        size = _size(model, newton, course.weight)
        for i in range(stages):
            share = course.back[i, k]
            worst = larger(worst, abs(share) * size)
            for j in range(len(y)):
                newton.step[i, j] += share.real * newton.change[j].real - share.imag * newton.change[j].imag
            for j in range(len(newton.multiplier)):
                one = newton.multiplier[j]
                newton.multiplier_step[i, j] += share.real * one.real - share.imag * one.imag
    for i in range(stages):
        for j in range(len(y)):
            newton.stages[i, j] += newton.step[i, j]
        for j in range(len(newton.multiplier)):
            newton.multipliers[i, j] += newton.multiplier_step[i, j]
    return worst


@inner
def _solve_stages(model, work, newton, course, y):  # type: ignore[no-untyped-def]
    """Solve the equations of the stages by Newton's method with the matrix of the start; False where it fails."""
    before = np.inf
    for _ in range(ITERATIONS):
        _set_stages(model, work, newton, course, y)
        change = _change(model, newton, course, y)
        found = verdict(newton.rate, change, before, course)
        if found != OPEN:
            return found == FOUND
        before = change
    return False


@inner
def _estimate(model, newton, course, y, slope):  # type: ignore[no-untyped-def]
    """Return the largest weighted difference to the embedded method, and leave it in `change`."""
    for j in range(len(y)):
        total = course.error_start * slope[j]
        for i in range(len(newton.stages)):
            total += course.error[i] * newton.stages[i, j]
        newton.right[j] = total
    for j in range(len(newton.lack)):
        newton.lack[j] = 0.0
    solve_system(model, newton, y, 0, course.times[0])
    return _size(model, newton, course.weight)


@inner
def _error(model, work, newton, course, y):  # type: ignore[no-untyped-def]
    """Return the estimated error of a step. One above what is asked for is estimated again with the slope beside the
    start, in which stiff modes have lost their own part (Hairer, Wanner, Solving ODE II, IV.8)."""
    found = _estimate(model, newton, course, y, newton.begin)
    if found > course.asked:
        for j in range(len(y)):
            newton.state[j] = y[j] + newton.change[j].real
        copy(newton.held, work.multiplier)
        set_stage(model, work, newton.state, course.given[0], course.amounts[0], newton.slopes[0])
        found = _estimate(model, newton, course, y, newton.slopes[0])
    return found


@inner
def _stiffen(model, stiff, g):  # type: ignore[no-untyped-def]
    """Set a modal inertia that is the diagonal of M + g D + g² K, in which stiff modes hardly move."""
    for b in range(len(model.mass)):
        for k in range(model.elastic[b, 0]):
            root = model.modal_root[b, k, k]
            added = g * (model.modal_damping[b, k] + g * model.modal_stiffness[b, k])
            stiff.modal_root[b, k, k] = np.sqrt(root * root + added)


@entry
def implicit_step(models, work, newton, course, y, out):  # type: ignore[no-untyped-def]
    """Set the state after a step from y; `stages` and `multipliers` have what is guessed of them.

    Args:
        models: The model, and it with a modal inertia of its own, for projections of places.

    Returns:
        Estimated error, the last motion of Newton's method at the projection, and whether that of the stages converged.
    """
    model, stiff = models
    rates(model, work, y, course.given[0], course.amounts[0], newton.begin)
    copy(work.multiplier, newton.held)
    newton.energy[0], before, _ = balance(model, work, y)
    keep_start(model, work, newton)
    if course.fresh:
        for i in range(len(newton.stages)):
            copy(newton.held, newton.multipliers[i])
            for j in range(len(y)):
                newton.stages[i, j] = course.first[i] * newton.begin[j]
    set_systems(model, newton, course.times)
    if not _solve_stages(model, work, newton, course, y):
        return np.inf, 0.0, False
    last, left = len(newton.stages) - 1, 0.0
    for j in range(len(y)):
        out[j] = y[j] + newton.stages[last, j]
    error = _error(model, work, newton, course, y)
    for b in range(len(model.mass)):
        normalise(out[WIDTH * b + TURN : WIDTH * b + TURN + 4])
    if len(model.row_terms):
        _stiffen(model, stiff, 1.0 / course.times[0].real)
        left = project_places(stiff, work, out, course.given[last + 1])
        project_speeds(model, work, out, course.given[last + 1])
    set_poses(model, work, out)
    set_bushings(model, work)
    _, after, size = balance(model, work, out)
    return larger(error, imbalance(before, after, size) * course.energy), left, True
