"""The arrays of a mechanism's time loop, for compiled functions.

Shapes: n bodies, J pairs of markers, t terms, m rows, b springs, l loads, d drives. A body's state is its centre of
mass x, the unit quaternion e of its rotation since it was placed, its velocity v, and its spin ℓ, the angular momentum
about its centre along the scene's axes: thirteen numbers; behind those of all bodies stand `SUMS` sums over time.
"""

from typing import NamedTuple

import numpy as np

WIDTH = 13
"""Numbers of a body's state: x 3, e 4, v 3, ℓ 3."""
PLACE, TURN, SPEED, SPIN = 0, 3, 7, 10
"""Where x, e, v and ℓ begin."""
WORK, LOST, IMPULSE, MOMENT = 0, 1, 2, 5
"""Sums over time: work of loads and drives, and what dashpots dissipated [J]; of all that acts on the bodies, impulse
and its moment about the origin of the scene, three numbers each [N s, N m s]."""
SUMS = 8
ALONG, SQUARE, DISTANCE, ANGLE = range(4)
"""Kinds of a term: d = p_b − p_a along an axis of a; scalar product of two axes; |d|; rotation about a's third axis."""
NONE = -1
"""Of a body: the ground. Of a row: no second term, no drive."""
STAGES = 16
"""Of a step, with those of its interpolation."""


class Model(NamedTuple):
    """What does not change during a run."""

    mass: np.ndarray
    """[kg], (n,)."""
    inertia: np.ndarray
    """About the centre, in the axes of the body [kg m²], (n, 3, 3)."""
    inverse: np.ndarray
    """(n, 3, 3)"""
    gravity: np.ndarray
    """[m/s²], (3,)."""
    owner: np.ndarray
    """Bodies a and b of each pair of markers, (J, 2)."""
    arm: np.ndarray
    """Of both markers, from the centre in the axes of the body; of the ground from its origin [m], (J, 2, 3)."""
    frame: np.ndarray
    """Axes of both markers as columns, in the axes of the body, (J, 2, 3, 3)."""
    terms: np.ndarray
    """Kind, pair, axis of a, axis of b, (t, 4)."""
    row_terms: np.ndarray
    """First and second term of each row, (m, 2)."""
    factors: np.ndarray
    """Of both, (m, 2)."""
    constant: np.ndarray
    """What a row is at zero violation, without its drive [m or rad or 1], (m,)."""
    drive_of: np.ndarray
    """Number of a row's drive, (m,)."""
    row_pair: np.ndarray
    """Pair of markers whose joint a row belongs to; `NONE` of gears and drives, (m,)."""
    reach: np.ndarray
    """Size by which the violation of a row is measured: a length of the scene, or 1, (m,)."""
    pairs: np.ndarray
    """Rows i ≥ j and blocks of theirs that belong to one body, (P, 4)."""
    spring_owner: np.ndarray
    """Bodies of both ends, (b, 2)."""
    spring_arm: np.ndarray
    """(b, 2, 3)"""
    spring: np.ndarray
    """Stiffness, damping, length without force, (b, 3)."""
    load_owner: np.ndarray
    """(l,)"""
    load_arm: np.ndarray
    """(l, 3)"""
    load: np.ndarray
    """Force and moment per unit, along the scene's axes, (l, 6)."""


class Work(NamedTuple):
    """Arrays that compiled functions write."""

    turn: np.ndarray
    """Rotation matrix of each body, (n, 3, 3)."""
    omega: np.ndarray
    """Angular velocity along the scene's axes [rad/s], (n, 3)."""
    back: np.ndarray
    """Inverse of the inertia along the scene's axes, (n, 3, 3)."""
    rate: np.ndarray
    """Accelerations without constraints, (n, 6)."""
    push: np.ndarray
    """Force and moment about the centre, (n, 6)."""
    value: np.ndarray
    """Of each term, (t,)."""
    bend: np.ndarray
    """Second rate of each term without accelerations, (t,)."""
    slope: np.ndarray
    """Rate of each term per velocity and angular velocity of a and b, (t, 2, 6)."""
    turned: np.ndarray
    """Angle of the last accepted step of each term that is one [rad], (t,)."""
    block_owner: np.ndarray
    """Bodies of a row's blocks, (m, 4)."""
    block: np.ndarray
    """Rate of a row per velocity and angular velocity of its bodies, (m, 4, 6)."""
    light: np.ndarray
    """The same times the inverse of the inertia, (m, 4, 6)."""
    matrix: np.ndarray
    """S = G M⁻¹ Gᵀ, scaled to a diagonal of ones, (m, m)."""
    lower: np.ndarray
    """Its factor, rows in the order of the pivots, (m, m)."""
    scale: np.ndarray
    """Square roots of the diagonal of S, (m,)."""
    order: np.ndarray
    """Rows in the order of the pivots, (m,)."""
    left: np.ndarray
    """(m,)"""
    rank: np.ndarray
    """(1,)"""
    least: np.ndarray
    """Least pivot of all factors since it was set, (1,)."""
    right: np.ndarray
    """(m,)"""
    multiplier: np.ndarray
    """(m,)"""
    small: np.ndarray
    """LᵀL and its factor, (m, m)."""
    spare: np.ndarray
    """(2, m)"""
    slopes: np.ndarray
    """Rates of the state at the stages, (STAGES, 13 n + SUMS)."""
    stage: np.ndarray
    """(13 n + SUMS,)"""
    lost: np.ndarray
    """Rates of sums that nobody reads, (SUMS,)."""


class Reading(NamedTuple):
    """What is read of one state."""

    multipliers: np.ndarray
    """Of least norm, (m,)."""
    wrenches: np.ndarray
    """Force and moment of each pair of markers on its own body, about its point, along the scene's axes, (J, 6)."""
    angles: np.ndarray
    """Of each pair; 0 without one [rad], (J,)."""
    violations: np.ndarray
    """Of each pair over its reach, (J,)."""
