"""Forces of points that press by flexibilities, which close their gaps; equations and arrays stand in `surfaces`."""

import numpy as np

from gudgeon.solver.compiled import inner
from gudgeon.solver.integrators.mechanism.arrays import NONE


@inner
def over(work, p, kind, width, values):  # type: ignore[no-untyped-def]
    """Return the weighted sum of values over the functions that a point touches, with N or one of its slopes.

    Args:
        width: Functions along; zero before the ground, which has none.
    """
    if width == 0:
        return 0.0
    first, weights, total = work.pressing.first[p], work.pressing.weights[p, kind], 0.0
    for k in range(4):
        for l in range(4):
            total += weights[4 * k + l] * values[first + k * width + l]
    return total


@inner
def between(model, work, p, q):  # type: ignore[no-untyped-def]
    """Return how R moves a point along its direction by a unit force on another one of its body [m/N]."""
    R, m, n = model.surfaces.residual[p, q], work.pressing.inward[p], work.pressing.inward[q]
    total = 0.0
    for i in range(3):
        total += m[i] * (R[i, 0] * n[0] + R[i, 1] * n[1] + R[i, 2] * n[2])
    return total


@inner
def set_forces(model, work, first):  # type: ignore[no-untyped-def]
    """Set the forces of points that press by flexibilities, which close their gaps; return how many there are."""
    f, found, count = model.surfaces, work.pressing, 0
    found.stored[0] = 0.0
    for s in range(len(f.owner)):
        if not found.live[s] or f.by_law[s]:
            continue
        for p in range(f.points[s, 0], f.points[s, 1]):
            if found.near[p]:
                _set_mixed(model, work, p)
            if found.near[p] and work.touching[first + p]:
                found.active[count] = p
                count += 1
                _push_functions(model, work, s, p)
    A, a, active = found.matrix, 0, found.active
    for s in range(len(f.owner)):
        for p in range(f.points[s, 0], f.points[s, 1]):
            if a == count or active[a] != p:
                continue
            for b in range(a + 1):
                A[a, b] = between(model, work, p, active[b]) + over(work, p, 0, f.counts[s, 1], found.pushed[active[b]])
            A[a, a] += f.layer[p]
            a += 1
    if len(f.mixed) > 0:
        _couple(model, work, count)
    _solve(work, count)
    return count


@inner
def _solve(work, count):  # type: ignore[no-untyped-def]
    """Factor the compliance of the points that press, and set their forces and the energy that they hold."""
    found, A, active = work.pressing, work.pressing.matrix, work.pressing.active
    for a in range(count):
        for b in range(a + 1):
            total = A[a, b]
            for k in range(b):
                total -= A[a, k] * A[b, k]
            A[a, b] = total / A[b, b] if a > b else (np.sqrt(total) if total > 0.0 else np.nan)
    for a in range(count):
        total = -found.gap[active[a]]
        for k in range(a):
            total -= A[a, k] * found.force[active[k]]
        found.force[active[a]] = total / A[a, a]
    for step in range(count):
        a = count - 1 - step
        total = found.force[active[a]]
        for k in range(a + 1, count):
            total -= A[k, a] * found.force[active[k]]
        found.force[active[a]] = total / A[a, a]
        found.stored[0] -= 0.5 * found.force[active[a]] * found.gap[active[a]]


@inner
def _set_mixed(model, work, p):  # type: ignore[no-untyped-def]
    """Set the inward displacement of a point by inward forces on functions of its body."""
    f, m = model.surfaces, work.pressing.inward[p]
    for b in range(f.mixed.shape[2] if len(f.mixed) > 0 else 0):
        moved = m[0] * f.mixed[p, 0, b] + m[1] * f.mixed[p, 1, b] + m[2] * f.mixed[p, 2, b]
        work.pressing.mixed[p, b] = -moved


@inner
def _couple(model, work, count):  # type: ignore[no-untyped-def]
    """Add to the compliance how points move by what presses on functions of their own body."""
    f, found, b = model.surfaces, work.pressing, 0
    for s in range(len(f.owner)):
        for p in range(f.points[s, 0], f.points[s, 1]):
            if b < count and found.active[b] == p:
                for a in range(b, count):
                    found.matrix[a, b] += over(work, p, 0, f.counts[s, 1], found.mixed[found.active[a]])
                b += 1


@inner
def _load(model, work, count):  # type: ignore[no-untyped-def]
    """Set the forces on functions."""
    f, found, b = model.surfaces, work.pressing, 0
    found.loaded[:] = 0.0
    for s in range(len(f.owner)):
        for p in range(f.points[s, 0], f.points[s, 1]):
            if b < count and found.active[b] == p:
                b += 1
                if f.owner[s, 1] == NONE:
                    continue
                for k in range(4):
                    for l in range(4):
                        at = found.first[p] + k * f.counts[s, 1] + l
                        found.loaded[at] += found.force[p] * found.weights[p, 0, 4 * k + l]


@inner
def _push_functions(model, work, s, p):  # type: ignore[no-untyped-def]
    """Set the inward displacement of the functions of the surfaces that may be met by a unit force of a point."""
    f, found = model.surfaces, work.pressing
    for other in range(len(f.owner)):
        if not found.live[other]:
            continue
        same = f.owner[other, 1] == f.owner[s, 1]
        for b in range(f.functions[other, 0], f.functions[other, 1]):
            found.pushed[p, b] = over(work, p, 0, f.counts[s, 1], f.compliance[b]) if same else 0.0
            if len(f.mixed) > 0:
                found.pushed[p, b] += found.mixed[p, b]


@inner
def set_dents(model, work, count):  # type: ignore[no-untyped-def]
    """Set how forces move functions, and points before the ground."""
    f, found = model.surfaces, work.pressing
    if len(f.mixed) > 0:
        _load(model, work, count)
    for s in range(len(f.owner)):
        if not found.live[s]:
            continue
        for b in range(f.functions[s, 0], f.functions[s, 1]):
            total = 0.0
            for a in range(count):
                total += found.force[found.active[a]] * found.pushed[found.active[a], b]
            found.dents[b] = total
        if f.owner[s, 1] == NONE:
            for p in range(f.points[s, 0], f.points[s, 1]):
                if found.force[p] != 0.0:
                    _move(model, work, p, count)


@inner
def _move(model, work, p, count):  # type: ignore[no-untyped-def]
    """Set how R moves a point by all forces on its body."""
    f, found = model.surfaces, work.pressing
    for i in range(3):
        total = 0.0
        for a in range(count):
            q = found.active[a]
            R, n = f.residual[p, q, i], found.inward[q]
            total += (R[0] * n[0] + R[1] * n[1] + R[2] * n[2]) * found.force[q]
        for b in range(len(found.loaded) if len(f.mixed) > 0 else 0):
            total -= f.mixed[p, i, b] * found.loaded[b]
        found.moved[p, i] = total


@inner
def forced_out(model, work, s, p, count):  # type: ignore[no-untyped-def]
    """Return how forces open the gap of a point that does not press [m]."""
    f, found = model.surfaces, work.pressing
    total = over(work, p, 0, f.counts[s, 1], found.dents)
    for k in range(count):
        total += between(model, work, p, found.active[k]) * found.force[found.active[k]]
    for b in range(len(found.loaded) if len(f.mixed) > 0 else 0):
        total += found.mixed[p, b] * found.loaded[b]
    return total
