"""The arrays of the time loop over ports. Shapes: p ports, m coordinates, k contacts, s sides, n candidates, t values
of a table over the ports that share a body, as `contact.pattern` says.

A port's measure y is its displacement at the end of a step; of rigid contact the distance dt (u̇⁺ + e u̇⁻) that its
velocities after and before the step give; of joints and drives u⁺ + ½ dt u̇⁺, of drives less what they give.
"""

from typing import NamedTuple

import numpy as np

from gudgeon.solver.contact.compliance import Compliance
from gudgeon.solver.contact.lcp import ActiveSet
from gudgeon.solver.contact.pattern import Pattern
from gudgeon.solver.forces.fields.co_energy import CoEnergies
from gudgeon.solver.integrators.impact_log import ImpactLog
from gudgeon.solver.integrators.small.edges import Edges
from gudgeon.solver.integrators.small.rows import Residual, Rows
from gudgeon.solver.integrators.small.slides import Slides

SLIPS = 65_536
"""Changes between slip and stick that are kept, of a frame."""
POSITION, VELOCITY, STABILISED = range(3)
"""Levels: what a port's measure is."""


class Constants(NamedTuple):
    """What does not change in a run."""

    dt: np.ndarray
    """Step [s], (1,)."""
    motion: np.ndarray
    push: np.ndarray
    loss: np.ndarray
    """As in `Flight`."""
    stiffness: np.ndarray
    gravity: np.ndarray
    rows: Rows
    parts: np.ndarray
    """Ranges of the rigid and of the elastic coordinates of each body, (P, 2)."""
    near: np.ndarray
    """Parts that each port moves with, (p, 4)."""
    norms: np.ndarray
    """‖W‖ over these parts, (4, p)."""
    met: np.ndarray
    """First and last + 1 port of contacts on the same bodies, (c, 2)."""
    groups: np.ndarray
    """The same of all ports, (g, 2)."""
    reach: np.ndarray
    """Largest |R| of each port by forces on either of its bodies, without its own where that is not damped [m/N],
    (2, p)."""
    offset: np.ndarray
    kind: np.ndarray
    size: np.ndarray
    """Ports that respond together with the first of them; 0 for the others, (p,)."""
    level: np.ndarray
    share: np.ndarray
    """κ: mean force of a step over the unknown: ½ where it is the force at the end, else 1, (p,)."""
    pattern: Pattern
    """Which ports couple, in the tables that follow; all where points slide over traction spaces."""
    inertia: np.ndarray
    """Measure of port i by the mean force of port j, in row j, (t,)."""
    columns: np.ndarray
    """Measure of port i by the unknown of port j, in row j, (t,)."""
    yields: np.ndarray
    """The part of `columns` that does not depend on the step: R and layers, in row j, (t,)."""
    residual: Residual
    memory: np.ndarray
    """Factors in r⁺ of r, f at the start and f at the end, (s, 3, p)."""
    layer: np.ndarray
    """[m/N], (p,)."""
    law: np.ndarray
    """K, n, χ, c of contact laws; stiffness and damping of springs, (p, 4)."""
    knots: np.ndarray
    """Elongation [m] and tension [N] of the tables of all springs, (n, 2)."""
    table: np.ndarray
    """First and last + 1 knot of each port; (0, 0) without a table, (p, 2)."""
    friction: np.ndarray
    """Static and kinetic coefficient at the first port of a cone, (p, 2)."""
    belt: np.ndarray
    """Velocity of the obstacle along tangents [m/s], (p,)."""
    restitution: np.ndarray
    lengths: np.ndarray
    """Rod length at the first port of a joint [m], (p,)."""
    contact: np.ndarray
    """Number of the contact of each port; −1 for others, (p,)."""
    direction: np.ndarray
    """Of the force on the contact's first body, (p, 3)."""
    joint: np.ndarray
    """Number of the joint at the first port of a joint, −1 elsewhere, (p,)."""
    drives: np.ndarray
    """Ports of driven bodies, (D,)."""
    inverse: np.ndarray
    """Unknowns of the ports of a drive per measure of each of them, in its rows, (p, n)."""
    given: np.ndarray
    """Ports of given loads."""
    fields: CoEnergies
    field_loads: np.ndarray
    """Numbers among the given loads of the rows of each field's two ends; −1 where there is none, (f, 2, 6)."""
    field_start: np.ndarray
    """Pose at no displacement [m, rad], (f, 6)."""
    stored: np.ndarray
    """Whether a given load is of a field, which stores its work, (g,)."""
    touching: np.ndarray
    """First port of each block of a contact."""
    always: np.ndarray
    """First port of each other block that responds: joints, drives, springs."""
    joints: np.ndarray
    """First port of each joint, (j,)."""
    loaded: np.ndarray
    """Ports of joints, given loads and drives, in the order of `Samples.loads`."""
    sides: np.ndarray
    """As in `Ports`, (p, 2)."""
    block: np.ndarray
    """First port of each port's block, (p,)."""
    edges: Edges
    edged: bool
    """Whether any point meets a face with edges."""
    farthest: np.ndarray
    """Largest displacement of a coordinate by a unit force in a step, of ports that respond [s²], (p,)."""
    damped: bool
    """Whether the residual flexibility is damped."""
    bounces: bool
    """Whether any contact is rigid."""
    divides: bool
    """Whether steps are divided where rigid contact closes."""
    rigid: np.ndarray
    """Numbers of the rigid coordinates, (r,)."""
    floor: float
    """Least approach speed of a law, relative to the largest so far."""
    widest: np.ndarray
    """Largest sum of ‖W‖ of a port of contacts over each part, (P,)."""
    lossy: bool
    """Whether coordinates are damped."""
    idles: bool
    """Whether nothing but contact acts, so that steps without it are motion alone."""
    sparse: bool
    """Whether forces are those of unilateral candidates over undamped compliances, and no others."""
    slides: bool
    """Whether points slide over a traction space."""
    plain: bool
    """Whether all ports that respond are unilateral over a symmetric compliance."""
    paired: bool
    """Whether these are such, over traction spaces too, and joints."""


class State(NamedTuple):
    """What changes from step to step."""

    slides: Slides
    apart: np.ndarray
    """Whether a point is nearer to another face of the solid, at its first port, (p,)."""
    beside: np.ndarray
    """Whether a port is the first of a point that is beside the face it may meet, (p,)."""
    inside: np.ndarray
    """Largest depth of a point that came past an edge [m], and what laws lose in the step beside faces [J], (2,)."""
    q: np.ndarray
    v: np.ndarray
    before: np.ndarray
    """q and q̇ at the start of the step, (2, m)."""
    field: np.ndarray
    """Of each field, what `co_energy.evaluate` sets, (f, OUT)."""
    field_pose: np.ndarray
    """[m, rad], (f, 6)."""
    field_basis: np.ndarray
    field_energy: np.ndarray
    """What all of them store [J], and the number of the step, (2,)."""
    force: np.ndarray
    """Mean generalised force of the step, (m,)."""
    pressed: np.ndarray
    """Its part by contacts, (m,)."""
    unknown: np.ndarray
    """Force of each port at the end of the step, of some kinds its mean [N], (p,)."""
    last: np.ndarray
    """The same a step ago, (p,)."""
    mean: np.ndarray
    """Mean force of each port [N], (p,)."""
    extra: np.ndarray
    """Mean force less that of the trapezoidal rule [N], (p,)."""
    held: np.ndarray
    """r: forces in the residual flexibility, (s, p)."""
    known: np.ndarray
    """Its part that is known before contact, (s, p)."""
    half: np.ndarray
    """Generalised force by half of the unknowns of share ½: of contacts and of other ports, (2, m)."""
    rest: np.ndarray
    """The same by the rest of the means at the step's end, (2, m)."""
    forced: np.ndarray
    """Ports with a force in the step or a part of it, after how many, (p + 1,)."""
    way: np.ndarray
    """Bound of what each port of contacts can have moved [m], (p,)."""
    listed: np.ndarray
    listed_known: np.ndarray
    """Ports whose r is not zero, after how many, (p + 1,)."""
    displacement: np.ndarray
    """Of each port at the end of the step, and a step ago [m], (2, p)."""
    response: np.ndarray
    """Displacement of each port by the residual flexibility, now and a step ago [m], (2, p)."""
    gap: np.ndarray
    """Measure of each candidate without forces of the step's end, (p,)."""
    measure: np.ndarray
    """Measure of each candidate, (p,)."""
    anchor: np.ndarray
    """Where a tangent sticks [m], (p,)."""
    sliding: np.ndarray
    """Whether a cone slips, at its first port, (p,)."""
    approach: np.ndarray
    """v⁻ of each law [m/s], 0 where it is open, (p,)."""
    fastest: np.ndarray
    """Largest v⁻ so far [m/s], (1,)."""
    rod: np.ndarray
    """Direction of each joint's force in the step, and the length of its measure [m], (j, 3)."""
    wanted: np.ndarray
    """Measure of the displacement that each drive gives [m], (D,)."""
    pin: np.ndarray
    """Driven point of each joint at the end of the last step: lateral, along, rates, (j, 4)."""
    closing: np.ndarray
    """Share of the step at which rigid contact closes; −1 where it does not, (p,)."""
    sudden: np.ndarray
    """Share of the impulse of rigid contact that acts when it closes, the rest over the remaining step, (p,)."""
    rate: np.ndarray
    """Velocity of rigid contact at the end of the step without the forces of rigid contact [m/s], (p,)."""
    foreseen: np.ndarray
    """Forces of the step without rigid contact [N], (p,)."""
    average: np.ndarray
    """By which share of the last step impulses acted earlier than over the whole of it, (1,)."""
    shift: np.ndarray
    """By how much the impulses of rigid contact that closes move other ports more than if they acted over the whole
    step [m], (p,)."""
    margin: np.ndarray
    """Sum of a gap and the bounds on its change that were used up when it was found [m], (p,)."""
    travel: np.ndarray
    """Path length of the coordinates of each part [m kg^½], and of r on each body, Σ|Δr| [N], up to the last step,
    (P + B,)."""
    ahead: np.ndarray
    """The same up to the forces found, (P + B,)."""
    lead: np.ndarray
    """What forces at a step's end add to the paths: in the last one, and allowed for in this one, (2, P + B)."""
    clearance: np.ndarray
    """Distance that bodies may still move before any point can touch, where no force acts; else 0 [m], (1,)."""
    impulses: np.ndarray
    """Of each port [N s], (p,)."""
    struck: np.ndarray
    """Whether rigid contact closed in the step, of each contact, (k,)."""
    peak: np.ndarray
    """Largest force of each contact's present impact and its time before the step [N, s], (k, 2)."""
    slips: np.ndarray
    """Contact, time [s] and whether it begins, of each change between slip and stick; after the first row, their
    number, (SLIPS + 1, 3)."""
    closed: np.ndarray
    """Whether rigid contact is closed, at the first port of its block, (p,)."""
    swift: np.ndarray
    """Bound of its largest speed so far, with what contact takes from it in a step [m/s], (p,)."""
    turning: np.ndarray
    """First port of the point whose slip turns round at the end of a part of the step, else −1, (1,)."""
    since: np.ndarray
    """Time of its last impact [s], (p,)."""
    sudden_impulses: np.ndarray
    """Impulses of impacts in the step, and of the last impact [N s], (2, p)."""
    total: np.ndarray
    """Impulse of the other forces in the parts of the step so far [N s], (p,)."""
    begun: np.ndarray
    """Unknowns at the start of the step [N], (p,)."""
    kept: np.ndarray
    """v⁻ of laws at the start of a part of it [m/s], then the largest so far, (p + 1,)."""
    loads: np.ndarray
    """Given loads in a part of the step: means, and at its end [N], (2, g)."""
    ends: np.ndarray
    """q and q̇ at the end of a part of the step with the forces found, (2, m)."""
    acting: np.ndarray
    """Sum of the forces of each contact's points at the end of the step [N], (k,)."""
    stored: np.ndarray
    """Energy of the residual flexibility a step ago [J], (1,)."""
    work: np.ndarray
    """Of contacts on each rigid coordinate, then on all [J], (r + 1,)."""
    rubbed: np.ndarray
    """Energy that friction of each contact took [J], (k,)."""
    parts: np.ndarray
    """Energies as in `Trajectory` [J], (5,)."""
    extreme: np.ndarray
    counts: np.ndarray
    """As in `Outcome`; entry 3: sweeps, 4: contact solutions that were repeated, 5: steps of Newton's method."""


class Problem(NamedTuple):
    """The candidates of a step, and the work arrays of their solution. N: largest number of candidates, w: window."""

    awake: np.ndarray
    """Whether the first port of a block is a candidate, now and a step ago, (2, p)."""
    ports: np.ndarray
    """Their numbers; while forces are sought that are no plain ones, those that act, (N,)."""
    candidates: np.ndarray
    """Then all, (N,)."""
    acting: np.ndarray
    """Whether a candidate acts, at the first port of its block, (p,)."""
    gathered: np.ndarray
    """Ports of `columns`, (N,)."""
    altered: np.ndarray
    """Those whose means may differ from the trapezoidal rule, (N,)."""
    size: np.ndarray
    """How many; for how many `columns` or `runs` hold; whether all are solved for; number of runs; of
    changes that are mixed, (5,)."""
    columns: np.ndarray
    """Measure of candidates per unknown of a candidate, one a row, (N, N)."""
    active: ActiveSet
    """Closed ports where all that respond are unilateral."""
    runs: np.ndarray
    """First and last + 1 of candidates that follow each other, (N, 2)."""
    matrix: Compliance
    """Measure of port i by the unknown of port j, symmetric, over runs."""
    free: np.ndarray
    """Measures without the unknowns of the candidates, of all ports [m], (p,)."""
    x: np.ndarray
    y: np.ndarray
    """Unknowns and measures, (N,)."""
    start: np.ndarray
    """Unknowns at the start of a sweep, (N,)."""
    weight: np.ndarray
    """Roots of the diagonal of `columns`, (N,)."""
    stiff: np.ndarray
    """Inverse of that diagonal, of both tangents of a cone of their block's larger eigenvalue; 0 where it is 0 [N/m],
    (N,)."""
    past: np.ndarray
    """Residual, unknowns and measures of the last sweep, (3, N)."""
    changes: np.ndarray
    """Their changes in the last sweeps, (3, w, N)."""
    products: np.ndarray
    """Of the changes of the residual with each other, (w, w)."""
    gram: np.ndarray
    """(w, w + 1)"""
    derivative: np.ndarray
    """Of Newton's method, (p, p)."""
    correction: np.ndarray
    """Its step [N], (p,)."""
    pushed: np.ndarray
    """What listed unknowns add to the measures of candidates and of ports between them [m], (p,)."""
    pushing: np.ndarray
    """These unknowns [N], (p,)."""
    span: np.ndarray
    """First and last + 1 of the ports of `pushed`; none where there are no such sums, (2,)."""
    slipped: np.ndarray
    """Whether a cone slips, a step ago or in the step, at its first port, (p,)."""


class Arrays(NamedTuple):
    """All arrays of the loop."""

    constants: Constants
    state: State
    problem: Problem
    log: ImpactLog


class Loop(NamedTuple):
    """The arrays of a run as the core takes them; they have all but the constants in common."""

    whole: Arrays
    """For whole steps."""
    part: Arrays
    """For parts of steps."""
    impact: Arrays
    """For impacts: `columns` are velocities per impulse [1/kg]."""


class Given(NamedTuple):
    """What the scene gives over time, one row per step; loads of fields are the loop's."""

    loads: np.ndarray
    """Given loads [N]: means of each step, and at its end, (2, steps, g)."""
    crank: np.ndarray
    """Driven points of joints at the end of each step, (steps, j, 4)."""
    driven: np.ndarray
    """Measures that the drives give at the end of each step [m], (steps, D)."""


class Found(NamedTuple):
    """Histories, one row per sample."""

    forces: np.ndarray
    """Mean resultant of each contact, friction included [N], (t, k, 3)."""
    energies: np.ndarray
    loads: np.ndarray
    """Mean force of each port of joints, given loads and drives [N], (t, L)."""
    q: np.ndarray
    v: np.ndarray
    ports: np.ndarray
    """Forces of the ports [N], (t, p), each at the ends of the samples."""
    lengths: np.ndarray
    """Length error of each joint [m], (t, j)."""
