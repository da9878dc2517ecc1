"""One exponential step, in compiled functions: collocation in which vibrations of modes are exact.

The slopes less what vibrates by itself, of modes z' = λ z + n(t), are interpolated by polynomials at the points of
Lobatto, and the equations are integrated exactly with them (exponential methods of collocation; Hochbruck, Ostermann,
Exponential integrators, Acta Numerica 2010, 2.1). With φ_0 = exp and φ_k+1(z) = (φ_k(z) − 1/k!)/z

  z(t) = exp(λ t) z(0) + Σ_k n_k k! t^(k+1) φ_k+1(λ t),  n(t) = Σ_k n_k t^k.

What remains in n couples modes by rotation alone, so that stages are found by substitution.
"""

import numpy as np

from gudgeon.solver.compiled import copy, entry, inner, larger
from gudgeon.solver.integrators.mechanism.arrays import SUMS, TURN, WIDTH
from gudgeon.solver.integrators.mechanism.collocation.convergence import FOUND, OPEN, verdict
from gudgeon.solver.integrators.mechanism.collocation.stage import balance, imbalance, set_stage
from gudgeon.solver.integrators.mechanism.constraints.rows import set_poses
from gudgeon.solver.integrators.mechanism.forces.bushings import set_bushings
from gudgeon.solver.integrators.mechanism.rotation import normalise
from gudgeon.solver.integrators.mechanism.step import largest

ITERATIONS = 12
"""Of the stages at most."""
NEAR = 4.0
"""|z| below which φ are summed as series; above, they follow from each other without loss of digits."""
TERMS = 26
"""Of the series, with which the last one is round-off."""


@inner
def _set_series(z, out):  # type: ignore[no-untyped-def]
    """Set φ_k(z) for k from 0 on."""
    last, inverse = len(out) - 1, 1.0
    if z.real * z.real + z.imag * z.imag >= NEAR * NEAR:
        over = 1.0 / z
        out[0] = np.exp(z)
        for k in range(last):
            out[k + 1] = (out[k] - inverse) * over
            inverse *= 1.0 / (k + 1)
        return
    for k in range(last):
        inverse *= 1.0 / (k + 1)
    term = inverse + 0.0 * z
    out[last] = term
    for n in range(TERMS):
        term *= z * (1.0 / (last + n + 1))
        out[last] += term
    for step in range(last):
        k = last - step
        inverse *= k
        out[k - 1] = z * out[k] + inverse


@inner
def _set_weights(model, waves, course):  # type: ignore[no-untyped-def]
    """Set the weights of modes over a step."""
    nodes, series, stages = course.nodes, waves.series, len(course.nodes.points)
    for b in range(len(model.mass)):
        for k in range(model.elastic[b, 0]):
            for i in range(stages):
                t = course.h * nodes.points[i]
                _set_series(waves.root[b, k] * t, series)
                waves.kept[b, k, i] = series[0]
                for p in range(stages + 1):
                    series[p + 1] *= t
                    t *= nodes.points[i]
                for l in range(stages + 1):
                    total = 0j
                    for p in range(stages + 1):
                        total += nodes.powers[l, p] * series[p + 1]
                    waves.weights[b, k, i, l] = total
            # The last stage is the end.
            total = 0j
            for p in range(stages + 1):
                total += nodes.missed[p] * series[p + 1]
            waves.missed[b, k] = total


@inner
def _set_slope(model, work, waves, course, y, i):  # type: ignore[no-untyped-def]
    """Set the slope at a state, of modes without λ z."""
    out = waves.slopes[i]
    set_stage(model, work, y, course.given[i], course.amounts[i], out)
    for b in range(len(model.mass)):
        m, q, momentum = model.elastic[b, 0], model.elastic[b, 1], model.elastic[b, 2]
        for k in range(m):
            mass = model.modal_root[b, k, k] * model.modal_root[b, k, k]
            v, root = y[momentum + k] / mass, waves.root[b, k]
            slope = out[q + k] - v
            push = out[momentum + k] + model.modal_stiffness[b, k] * y[q + k] + model.modal_damping[b, k] * v
            out[momentum + k] = push / mass - root.real * slope
            out[q + k] = root.imag * slope
    waves.counts[0] += 1


@inner
def _set_mode(model, waves, b, k, z, out):  # type: ignore[no-untyped-def]
    """Set displacement and momentum of a mode by z."""
    root, place = waves.root[b, k], z.imag / waves.root[b, k].imag
    out[model.elastic[b, 1] + k] = place
    mass = model.modal_root[b, k, k] * model.modal_root[b, k, k]
    out[model.elastic[b, 2] + k] = mass * (z.real + root.real * place)


@inner
def _start_of(model, waves, y, b, k):  # type: ignore[no-untyped-def]
    """Return z of a mode at a state."""
    place, root = y[model.elastic[b, 1] + k], waves.root[b, k]
    v = y[model.elastic[b, 2] + k] / (model.modal_root[b, k, k] * model.modal_root[b, k, k])
    return v - root.real * place + 1j * root.imag * place


@inner
def _add_slope(model, slope, weight, out):  # type: ignore[no-untyped-def]
    """Add a slope of a weight to a state, but for its modes."""
    for j in range(WIDTH * len(model.mass)):
        out[j] += weight * slope[j]
    for j in range(len(out) - SUMS, len(out)):
        out[j] += weight * slope[j]


@inner
def _set_state(model, waves, course, y, i, out):  # type: ignore[no-untyped-def]
    """Set the state of a stage by the slopes."""
    slopes = waves.slopes
    copy(y, out)
    for l in range(len(slopes)):
        _add_slope(model, slopes[l], course.h * course.nodes.weights[i, l], out)
    for b in range(len(model.mass)):
        q, momentum = model.elastic[b, 1], model.elastic[b, 2]
        for k in range(model.elastic[b, 0]):
            z = waves.kept[b, k, i] * _start_of(model, waves, y, b, k)
            for l in range(len(slopes)):
                z += waves.weights[b, k, i, l] * complex(slopes[l, momentum + k], slopes[l, q + k])
            _set_mode(model, waves, b, k, z, out)


@inner
def _improve(model, work, waves, course, y):  # type: ignore[no-untyped-def]
    """Set slopes of all stages by their states, and these anew; return the largest weighted change."""
    worst = 0.0
    for i in range(len(waves.states)):
        _set_slope(model, work, waves, course, waves.states[i], 1 + i)
    for i in range(len(waves.states)):
        _set_state(model, waves, course, y, i, waves.other)
        for j in range(len(y)):
            waves.apart[j] = waves.other[j] - waves.states[i, j]
            waves.states[i, j] = waves.other[j]
        worst = larger(worst, largest(model, work, waves.apart, course.weight))
    return worst


@inner
def _converge(model, work, waves, course, y):  # type: ignore[no-untyped-def]
    """Find the stages by substitution; False where it does not converge."""
    before = np.inf
    for _ in range(ITERATIONS):
        change = _improve(model, work, waves, course, y)
        found = verdict(waves.rate, change, before, course)
        if found != OPEN:
            return found == FOUND
        before = change
    return False


@inner
def _error(model, work, waves, course):  # type: ignore[no-untyped-def]
    """Return the largest weighted difference to the method without the slope at the start."""
    apart, nodes = waves.apart, course.nodes
    for j in range(len(apart)):
        apart[j] = 0.0
        for l in range(len(waves.slopes)):
            apart[j] += nodes.leading[l] * waves.slopes[l, j]
    first, last = WIDTH * len(model.mass), len(apart) - SUMS
    for b in range(len(model.mass)):
        q, momentum = model.elastic[b, 1], model.elastic[b, 2]
        for k in range(model.elastic[b, 0]):
            z = waves.missed[b, k] * complex(apart[momentum + k], apart[q + k])
            _set_mode(model, waves, b, k, z, apart)
    for j in range(first):
        apart[j] *= course.h * nodes.lost
    for j in range(last, len(apart)):
        apart[j] *= course.h * nodes.lost
    return largest(model, work, apart, course.weight)


@entry
def exponential_step(model, work, waves, course, y, out):  # type: ignore[no-untyped-def]
    """Set the state after a step from y; `slopes` of the stages have what is guessed of them.

    Returns:
        Estimated error, and whether the stages converged.
    """
    if course.renew:
        _set_weights(model, waves, course)
    _set_slope(model, work, waves, course, y, 0)
    waves.energy[0], before, _ = balance(model, work, y)
    for i in range(len(waves.states)):
        if course.fresh:
            copy(waves.slopes[0], waves.slopes[1 + i])
    for i in range(len(waves.states)):
        _set_state(model, waves, course, y, i, waves.states[i])
    if not _converge(model, work, waves, course, y):
        return np.inf, False
    error = _error(model, work, waves, course)
    copy(waves.states[len(waves.states) - 1], out)
    for b in range(len(model.mass)):
        normalise(out[WIDTH * b + TURN : WIDTH * b + TURN + 4])
    set_poses(model, work, out)
    set_bushings(model, work)
    _, after, size = balance(model, work, out)
    return larger(error, imbalance(before, after, size) * course.energy), True


@entry
def state_within(model, waves, inside, y, out):  # type: ignore[no-untyped-def]
    """Set the state at a place within a step from y; `slopes` are those of the step."""
    nodes, h, x = inside.nodes, inside.h, inside.at
    slopes = waves.slopes
    copy(y, out)
    for l in range(len(slopes)):
        weight, power, factorial = 0.0, h * x, 1.0
        for p in range(len(slopes)):
            factorial *= p + 1
            weight += nodes.powers[l, p] * power / factorial
            power *= x
        _add_slope(model, slopes[l], weight, out)
    for b in range(len(model.mass)):
        q, momentum = model.elastic[b, 1], model.elastic[b, 2]
        for k in range(model.elastic[b, 0]):
            _set_series(waves.root[b, k] * h * x, waves.series)
            z = waves.series[0] * _start_of(model, waves, y, b, k)
            for l in range(len(slopes)):
                total, power = 0j, h * x
                for p in range(len(slopes)):
                    total += nodes.powers[l, p] * power * waves.series[p + 1]
                    power *= x
                z += total * complex(slopes[l, momentum + k], slopes[l, q + k])
            _set_mode(model, waves, b, k, z, out)
