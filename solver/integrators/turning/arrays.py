"""The arrays of a mechanism's time loop, which `core/turning` reads.

Shapes: n bodies, J pairs of markers, t terms, m rows, b springs, u bushings and fields, l loads, d drives, P points, c
sections, E elastic coordinates at most of a body. A body's state is its centre of mass x, the unit quaternion e of its
rotation since it was placed, its velocity v, and its spin ℓ, the angular momentum about its centre along the scene's
axes: thirteen numbers; behind those of all bodies stand the elastic coordinates of all, their momenta, of each section
`PUSHES` integrals, and `SUMS` sums over time.

A section is what touches of a pair of markers: a section of a journal in its bearing, or a point of a body that may
strike an obstacle.
"""

from typing import Any, NamedTuple

import numpy as np

from gudgeon.solver.forces.fields.co_energy import CoEnergies
from gudgeon.solver.integrators.turning.touching.surfaces import Surfaces

WIDTH = 13
"""Numbers of a body's state: x 3, e 4, v 3, ℓ 3."""
PLACE, TURN, SPEED, SPIN = 0, 3, 7, 10
"""Where x, e, v and ℓ begin."""
WORK, LOST, IMPULSE, MOMENT = 0, 1, 2, 5
"""Sums over time: work of loads and drives, and what dashpots dissipated [J]; of all that acts on the bodies, impulse
and its moment about the origin of the scene, three numbers each [N s, N m s]."""
SUMS = 8
PUSHES = 10
"""Of each section integrals of force, of force times sliding speed, of normal force and friction on its body along the
scene's axes, three numbers each [N s, N m, N s]; and its tangential deflection, two numbers [m], `touching.cone`."""
NORMAL_PUSH, DRAG_PUSH, DEFLECTION = 2, 5, 8
"""Where the last three begin."""
JOURNAL, PLANE, SURFACE = range(3)
"""Shapes that a section touches: the inside of a cylinder, what is behind a plane across the third axis, or what stands
in `touching.surfaces`. The latter have no pair of markers, and stand last."""
ALONG, SQUARE, DISTANCE, ANGLE = range(4)
"""Kinds of a term: d = p_b − p_a along an axis of a; scalar product of two axes; |d|; rotation about a's third axis."""
MOMENTS = ((0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1))
"""Components of a matrix B of which its parts are made: three of its diagonal, the sums B_ij + B_ji of the last three,
and, from `CURL` on, the differences B_ij − B_ji of the last three: nine numbers."""
CURL = len(MOMENTS)
NONE = -1
"""Of a body: the ground. Of a row: no second term, no drive. Of a point: no drive."""


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
    point_owner: np.ndarray
    """Bodies of all points: 2 j and 2 j + 1 are the markers of pair j, those of springs follow, then
    loads', then two of each bushing and field, (P,)."""
    point_arm: np.ndarray
    """From the centre of the undeformed body in its axes; of the ground from its origin [m], (P, 3)."""
    point_drive: np.ndarray
    """First of the three drives by which a point of the ground moves along x, y and z, from its arm; `NONE` of all
    others, (P,)."""
    point_frame: np.ndarray
    """Axes of points as columns, in the axes of the body, (P, 3, 3)."""
    point_rows: np.ndarray
    """Displacement and rotation per elastic coordinate, (P, 6, E)."""
    point_bend: np.ndarray
    """Their second order, see `flexible.frame`, (P, 6, E, E)."""
    bends: np.ndarray
    """Whether a point has any, (P,)."""
    elastic: np.ndarray
    """Number of elastic coordinates of each body, where they begin in the state, and where their momenta do, (n, 3)."""
    second: np.ndarray
    """Of `flexible.frame`, by the parts of `MOMENTS`, its symmetric ones alone, (n, CURL)."""
    lever: np.ndarray
    """By all nine parts, (n, 9, E)."""
    pair: np.ndarray
    """Parts of k for each l, (n, E, 9, E)."""
    modal_root: np.ndarray
    """L, lower, of the mass L Lᵀ over elastic coordinates, (n, E, E)."""
    orthogonal: np.ndarray
    """Whether L is a diagonal, (n,)."""
    modal_stiffness: np.ndarray
    """(n, E)"""
    modal_damping: np.ndarray
    """(n, E)"""
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
    """Size by which the violation of a row is measured: that of the mechanism, or 1 of angles, (m,)."""
    size: float
    """Of the mechanism [m]."""
    group: np.ndarray
    """First of the rows of the same joint along axes at right angles, and how many they are, (m, 2)."""
    pairs: np.ndarray
    """Rows i ≥ j and blocks of theirs that belong to one body, (P, 4)."""
    envelope: np.ndarray
    """Order of the rows in which those of neighbouring bodies follow each other, and of each in this order the first
    one that S couples to it and the end of those whose first one is not behind it, (m, 3)."""
    spring: np.ndarray
    """Stiffness, damping, length without force, (b, 3)."""
    load: np.ndarray
    """Force and moment per unit, along the scene's axes, (l, 6)."""
    bush_rest: np.ndarray
    """Way between the points of each bushing at the start, along the axes of the other side [m], (u, 3)."""
    bush_stiffness: np.ndarray
    """Over translations and rotations, (u, 6, 6)."""
    bush_damping: np.ndarray
    """(u, 6, 6)"""
    bush_field: np.ndarray
    """Number of the field that acts instead of a bushing; `NONE` of bushings, (u,)."""
    fields: CoEnergies
    touch_pair: np.ndarray
    """Pair of markers of each section, (c,)."""
    touch_shape: np.ndarray
    """`JOURNAL`, `PLANE` or `SURFACE`, (c,)."""
    touch_size: np.ndarray
    """Clearance, radius of the journal, place of the section along its axis [m], (c, 3); a point in a bore has no
    radius, and its clearance is the radius of the bore."""
    touch_law: np.ndarray
    """Coefficients of its law, (c, 4)."""
    touch_friction: np.ndarray
    """Of friction: coefficient [1], speed [m/s], and of a cone stiffness [N/m], which is else 0, and deflection by
    which its direction turns at least [m], (c, 4)."""
    touch_belt: np.ndarray
    """Velocity of the surface of its obstacle, which lies in it [m/s], (c, 3)."""
    worn_cells: np.ndarray
    """Number of cells of the worn shape of each section's bearing and journal, 0 where it is round, (c, 2)."""
    worn_soft: np.ndarray
    """Depth over which the pressure on a worn shape falls by e [m], (c,)."""
    worn_depth: np.ndarray
    """Worn depth of each cell of bearing and journal [m], (c, 2, cells)."""
    worn_turn: np.ndarray
    """Cosine and sine of the cells' angles, (c, cells, 2)."""
    surfaces: Surfaces
    yielding: np.ndarray
    """Number of the table of each section's elastic bearing, −1 without one, (c,); see `touching.yielding.Table`."""
    yielding_reach: np.ndarray
    yielding_touch: np.ndarray
    yielding_depth: np.ndarray


Work = Any
"""The arrays that the core writes, those of `Work` in `core/turning/arrays.hpp`: what `core.turning_work` returns."""


class Reading(NamedTuple):
    """What is read of one state."""

    multipliers: np.ndarray
    """Of least norm, (m,)."""
    wrenches: np.ndarray
    """Force and moment of each pair of markers on its own body, about its point, along the scene's axes, (J, 6)."""
    holds: np.ndarray
    """The same with forces of gears and drives, (J, 6)."""
    angles: np.ndarray
    """Of each pair; 0 without one [rad], (J,)."""
    violations: np.ndarray
    """Of each pair over its reach, (J,)."""


def pushes_of(state: np.ndarray, sections: int) -> np.ndarray:
    """Return a view of the integrals of the sections in states (..., numbers), (..., c, `PUSHES`)."""
    section_state = state[..., state.shape[-1] - SUMS - PUSHES * sections : state.shape[-1] - SUMS]
    return section_state.reshape(*state.shape[:-1], sections, PUSHES)
