"""The tool behind its virtual coupling, in compiled functions; all in the tool's own units.

The handle at x pulls the tool at y over the coupling's energy φ(y − x), quadratic up to a largest force and linear
beyond (Huber). The tool stands where U(y) + φ(y − x) is least, U = −Σ G of its fields plus ½ yᵀ K y, beginning from
where it stood: with F = −∇U, φ′(y − x) = F(y). The handle feels −∂φ/∂x, the gradient of this least energy over x: a
conservative force whose restoring stiffness nowhere exceeds that of the coupling.
"""

import numpy as np

from gudgeon.solver.compiled import allocating, inner
from gudgeon.solver.forces.fields.co_energy import LEFT, evaluate

DESCENTS, HALVINGS = 60, 20
"""Steps of a search at most, and of the length of one."""
ENOUGH, LEAST, ROUND_OFF = 1e-16, 1e-4, 1e-15
"""Square of what is left of the force over the whole, fall of the energy over that of a whole step, and change of the
energy relative to itself, at which a search ends. The energy at its end has an error of the first."""
CLOSER = 48
"""Halvings towards the end of a field."""
LONGEST = 100.0
"""Length of a step over that of a field without stiffness, at most."""


@inner
def _rotation(v, Q, J):  # type: ignore[no-untyped-def]
    """Set the matrix of a rotation vector, and J with which it turns at J dv/dt."""
    angle = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    a, b, c = 1.0 - angle * angle / 6.0, 0.5 - angle * angle / 24.0, 1.0 / 6.0 - angle * angle / 120.0
    if angle > 1e-3:
        a, b = np.sin(angle) / angle, (1.0 - np.cos(angle)) / (angle * angle)
        c = (1.0 - a) / (angle * angle)
    for i in range(3):
        for j in range(3):
            square = v[i] * v[j] - (angle * angle if i == j else 0.0)
            skew = 0.0
            if i != j:
                skew = v[3 - i - j] * (1.0 if (i + 1) % 3 == j else -1.0)
            # The matrix of v × has −v_k at (i, i + 1), k the third.
            Q[i, j] = (1.0 if i == j else 0.0) - a * skew + b * square
            J[i, j] = (1.0 if i == j else 0.0) - b * skew + c * square


@inner
def _energy(tool, x, found):  # type: ignore[no-untyped-def]
    """Return U of the tool at x, and set F = −∇U in `found` (6,); infinite outside of a field."""
    fields, links, stiffness, work = tool
    Q, J, pose, out = work.Q, work.J, work.pose, work.out
    _rotation(x[3:6], Q, J)
    total = 0.0
    for i in range(6):
        found[i] = 0.0
        for j in range(6):
            found[i] -= stiffness[i, j] * x[j]
        total -= 0.5 * found[i] * x[i]
    for n in range(len(fields.head)):
        link = links[n]
        arm = work.arm
        for i in range(3):
            arm[i] = Q[i, 0] * link[0] + Q[i, 1] * link[1] + Q[i, 2] * link[2]
        for k in range(3):
            pose[k], pose[3 + k] = link[3 + k], 0.0
            for i in range(3):
                pose[k] += link[6 + 3 * i + k] * (x[i] + arm[i] - link[i])
                pose[3 + k] += link[6 + 3 * i + k] * x[3 + i]
        for k in range(6):
            pose[k] *= work.active[n, k]
        out[LEFT] = 0.0
        evaluate(fields, n, pose, work.basis, out)
        if out[LEFT] != 0.0:
            return np.inf
        total -= out[0]
        f = work.force
        for i in range(3):
            f[i], f[3 + i] = 0.0, 0.0
            for k in range(3):
                f[i] += link[6 + 3 * i + k] * out[1 + k] * work.active[n, k]
                f[3 + i] += link[6 + 3 * i + k] * out[4 + k] * work.active[n, 3 + k]
        t0, t1 = arm[1] * f[2] - arm[2] * f[1], arm[2] * f[0] - arm[0] * f[2]
        t2 = arm[0] * f[1] - arm[1] * f[0]
        for i in range(3):
            found[i] += f[i]
            found[3 + i] += f[3 + i] + J[0, i] * t0 + J[1, i] * t1 + J[2, i] * t2
    return total


@inner
def _coupled(x, y, stiffness, most, first, force):  # type: ignore[no-untyped-def]
    """Return the coupling's energy of three motions from `first` on, and set its force on the handle."""
    size = 0.0
    for i in range(first, first + 3):
        size += (y[i] - x[i]) ** 2
    size = np.sqrt(size)
    limit = most / stiffness
    factor = stiffness if size <= limit else most / size
    for i in range(first, first + 3):
        force[i] = factor * (y[i] - x[i])
    return 0.5 * stiffness * size * size if size <= limit else most * (size - 0.5 * limit)


@inner
def _merit(tool, x, y, coupling, push):  # type: ignore[no-untyped-def]
    """Return U(y) + φ(y − x), and set the force on the tool less that of the coupling, (6,)."""
    pull = tool[3].pull
    total = _energy(tool, y, push)
    total += _coupled(x, y, coupling[0], coupling[1], 0, pull)
    total += _coupled(x, y, coupling[2], coupling[3], 3, pull)
    for i in range(6):
        push[i] -= pull[i]
    return total


@inner
def settle(tool, x, y, coupling, wrench):  # type: ignore[no-untyped-def]
    """Move the tool from y to where its energy is least for a handle at x; return that energy, and set the wrench.

    Args:
        coupling: Stiffness and largest force of translations, and of rotations, (4,).
    """
    work = tool[3]
    push, trial, other = work.push, work.trial, work.other
    energy = _merit(tool, x, y, coupling, push)
    share = 1.0
    for _ in range(DESCENTS):
        gain, size = 0.0, 0.0
        for i in range(6):
            k = coupling[0] if i < 3 else coupling[2]
            gain += push[i] * push[i] / k
            size += work.pull[i] * work.pull[i] / k
        if gain <= ENOUGH * size:
            break
        moved, now = False, energy
        for _half in range(HALVINGS):
            for i in range(6):
                trial[i] = y[i] + share * push[i] / (coupling[0] if i < 3 else coupling[2])
            now = _merit(tool, x, trial, coupling, other)
            if now <= energy - 1e-4 * share * gain + ROUND_OFF * abs(energy):
                moved = True
                break
            share *= 0.5
        if not moved or share < 1e-3:
            before = energy
            energy = _one_by_one(tool, x, y, coupling, energy)
            _merit(tool, x, y, coupling, push)
            share = 1.0
            if not before - energy > LEAST * gain:
                break
            continue
        # The next step by Barzilai and Borwein, along one coordinate that of the secant.
        square, bend, least = 0.0, 0.0, 0.0
        for i in range(6):
            k = coupling[0] if i < 3 else coupling[2]
            step = trial[i] - y[i]
            square += k * step * step
            bend += step * (push[i] - other[i])
            least += other[i] * other[i] / k
            y[i], push[i] = trial[i], other[i]
        fell = energy - now
        energy = now
        if fell <= ROUND_OFF * abs(energy) and least >= gain:
            break
        share = min(LONGEST, max(1e-2, square / bend)) if bend > 0.0 else min(LONGEST, 4.0 * share)
    _merit(tool, x, y, coupling, push)
    for i in range(6):
        wrench[i] = work.pull[i]
    return energy


@inner
def _one_by_one(tool, x, y, coupling, energy):  # type: ignore[no-untyped-def]
    """Move one coordinate after the other, so that a tool at the end of a field slides along it; return the energy."""
    work = tool[3]
    push, trial, other = work.push, work.trial, work.other
    for i in range(6):
        _merit(tool, x, y, coupling, push)
        step = push[i] / (coupling[0] if i < 3 else coupling[2])
        if step == 0.0:
            continue
        for _half in range(CLOSER):
            for k in range(6):
                trial[k] = y[k]
            trial[i] += step
            now = _merit(tool, x, trial, coupling, other)
            if now < energy:
                energy = now
                y[i] = trial[i]
            # Halved also where it was taken: the end of a field is found to round-off.
            step *= 0.5
    _merit(tool, x, y, coupling, push)
    return energy


@allocating
def settled(tool, x, y, coupling):  # type: ignore[no-untyped-def]
    """Return the least energy, and the wrench on the handle, (6,); y is moved. See `settle`."""
    wrench = np.zeros(6)
    return settle(tool, x, y, coupling, wrench), wrench


@allocating
def energy_at(tool, x):  # type: ignore[no-untyped-def]
    """Return U of the tool at x, infinite outside of a field, and the force on it, (6,)."""
    force = np.zeros(6)
    return _energy(tool, x, force), force
