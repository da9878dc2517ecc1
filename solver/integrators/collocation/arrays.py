"""The arrays of collocation: tables by step length, constants, state, the step that is tried, and accepted steps."""

from typing import NamedTuple

import numpy as np

from gudgeon.solver import core

POINTS = np.array(core.collocation_points)
"""Lobatto points of a step of length 1, (4,)."""
MONOMIALS = np.array(core.collocation_monomials)
"""Coefficient of (τ/h)^m in the cubic that is 1 at one point and 0 at the others, (4 points, 4 m)."""
LEVELS = 64
"""Levels of the step."""
GOING, FULL, OVER, MISSING, FAILED = range(5)
"""Why a call ended: the end is passed, the track is full, all contacts are open, a level has no table, no force."""
TIME, LAST, REFERENCE, FASTEST = range(4)
"""Entries of `Motion.clock`."""


class Tables(NamedTuple):
    """What depends on the step, L levels of it. Shapes: c contacts, n coordinates."""

    known: np.ndarray
    """Whether the tables of a level are filled, (L,)."""
    length: np.ndarray
    """h [s], (L,)."""
    free: np.ndarray
    """y←y, y←ẏ, ẏ←y, ẏ←ẏ, (L, 4, n)."""
    drift: np.ndarray
    """Part of y and ẏ by constant forces, (L, 2, n)."""
    push: np.ndarray
    """y and ẏ per unit force value at each point, (L, 2, 4, n)."""
    gap: np.ndarray
    """∂g/∂(y, ẏ) and ∂ġ/∂(y, ẏ) at the last three points: (L, 2, 3, c, 2 n)."""
    gap_drift: np.ndarray
    """Part of g and ġ by constant forces, (L, 2, 3, c)."""
    reach: np.ndarray
    """Change of g and of its rate at the last three points per force value, (L, 2, c, c, 3, 4)."""


class Constants(NamedTuple):
    """Constants of a run. Shapes: c contacts, n coordinates."""

    rows: np.ndarray
    """∂g/∂y, (c, n)."""
    gap: np.ndarray
    """g at y = 0 [m], (c,)."""
    series: np.ndarray
    """R in series with each law [m/N], (c,)."""
    law: np.ndarray
    """As in `law_force`, (c, 4)."""
    stiffness: np.ndarray
    """ω² [rad²/s²], (n,)."""
    constant: np.ndarray
    """Constant forces, (n,)."""
    start: np.ndarray
    """y at the start of the run, (n,)."""
    tolerance: float
    """Allowed error of forces and energy, relative to the reference force, beside round-off of the gaps."""
    fixed: int
    """Level of all steps, or −1 where the tolerance sets it."""
    floor: float
    """Least approach speed, relative to the largest."""


class Trial(NamedTuple):
    """A step that is tried, c contacts; at the four points, or at the last three."""

    guess: np.ndarray
    values: np.ndarray
    """Forces [N], predicted and found, (c, 4)."""
    depth: np.ndarray
    rate: np.ndarray
    """Indentation [m] and its rate [m/s], (c, 4)."""
    loose: np.ndarray
    loose_rate: np.ndarray
    """Gap [m] and its rate [m/s] with the forces of the first point only, (c, 3)."""
    matrix: np.ndarray
    wrong: np.ndarray
    """Newton's matrix and right-hand side, (3 c, 3 c) and (3 c,)."""
    approach: np.ndarray
    """v⁻ of each contact before the step [m/s], (c,)."""


class Motion(NamedTuple):
    """Variables of a run, updated in place."""

    y: np.ndarray
    v: np.ndarray
    force: np.ndarray
    """At the start of the step [N], (c,)."""
    before: np.ndarray
    """Forces of the step before [N], (c, 4)."""
    approach: np.ndarray
    """v⁻ of each contact [m/s], 0 where it is open, (c,)."""
    clock: np.ndarray
    """Time [s], length of the step before or 0 [s], reference force [N], largest v⁻ so far [m/s], (4,)."""
    level: np.ndarray
    """Level of the next step, (1,)."""
    balance: np.ndarray
    """As in `update_balance`, (4,)."""
    counts: np.ndarray
    """Steps, rejected steps, iterations, (3,)."""


class Track(NamedTuple):
    """Accepted steps, b of them at most."""

    start: np.ndarray
    length: np.ndarray
    """[s], (b,)"""
    values: np.ndarray
    """Forces at the four points [N], (b, c, 4)."""
    y: np.ndarray
    v: np.ndarray
    """At the start of the step, (b, n)."""
    lost: np.ndarray
    """Energy lost by the start and by the end of the step [J], (b, 2)."""
    opening: np.ndarray
    """Gap [m] and its rate [m/s] at the end of the step, (b, 2, c)."""
