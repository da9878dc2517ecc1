"""The force of every law, compiled."""

import numpy as np

from gudgeon.solver.compiled import entry, inner


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
def _power(d, exponent):  # type: ignore[no-untyped-def]
    """Return dⁿ, by a root or nothing where n is 1.5 or 1."""
    if exponent == 1.5:
        return d * np.sqrt(d)
    if exponent == 1.0:
        return d
    return d**exponent
