"""The response of a port or of a block of ports to its own displacement, with the forces of all others as they are."""

import numpy as np

from gudgeon.solver.compiled import embedded, inner
from gudgeon.solver.integrators.general.arrays import CONE, LAW, RUBBING_LAW, UNILATERAL
from gudgeon.solver.laws.force import law_force, quotient

BISECTIONS = 200


@embedded
def presses(kind):  # type: ignore[no-untyped-def]
    """Whether ports of a kind only press."""
    return kind in (UNILATERAL, CONE, LAW, RUBBING_LAW)


@inner
def rubbed(limit, slipping, trial, across):  # type: ignore[no-untyped-def]
    """Return two friction forces [N] and whether they slip.

    Args:
        limit: Largest static and kinetic force [N], (2,).
        slipping: Whether the point slipped a step ago.
        trial, across: Forces that would hold it [N].
    """
    size = np.sqrt(trial * trial + across * across)
    if size <= (limit[1] if slipping else limit[0]):
        return trial, across, False
    scale = limit[1] / size if size > 0.0 else 0.0
    return trial * scale, across * scale, True


@inner
def spring_force(law, before, free, reach, dt, ends):  # type: ignore[no-untyped-def]
    """Return the force [N] of a spring: the mean of the step, or that at its end.

    Args:
        law: Stiffness [N/m] and damping [N s/m] first.
        before, free: Elongation a step ago, and at its end without the force [m].
        reach: Elongation per unit of the force [m/N].
        ends: Whether the force is that at the end of the step.
    """
    rate = law[1] / dt
    if ends:
        return -(law[0] * free + rate * (free - before)) / (1.0 + reach * (law[0] + rate))
    return -(0.5 * law[0] * (before + free) + rate * (free - before)) / (1.0 + reach * (0.5 * law[0] + rate))


@inner
def tension_at(knots, elongation):  # type: ignore[no-untyped-def]
    """Return the tension [N] of a table of knots, (n, 2), continued with the slopes of its ends."""
    last = 1
    while last < len(knots) - 1 and elongation > knots[last, 0]:
        last += 1
    slope = (knots[last, 1] - knots[last - 1, 1]) / (knots[last, 0] - knots[last - 1, 0])
    return knots[last - 1, 1] + slope * (elongation - knots[last - 1, 0])


@inner
def stored_between(knots, one, other):  # type: ignore[no-untyped-def]
    """Return the integral of a table's tension from one elongation to another [J], without cancellation."""
    low, high = min(one, other), max(one, other)
    at, total = low, 0.0
    for n in range(len(knots)):
        if low < knots[n, 0] < high:
            total += 0.5 * (knots[n, 0] - at) * (tension_at(knots, at) + knots[n, 1])
            at = knots[n, 0]
    total += 0.5 * (high - at) * (tension_at(knots, at) + tension_at(knots, high))
    return total if other >= one else -total


@inner
def spring_energy(law, knots, elongation):  # type: ignore[no-untyped-def]
    """Return what a spring stores [J]: with its stiffness, or with its table where it has knots."""
    if len(knots) > 0:
        return stored_between(knots, 0.0, elongation)
    return 0.5 * law[0] * elongation * elongation


@inner
def _tabled_tension(law, knots, before, after, dt, ends):  # type: ignore[no-untyped-def]
    if ends or after == before:
        tension = tension_at(knots, after)
    else:
        tension = stored_between(knots, before, after) / (after - before)
    return tension + law[1] * (after - before) / dt


@inner
def tabled_force(law, knots, depths, reach, dt, ends):  # type: ignore[no-untyped-def]
    """Return the force [N] of a spring with a table: the mean of the step, or that at its end.

    Args:
        law: Damping [N s/m] second.
        depths: Elongation a step ago, and at its end without the force [m], (2,).
        reach, ends: As in `spring_force`.
    """
    before, free = depths
    first = _tabled_tension(law, knots, before, free, dt, ends)
    # The tension does not decrease with the elongation: the zero of tension − T(tension) is between 0 and the first.
    low, high = 0.0, first
    wrong_low = -_tabled_tension(law, knots, before, free - reach * low, dt, ends)
    wrong_high = first - _tabled_tension(law, knots, before, free - reach * first, dt, ends)
    if wrong_low == 0.0 or wrong_high == 0.0:
        return -low if wrong_low == 0.0 else -high
    side, size = 0, abs(first)
    for _turn in range(BISECTIONS):
        tension = (low * wrong_high - high * wrong_low) / (wrong_high - wrong_low)
        wrong = tension - _tabled_tension(law, knots, before, free - reach * tension, dt, ends)
        if abs(wrong) <= 1e-15 * size or abs(high - low) <= 1e-15 * size:
            return -tension
        if (wrong > 0.0) == (wrong_high > 0.0):
            high, wrong_high = tension, wrong
            wrong_low *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            low, wrong_low = tension, wrong
            wrong_high *= 0.5 if side == -1 else 1.0
            side = -1
    return -0.5 * (low + high)


@inner
def mean_law(law, before, after, approach, dt):  # type: ignore[no-untyped-def]
    """Return the mean force [N] between two depths [m], with the losses of the law."""
    if before <= 0.0 and after <= 0.0:
        return 0.0
    elastic = quotient(law, before, after)
    rate = (after - before) / dt
    per_rate = law[2] / approach if approach > 0.0 else 0.0
    return max(0.0, elastic * (1.0 + per_rate * rate) + law[3] * rate)


@inner
def _law_at(law, before, after, approach, dt, ends):  # type: ignore[no-untyped-def]
    if ends:
        return law_force(law, after, (after - before) / dt, approach)[0]
    return mean_law(law, before, after, approach, dt)


@inner
def pressed_law(law, approach, depths, reach, dt, ends):  # type: ignore[no-untyped-def]
    """Return the force [N] of a contact law: the mean of the step, or that at its end.

    Args:
        approach: v⁻ [m/s].
        depths: A step ago, and at its end without the force [m], (2,).
        reach: Depth that a unit of the force takes away [m/N].
        ends: Whether the force is that at the end of the step.
    """
    before, free = depths
    low, high = 0.0, _law_at(law, before, free, approach, dt, ends)
    if high <= 0.0:
        return 0.0
    # The force falls with itself: a zero of force − law(depth(force)) lies between, found by false position.
    wrong_low, wrong_high = -high, high - _law_at(law, before, free - reach * high, approach, dt, ends)
    if wrong_high <= 0.0:
        return high
    side = 0
    for _turn in range(BISECTIONS):
        force = (low * wrong_high - high * wrong_low) / (wrong_high - wrong_low)
        if not low < force < high:
            force = 0.5 * (low + high)
        wrong = force - _law_at(law, before, free - reach * force, approach, dt, ends)
        if abs(wrong) <= 1e-15 * high or high - low <= 1e-15 * high:
            return force
        if wrong > 0.0:
            high, wrong_high = force, wrong
            if side == 1:
                wrong_low *= 0.5
            side = 1
        else:
            low, wrong_low = force, wrong
            if side == -1:
                wrong_high *= 0.5
            side = -1
    return 0.5 * (low + high)


@inner
def compliant_force(spring, given, depths, reach, dt, ends):  # type: ignore[no-untyped-def]
    """Return the force [N] of a spring or of a contact law: the mean of the step, or that at its end.

    Args:
        spring: Whether it is a spring.
        given: Its law, the approach speed v⁻ of a contact [m/s], and the table of a spring, (n, 2), n = 0 without one.
        depths: Displacement a step ago, and at its end without the force [m], (2,).
        reach: Displacement per unit of the force [m/N].
        ends: Whether the force is that at the end of the step.
    """
    law, approach, knots = given
    if not spring:
        return pressed_law(law, approach, (-depths[0], -depths[1]), reach, dt, ends)
    if len(knots) > 0:
        return tabled_force(law, knots, depths, reach, dt, ends)
    return spring_force(law, depths[0], depths[1], reach, dt, ends)


@inner
def stiffness(columns, a, size):  # type: ignore[no-untyped-def]
    """Return the inverse of what a unit force of candidate a moves it by [N/m], of the first of two tangents that of
    the larger eigenvalue of their block, which keeps the projection of its step a contraction; 0 where nothing moves.
    """
    reach = columns[a, a]
    if size == 2:
        p, r, s = reach, columns[a + 1, a + 1], 0.5 * (columns[a, a + 1] + columns[a + 1, a])
        reach = 0.5 * (p + r) + np.sqrt(0.25 * (p - r) ** 2 + s * s)
    return 0.0 if reach <= 0.0 else 1.0 / reach


@inner
def held_or_rubbed(stiff, limit, slides, forces, measures):  # type: ignore[no-untyped-def]
    """Return the response of the two tangents of a cone.

    Args:
        stiff: As `stiffness` returns it [N/m].
        limit: Largest static and kinetic force [N].

    Returns:
        Both forces [N], and whether they slip.
    """
    if limit[0] <= 0.0:
        return 0.0, 0.0, False
    return rubbed(limit, slides, forces[0] - stiff * measures[0], forces[1] - stiff * measures[1])
