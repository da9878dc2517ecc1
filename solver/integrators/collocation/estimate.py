"""Error estimates of a collocation step, compiled."""

import numpy as np

from gudgeon.solver.compiled import inner
from gudgeon.solver.laws.force import law_energy

POINTS = np.array([0.0, 0.5 * (1 - 5**-0.5), 0.5 * (1 + 5**-0.5), 1.0])
WEIGHTS = np.array([1.0, 5.0, 5.0, 1.0]) / 12
MONOMIALS = np.linalg.inv(np.vander(POINTS, 4, increasing=True)).T
"""Coefficient of (τ/h)^m in the cubic that is 1 at one point and 0 at the others, (4 points, 4 m)."""
SPAN = 0.0131
"""Largest |Π (x − x_j)| of the four points within a step."""


@inner
def cubic(k, x):  # type: ignore[no-untyped-def]
    """Return at x the cubic that is 1 at point k."""
    return MONOMIALS[k, 0] + x * (MONOMIALS[k, 1] + x * (MONOMIALS[k, 2] + x * MONOMIALS[k, 3]))


@inner
def missed(before, last, h, values):  # type: ignore[no-untyped-def]
    """Return the interpolation error within a step [N], from the cubics' error at a point of the step before.

    Args:
        before: Forces of the step before [N], (c, 4).
        last: Its length [s], 0 where there is none.
    """
    if last <= 0.0:
        return 0.0
    x = -last * (1 - POINTS[1]) / h
    remainder = abs(x * (x - POINTS[1]) * (x - POINTS[2]) * (x - 1.0))
    worst = 0.0
    for i in range(len(values)):
        total = 0.0
        for k in range(4):
            total += values[i, k] * cubic(k, x)
        worst = max(worst, abs(total - before[i, 1]))
    return worst * SPAN / remainder


@inner
def unbalanced(laws, reference, h, values, depth, rate):  # type: ignore[no-untyped-def]
    """Return the quadrature error of elastic energy, as a force [N]: relative to the energy of a reference force.

    Beside a dashpot, a surface returns energy at almost no force, where the error of the force shows nothing.
    """
    worst = 0.0
    for i in range(len(values)):
        stiffness, exponent = laws[i, 0], laws[i, 1]
        largest = 0.0
        for j in range(4):
            largest = max(largest, values[i, j])
        if largest == 0.0 or stiffness <= 0.0:
            continue
        wrong = law_energy(laws[i], depth[i, 0]) - law_energy(laws[i], depth[i, 3])
        for j in range(4):
            if depth[i, j] > 0.0:
                wrong += h * WEIGHTS[j] * (exponent + 1) * law_energy(laws[i], depth[i, j]) / depth[i, j] * rate[i, j]
        worst = max(worst, abs(wrong) * (exponent + 1) * (stiffness / reference) ** (1 / exponent))
    return worst
