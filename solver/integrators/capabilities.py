"""What an integrator tells of itself before any system exists, so that a scene can be checked without a compiler."""

import math
from enum import Enum
from typing import ClassVar


class Feature(Enum):
    """What a scene can have and not every integrator can carry."""

    COMPLIANT_CONTACT = "contact over residual flexibility or a surface layer, without a law"
    LINEAR_LAW = "contact with a linear law"
    SMOOTH_LAW = "contact with a nonlinear law"
    RIGID_CONTACT = "contact by multipliers and blows"
    SLIDING_PAIR = "points that slide over the traction space of another body"
    DASHPOT = "dashpots beside residual flexibility"
    DAMPING = "damping of modes"
    GAUGES = "gauges read at every sample"
    JOINT = "joints that prescribe motion"
    LOAD = "forces given over time"
    SPRING = "springs between bodies"
    SPRING_DAMPING = "dashpots beside springs"
    GRAVITY = "gravity"


class Integrator:
    """Capabilities of an integrator; each stands in the `__init__` of its folder, beside the code that it names."""

    run: ClassVar[str]
    """`module:class` of its runs, imported when one starts: exact motion does not wait for a compiler."""
    carries: ClassVar[frozenset[Feature]]
    order: ClassVar[float]
    """Of its error in the step, infinite if motion is exact: then it takes no step."""
    promised_drift: ClassVar[float]
    """Energy drift at the step that a scene comes with, beside round-off of the scene's numbers."""
    own_steps: ClassVar[bool] = False
    """Whether it chooses its steps between samples."""
    step_factor: ClassVar[float] = 0.2
    """dt·ω_c of the step that it takes where none is given."""
    largest: ClassVar[float] = math.inf
    """dt·ω_c of a given step above which it is divided, because it would step over blows or gain energy."""
    stiffest: ClassVar[float] = math.inf
    """ω_c over the highest kept frequency above which steps follow the latter."""
    conserves_energy: ClassVar[bool] = False
    """Whether energy is kept to round-off at any step, so that impulses tell its accuracy and the drift does not."""
    counts_blows: ClassVar[bool] = True
    """Whether blows in its force history and the velocities with which bodies leave are quantities of its runs."""
    staggered: ClassVar[bool] = False
    """Whether frames end half a step after their contact forces."""
    records_motion: ClassVar[bool] = True
    """Whether it samples the rigid coordinates."""
