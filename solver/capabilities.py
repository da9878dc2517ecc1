"""Capabilities of the integrators, without their loops, so that a scene is checked without loading the core.

A new member is a class and a line here, a name in `Run.integrator`, and a folder of that name in `integrators`, whose
`integrator.py` has the class that inherits it and integrates.
"""

import math
from enum import Enum
from typing import ClassVar

FEW_POINTS = 8
"""Contact points up to which `auto` takes located events where it can."""
MANY = 5e7
"""Steps times contact points from which steps do not begin with those that resolve contact."""


class Feature(Enum):
    """Features of a scene that not every integrator supports."""

    COMPLIANT_CONTACT = "contact over residual flexibility or a surface layer, without a law"
    LINEAR_LAW = "contact with a linear law"
    SMOOTH_LAW = "contact with a nonlinear law"
    FRICTION = "friction in the plane of contact"
    LINE_FRICTION = "friction along one line, of rigid bodies in rigid contact"
    SMOOTHED_FRICTION = "friction that rises with the sliding speed (friction.speed)"
    FRICTION_SPRING = "friction by a tangential spring (friction.stiffness)"
    EDGES = "contact with a face that has edges"
    RIGID_CONTACT = "rigid contact by multipliers and impacts"
    WEAR = "wear of contacts"
    SLIDING_PAIR = "points that slide over the traction space of another body"
    TWO_BODIES = "contact between two bodies"
    DASHPOT = "dashpots parallel to residual flexibility"
    DAMPING = "damping of modes"
    GAUGES = "gauges read at every sample"
    PROBES = "probes read at every sample"
    JOINT = "slider-cranks"
    MOTION = "motions of bodies given over time"
    LOAD = "forces given over time"
    SPRING = "springs between bodies"
    ELASTIC_SPRING = "springs on interfaces of components"
    SPRING_TABLE = "springs by a table, and dampers without stiffness"
    SPRING_DAMPING = "dashpots parallel to springs"
    GRAVITY = "gravity"
    MECHANISM = "joints between bodies that turn by any angle"
    POINT_LOAD = "forces at points of rigid bodies, and torques, given over time"
    POINT_SPRING = "springs between two points whose line turns with them"
    FIELD = "electrostatic fields and adhesion"
    ELECTRODE = "electrostatic pressure on points of a surface"


IMPULSIVE = frozenset({Feature.COMPLIANT_CONTACT, Feature.TWO_BODIES, Feature.DASHPOT, Feature.GAUGES, Feature.PROBES})
"""Features of scenes in which nothing but contact over a compliance acts on undamped bodies."""
UNTOUCHED = 10.0
"""Largest dt·ω_c of a given step in a scene without contacts: only the motion of the modes must be resolved."""


class Integrator:
    """Capabilities of an integrator; every member sets those without a value here."""

    carries: ClassVar[frozenset[Feature]]
    preferred: ClassVar[frozenset[Feature] | None] = None
    """Features that its fastest loop carries; where a scene has others and is not `IMPULSIVE`, `auto` takes it last.
    None: all of them."""
    order: ClassVar[float]
    """Convergence order of its error in the step; infinite if its motion is exact, without a step."""
    promised_drift: ClassVar[float]
    """Largest energy drift at the default step, in addition to round-off of the scene's numbers."""
    accuracy: ClassVar[float] = math.nan
    """Default of `run.accuracy` where it is that of the motion, which chooses the steps."""
    own_steps: ClassVar[bool] = False
    """Whether it chooses its steps between samples."""
    step_factor: ClassVar[float] = 0.2
    """dt·ω_c of the default step."""
    resolving: ClassVar[float | None] = None
    """The same of scenes that are `IMPULSIVE` or have points on a law alone, whose step resolves contact; None: as
    others."""
    largest: ClassVar[float] = math.inf
    """dt·ω_c of a given step above which the step is divided, since it would miss impacts or gain energy."""
    sticking: ClassVar[float] = math.inf
    """As `largest`, with friction over the flexibility of bodies, where ω_c is that of points it holds."""
    stiffest: ClassVar[float] = math.inf
    """ω_c over the highest kept frequency above which the latter determines the step."""
    reason: str = ""
    """Why a run could not continue, where there is more to say than its result."""
    turns: ClassVar[bool] = False
    """Whether bodies turn by any angle, with gyroscopic terms; otherwise rotations are small."""


class Small(Integrator):
    """For every feature; stiff surfaces do not reduce its step. Sliding pairs have a loop of their own."""

    carries = frozenset(Feature) - {
        Feature.MECHANISM, Feature.POINT_SPRING, Feature.SMOOTHED_FRICTION, Feature.FRICTION_SPRING
    }  # fmt: skip
    preferred = frozenset(
        {
            Feature.COMPLIANT_CONTACT, Feature.TWO_BODIES, Feature.SLIDING_PAIR, Feature.DAMPING, Feature.JOINT,
            Feature.LOAD, Feature.POINT_LOAD, Feature.GRAVITY, Feature.WEAR, Feature.PROBES,
        }
    )  # fmt: skip
    order = 2
    promised_drift = 2e-3
    step_factor = 4.0
    resolving = 0.4
    largest = 40.0
    sticking = 4.0
    stiffest = 30.0


class Event(Integrator):
    """For linear and rigid contact of a few points, with exact motion between events."""

    carries = frozenset(
        {
            Feature.COMPLIANT_CONTACT, Feature.LINEAR_LAW, Feature.RIGID_CONTACT, Feature.TWO_BODIES, Feature.DASHPOT,
            Feature.GAUGES, Feature.PROBES, Feature.SPRING, Feature.SPRING_DAMPING, Feature.GRAVITY,
            Feature.LINE_FRICTION, Feature.WEAR,
        }
    )  # fmt: skip
    order = math.inf
    promised_drift = 1e-9
    own_steps = True


class Turning(Integrator):
    """For bodies that turn by any angle, held by joints. Steps of order 8 with projection."""

    carries = frozenset(
        {
            Feature.MECHANISM, Feature.POINT_LOAD, Feature.POINT_SPRING, Feature.GRAVITY, Feature.PROBES,
            Feature.DAMPING, Feature.COMPLIANT_CONTACT, Feature.LINEAR_LAW, Feature.SMOOTH_LAW, Feature.FRICTION,
            Feature.SMOOTHED_FRICTION, Feature.FRICTION_SPRING, Feature.FIELD, Feature.GAUGES, Feature.SLIDING_PAIR,
            Feature.JOINT,
        }
    )  # fmt: skip
    order = 8
    accuracy = 1e-8
    promised_drift = 1e-6
    own_steps = True
    turns = True


INTEGRATORS: dict[str, type[Integrator]] = {
    "small": Small,
    "event": Event,
    "turning": Turning,
}
"""Members by the name that a scene writes, in the order in which `auto` prefers them."""
