"""Loss χ of F = K dⁿ (1 + χ ḋ/v⁻), and the restitution e that it delivers: exact, for any n.

The first integral of m d̈ = −F between both ends of a contact does not depend on K, n, m or v⁻:

    χ (1 + e) = ln[(1 + χ)/(1 − χ e)]

(Y. Gonthier, J. McPhee, C. Lange, J.-C. Piedbœuf, Multibody System Dynamics 11 (2004) 209-233). With
h = χ (1 + e)/2 it becomes Langevin's function,

    (1 − e)/(1 + e) = L(h) = coth h − 1/h,   χ = h (1 + L(h)),

which increases from 0 to 1, so that both functions here are a root of a smooth increasing function. A contact under
this law ends at zero indentation: χ e < 1.
"""

from collections.abc import Callable
from math import exp, expm1, inf
from sys import float_info

SMALLEST = 1e-300
"""Least restitution: its loss, the inverse, is still a number."""

TOLERANCE = 0.02
"""Allowed relative difference of the restitution delivered from the one given."""

ROUND_OFF = 16 * float_info.epsilon
"""Relative step below which a root has converged: round-off of the function, near h = 1, is half of that."""

NEWTON_STEPS = 100
"""Largest number; a root takes about five. A step that leaves the bracket is replaced by bisection."""


def loss_of_restitution(restitution: float) -> float:
    """Return the loss χ [1] that delivers a restitution in [SMALLEST, 1]."""
    e = restitution
    if not SMALLEST <= e <= 1:
        raise ValueError(f"restitution is {e:g}, it must be above 0 and at most 1")
    if e == 1:
        return 0.0
    lost_fraction, complement_fraction = (1 - e) / (1 + e), 2 * e / (1 + e)

    def residual(h: float) -> tuple[float, float]:
        langevin, complement, slope = _langevin(h)
        # Whichever is the smaller is known to more digits.
        return (
            langevin - lost_fraction if lost_fraction < complement_fraction else complement_fraction - complement
        ), slope

    # h/(3 + h) ≤ L(h) ≤ h/3.
    lower, upper = 3 * lost_fraction, 3 * lost_fraction / complement_fraction
    return (
        2
        * _root(
            residual,
            lower,
            upper,
            min(upper, lost_fraction * (3 - lost_fraction**2) / (complement_fraction * (1 + lost_fraction))),
        )
        / (1 + e)
    )


def delivered_restitution(loss: float) -> float:
    """Return the restitution [1] of a free impact with a loss χ ≥ 0 [1]."""
    if not 0 <= loss < inf:
        raise ValueError(f"loss is {loss:g}, it must be at least 0 and finite")
    if loss == 0:
        return 1.0

    def residual(h: float) -> tuple[float, float]:
        langevin, _, slope = _langevin(h)
        return 1 + langevin - loss / h, slope + loss / h

    langevin, complement, _ = _langevin(_root(residual, loss / 2, loss, (loss + loss / (1 + loss)) / 2))
    return complement / (1 + langevin)


def _langevin(h: float) -> tuple[float, float, float]:
    """Return L, 1 − L and dL/d ln h at h > 0, each without cancellation."""
    if h < 1:
        # Lambert's continued fraction, L = h/(3 + h²/(5 + h²/(7 + ...))): below h = 1 twelve terms pass all digits.
        tail = 25.0
        for odd in range(23, 1, -2):
            tail = odd + h * h / tail
        value = h / tail
        return value, 1 - value, h * (1 - value * value - 2 / tail)
    decay = exp(-2 * h)
    complement = 1 / h - 2 * decay / -expm1(-2 * h)
    return 1 - complement, complement, 1 / h - 4 * decay * h / expm1(-2 * h) ** 2


def _root(residual: Callable[[float], tuple[float, float]], lower: float, upper: float, start: float) -> float:
    """Return the root of an increasing function between positive bounds; `residual` gives it and its d/d ln x."""
    x = start
    for _ in range(NEWTON_STEPS):
        value, slope = residual(x)
        if abs(value) <= ROUND_OFF * slope:
            return x
        if value < 0:
            lower = x
        else:
            upper = x
        x *= 1 - value / slope
        if not lower <= x <= upper:
            x = lower + (upper - lower) / 2
    raise ArithmeticError(f"no root found between {lower} and {upper}")


def departure(kind: str, restitution: float, loss: Callable[[float], float]) -> str | None:
    """Return one line where a law, with χ [1] = loss(restitution [1]), does not deliver the restitution given."""
    if _holds(restitution, loss):
        return None
    delivered = delivered_restitution(loss(restitution))
    percent = f" ({100 * (delivered / restitution - 1):+.3g} %)" if restitution > 0 else ""
    return (
        f'law "{kind}": restitution {restitution:g} given, {delivered:.4g} delivered{percent}; the law is accurate to'
        f' {100 * TOLERANCE:g} % for {_valid_ranges(loss)}, law "exact" for any'
    )


def _holds(restitution: float, loss: Callable[[float], float]) -> bool:
    return abs(delivered_restitution(loss(restitution)) - restitution) <= TOLERANCE * restitution


def _valid_ranges(loss: Callable[[float], float]) -> str:
    """Return the ranges of restitution that a law delivers within TOLERANCE, measured in steps of 0.01."""
    ranges: list[list[float]] = []
    for restitution in (hundredth / 100 for hundredth in range(1, 101)):
        if not _holds(restitution, loss):
            continue
        if ranges and restitution - ranges[-1][1] < 0.015:
            ranges[-1][1] = restitution
        else:
            ranges.append([restitution, restitution])
    return " and ".join(f"{low:g} to {high:g}" for low, high in ranges)
