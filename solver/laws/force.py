"""The force of every law, its energy and its mean over a step, compiled."""

import numpy as np

from gudgeon.solver.compiled import entry, inner

CLOSE = 1e-3
"""Relative difference of d₀ and d₁ below which the quotient is a Gauss integral, whose error is below 1e-20."""
GAUSS_POINTS = np.array([0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263])
GAUSS_WEIGHTS = np.array([0.17392742256872693, 0.32607257743127307, 0.32607257743127307, 0.17392742256872693])


@entry
def law_force(coefficients, d, rate, approach):  # type: ignore[no-untyped-def]
    """Return F = max(0, K dⁿ (1 + χ ḋ/v⁻) + c ḋ) [N] with dF/dd [N/m] and dF/dḋ [N s/m]; zeros where nothing presses.

    Args:
        coefficients: K, n, χ, c, (4,).
        d: Indentation [m].
        rate: ḋ [m/s].
        approach: v⁻ [m/s], the rate at which this contact began; a contact that began at rest, 0, has no loss χ.
    """
    if d <= 0:
        return 0.0, 0.0, 0.0
    stiffness, exponent, damping = coefficients[0], coefficients[1], coefficients[3]
    per_rate = coefficients[2] / approach if approach > 0 else 0.0
    elastic = stiffness * _power(d, exponent)
    swell = 1 + per_rate * rate
    force = elastic * swell + damping * rate
    if force <= 0:
        return 0.0, 0.0, 0.0
    return force, exponent * elastic / d * swell, elastic * per_rate + damping


@entry
def law_energy(coefficients, d):  # type: ignore[no-untyped-def]
    """Return what the elastic part stores [J] at an indentation d [m], K dⁿ⁺¹/(n+1)."""
    if d <= 0:
        return 0.0
    return coefficients[0] * _power(d, coefficients[1]) * d / (coefficients[1] + 1)


@inner
def quotient(law, before, after):  # type: ignore[no-untyped-def]
    """Return the mean elastic force [N] between two depths d₀ and d₁ [m], (V(d₁) − V(d₀)) / (d₁ − d₀) of its energy V.

    Under it the energy balance of a step is exact to round-off.
    """
    width = after - before
    if before <= 0.0 and after <= 0.0:
        return 0.0
    if before > 0.0 and after > 0.0 and abs(width) < CLOSE * max(before, after):
        total = 0.0
        for point in range(4):
            force, _, _ = law_force(law, before + GAUSS_POINTS[point] * width, 0.0, 1.0)
            total += GAUSS_WEIGHTS[point] * force
        return total
    return (law_energy(law, after) - law_energy(law, before)) / width


@inner
def _power(d, exponent):  # type: ignore[no-untyped-def]
    """Return dⁿ, by a root or nothing where n is 1.5 or 1."""
    if exponent == 1.5:
        return d * np.sqrt(d)
    if exponent == 1.0:
        return d
    return d**exponent
