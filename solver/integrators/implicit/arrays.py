"""The arrays of the implicit time loop, constants and state together, as `core/implicit/arrays.hpp` has them.

Shapes: m coordinates, c contact rows, k contacts, F functions of traction spaces, L load rows, j joints.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.contact.compliance import Compliance
from gudgeon.solver.contact.lcp import ActiveSet
from gudgeon.solver.integrators.impact_log import ImpactLog
from gudgeon.solver.integrators.implicit.open_contacts import Bounds


class Modes(NamedTuple):
    """All coordinates."""

    q: np.ndarray
    v: np.ndarray
    before: np.ndarray
    """q and q̇ at the start of the step, (2, m)."""
    force: np.ndarray
    """Generalised force of the step, (m,)."""
    end_force: np.ndarray
    """Its part by contact forces of the end of the step and by corrections of the joints, (m,)."""
    moved: np.ndarray
    """Displacement of each coordinate in the step, (m,)."""
    motion: np.ndarray
    push: np.ndarray
    loss: np.ndarray
    """As in `Flight`."""
    stiffness: np.ndarray
    gravity: np.ndarray
    """Generalised force of gravity, (m,)."""


class Points(NamedTuple):
    """All contact rows."""

    rows: np.ndarray
    columns: np.ndarray
    """∂g/∂q, (c, m) and (m, c)."""
    span: np.ndarray
    """First and last + 1 coordinate on which any row depends, (2,)."""
    coordinates: np.ndarray
    """Their numbers."""
    gap: np.ndarray
    layer: np.ndarray
    """Compliance of each row's surface layer [m/N], (c,)."""
    residual: np.ndarray
    """R [m/N], (c, c)."""
    memory: np.ndarray
    """Factors in r⁺ of r, of λ at the start and of λ at the end of the step, (3, c)."""
    contact: np.ndarray
    multipliers: np.ndarray
    last: np.ndarray
    guess: np.ndarray
    """λ at the end and at the start of the step, and its prediction at the end [N], (c,)."""
    pressed: np.ndarray
    amounts: np.ndarray
    counts: np.ndarray
    """Rows whose λ is not zero, their λ [N], and how many, at the start and at the end of the step, (2, c) and (2,)."""
    response: np.ndarray
    """R λ [m], (c,)."""
    residual_force: np.ndarray
    """r = R⁻¹ w [N], (c,)."""
    residual_displacement: np.ndarray
    """w under contact forces [m], (c,)."""
    total_displacement: np.ndarray
    """w under all forces [m], (c,)."""
    end_residual_force: np.ndarray
    end_total_displacement: np.ndarray
    """Both at the end of the step, (c,)."""
    followed: np.ndarray
    """Whether the displacements of each contact's rows are up to date, (k,)."""
    free: np.ndarray
    shifted: np.ndarray
    gaps: np.ndarray
    """g⁺ without masters and contact forces of the end, under those that are expected where bodies slide, and as found
    [m], (c,); of candidate contacts."""
    active: ActiveSet
    directions: np.ndarray
    """Of each row's force on its body, (c, 3)."""
    impulses: np.ndarray
    """[N s], (c,)."""


class Masters(NamedTuple):
    """All traction spaces."""

    functions: np.ndarray
    columns: np.ndarray
    """∂e/∂q, (F, m) and (m, F)."""
    span: np.ndarray
    coordinates: np.ndarray
    """As in `Points`."""
    residual: np.ndarray
    """R [m/N], (F, F)."""
    memory: np.ndarray
    """As in `Points`, (3, F)."""
    chart: np.ndarray
    """Start and spacing along of each contact's space [m], (k, 2)."""
    height: np.ndarray
    """Coordinate along of each row at σ = 0 [m], (c,)."""
    start: np.ndarray
    """Function that each row touches first across, in the first line along; negative beside the space, (c,)."""
    slide: np.ndarray
    """∂σ/∂q of each contact, (k, m)."""
    residual_force: np.ndarray
    residual_displacement: np.ndarray
    """r [N] and w [m], (F,)."""
    last_displacement: np.ndarray
    """w at the end of the last step [m], (F,)."""
    response: np.ndarray
    """R times half the forces of the end of the step [m], (F,)."""
    inward: np.ndarray
    """e of the functions in the windows of candidate contacts [m], (F,)."""
    filled: np.ndarray
    """Range along in which w of each contact's space is kept, (k, 2)."""
    left: np.ndarray
    """How many points have left their surface with a force, (1,)."""
    corner: np.ndarray
    along: np.ndarray
    """Weights at the end and the start of the step, as in `Compliance`, (2, c) and (2, 4, c)."""
    near: np.ndarray
    """Corners at the end of the step, negative where the gap is a bound, too, (c,)."""
    weights_at: np.ndarray
    """Sliding distance at which these weights are [m], (2, k)."""
    sigma: np.ndarray
    """Sliding distance of each contact now, at the start of the step, and when the matrix was made [m], (3, k)."""
    slid: np.ndarray
    """Sliding distance of each contact in the step [m], (k,)."""
    drag: np.ndarray
    """Force along the line of sliding of each contact [N], (k,)."""
    drag_impulse: np.ndarray
    function_forces: np.ndarray
    """Half the forces on the functions at the start and at the end of the step, and others [N], (3, F)."""
    force: np.ndarray
    """Generalised force of those of the end, (m,)."""
    numbers: np.ndarray
    amounts: np.ndarray
    size: np.ndarray
    """Functions with forces, their forces [N], (F,), and how many, (1,)."""
    work: np.ndarray
    """[m], (F,)."""
    impulses: np.ndarray
    """[N s], (F,)."""
    refresh: np.ndarray
    """Share of the spacing that weights may move before the matrix is rebuilt, (1,)."""


class Loads(NamedTuple):
    """Given loads and joints. Rows 2 i and 2 i + 1 are the lateral and along displacement of joint i."""

    rows: np.ndarray
    """(L, m)"""
    memory: np.ndarray
    """a and b of each row, (2, L)."""
    residual: np.ndarray
    """R among the rows, (L, L)."""
    to_gap: np.ndarray
    """R from loads to gaps, (L, c)."""
    gap_per_load: np.ndarray
    """Response of gaps at the end of a step to constant loads, (L, c)."""
    numbers: np.ndarray
    """0 … L − 1."""
    joint_response: np.ndarray
    """Response of P + ½ dt Ṗ to the joint's own constant force, (j, 2, 2)."""
    joint_per_row: np.ndarray
    """Response of P + ½ dt Ṗ to λ⁺, (2 j, c)."""
    anchor: np.ndarray
    """P at q = 0 [m], (j, 2)."""
    lengths: np.ndarray
    """[m], (j,)"""
    residual_force: np.ndarray
    last_residual_force: np.ndarray
    """Force in the residual flexibility now and a step ago, (L,)."""
    residual_displacement: np.ndarray
    """By the residual flexibility, (L,)."""
    displacement: np.ndarray
    """By residual flexibility and coordinates, (L,)."""
    amount: np.ndarray
    """Mean force of the step, (L,)."""
    rod: np.ndarray
    """Force of each joint, positive when it pushes its body away from the crank pin [N], (j,)."""
    pin: np.ndarray
    """Crank pin at the end of the last step: lateral, along, rates, (j, 4)."""
    direction: np.ndarray
    """Of each rod in the middle of the step, (j, 2)."""
    correction: np.ndarray
    correction_before: np.ndarray
    """Correction of each rod's force, and the same before contact changed [N], (j,)."""
    slopes: np.ndarray
    """−∂correction/∂λ⁺, (j, c)."""


class Energy(NamedTuple):
    """The energy balance, and counts."""

    rigid: np.ndarray
    """Numbers of the rigid coordinates, (r,)."""
    work: np.ndarray
    """Of contacts on each rigid coordinate, then on all [J], (r + 1,)."""
    parts: np.ndarray
    """Kinetic, strain, contact, dissipated, work of loads and joints [J], (5,)."""
    counts: np.ndarray
    """Active rows, steps in contact, pivots, matrices built, further passes, contacts found late to touch, (6,)."""
    extreme: np.ndarray
    """As in `Outcome`, (4,)."""


class Arrays(NamedTuple):
    """All arrays of a run."""

    dt: float
    """[s]"""
    modes: Modes
    points: Points
    masters: Masters
    matrix: Compliance
    loads: Loads
    bounds: Bounds
    energy: Energy
    log: ImpactLog


class Drive(NamedTuple):
    """Given loads and motion of some steps."""

    loads: np.ndarray
    """Mean of each load row over the step, zero for joints', (steps, L)."""
    crank: np.ndarray
    """Crank pins at the end of the step: lateral, along, rates, (steps, j, 4)."""
