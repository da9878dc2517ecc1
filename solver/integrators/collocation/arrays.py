"""The arrays of collocation: tables by step length, constants, state, the step that is tried and those accepted."""

from typing import NamedTuple

import numpy as np


class Tables(NamedTuple):
    """What depends on the step. Shapes: L levels, c contacts, n coordinates."""

    known: np.ndarray
    """(L,)"""
    length: np.ndarray
    """h [s], (L,)."""
    free: np.ndarray
    """y←y, y←ẏ, ẏ←y, ẏ←ẏ, (L, 4, n)."""
    drift: np.ndarray
    """What constant forces add to y and ẏ, (L, 2, n)."""
    push: np.ndarray
    """y and ẏ per unit force value at each point, (L, 2, 4, n)."""
    gap: np.ndarray
    """Rate of g and g itself over y and ẏ at the last three points: (L, 2, 3, c, 2 n)."""
    gap_drift: np.ndarray
    """(L, 2, 3, c)"""
    reach: np.ndarray
    """Change of g and of its rate at the last three points per force value, (L, 2, c, c, 3, 4)."""


class Table(NamedTuple):
    """The tables of one level."""

    length: float
    free: np.ndarray
    drift: np.ndarray
    push: np.ndarray
    gap: np.ndarray
    gap_drift: np.ndarray
    reach: np.ndarray


class Constants(NamedTuple):
    """What stays constant in a run. Shapes: c contacts, n coordinates."""

    rows: np.ndarray
    """∂g/∂y, (c, n)."""
    gap: np.ndarray
    """(c,)"""
    series: np.ndarray
    """R in series with each law [m/N], (c,)."""
    law: np.ndarray
    """(c, 4)"""
    stiffness: np.ndarray
    """ω² [rad²/s²], (n,)."""
    constant: np.ndarray
    """Constant forces, (n,)."""
    start: np.ndarray
    """y at the start of the run, from which constant forces do work, (n,)."""
    tolerance: float
    """Error of forces and energy over those of the reference force; round-off of gaps is allowed for."""
    fixed: int
    """Level that every step has, or −1."""
    floor: float
    """Least approach speed, relative to the largest."""


class Trial(NamedTuple):
    """One step as it is tried, c contacts; in the order of the four points, or of the last three."""

    guess: np.ndarray
    values: np.ndarray
    """Forces as expected and as found [N], (c, 4)."""
    depth: np.ndarray
    rate: np.ndarray
    """Indentation [m] and its rate [m/s], (c, 4)."""
    loose: np.ndarray
    loose_rate: np.ndarray
    """Gap [m] and its rate [m/s] if forces stood at the first point alone, (c, 3)."""
    matrix: np.ndarray
    wrong: np.ndarray
    """Newton's matrix and right-hand side, (3 c, 3 c) and (3 c,)."""


class Motion(NamedTuple):
    """What changes; arrays are updated in place."""

    y: np.ndarray
    v: np.ndarray
    force: np.ndarray
    """At the start of the step, (c,)."""
    before: np.ndarray
    """Values of the step before, (c, 4)."""
    approach: np.ndarray
    """v⁻ of each contact [m/s], 0 where it is open, (c,)."""
    clock: np.ndarray
    """Time, length of the step before or 0, reference force, largest approach speed, (4,)."""
    level: np.ndarray
    """Level of the next step, (1,)."""
    energy: np.ndarray
    """Energy lost to laws, largest energy error, largest exchange, E₀, (4,)."""
    counts: np.ndarray
    """Steps, rejected steps, iterations, (3,)."""


class Track(NamedTuple):
    """Accepted steps, b of them at most."""

    start: np.ndarray
    """(b,)"""
    length: np.ndarray
    values: np.ndarray
    """(b, c, 4)"""
    y: np.ndarray
    """At the start, (b, n)."""
    v: np.ndarray
    lost: np.ndarray
    """Energy that laws have lost by its start and end, (b, 2)."""
    opening: np.ndarray
    """Gap and its rate at the end, (b, 2, c)."""
