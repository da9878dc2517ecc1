"""What a run tells, as the rules read it: numbers alone, of a scene of any kind."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class FirstContact:
    """The first contact of a run: of located impacts, or of the sampled force."""

    start: float
    """[s]"""
    impulse: float
    """[N s]"""
    duration: float
    """[s]"""
    force: float
    """Largest [N], over one period of the highest kept frequency where bodies ring; 0 where an impact takes no time."""


@dataclass(frozen=True)
class Impacts:
    """A contact of one row between rigid bodies, or under Newton's restitution."""

    restitution: float | None
    """What its bodies part with; None where no closed form knows it."""
    mass: float
    """Effective mass 1 / (row · row) [kg]."""
    closing: np.ndarray
    """Speed of approach of each impact [m/s], (b,)."""
    approach: float
    """Speed of approach at the start [m/s]."""
    alone: bool
    """Whether nothing but this contact acts on rigid bodies: then its impulse is known."""
    impact: bool
    """Whether an impact takes no time, so that its loss is known."""


@dataclass(frozen=True)
class Evidence:
    """What one run found. c: contact rows."""

    frequencies: dict[str, np.ndarray] = field(default_factory=dict)
    """ω of normal modes of each component's whole mesh [rad/s]; other vectors have none of their own."""
    shear: dict[str, float] = field(default_factory=dict)
    """Shear modulus of each elastic component [Pa]."""
    estimated: float | None = None
    """Largest relative error of a kept mode's frequency that the elements' estimate tells."""
    orthogonality: float | None = None
    """Largest departure of ΦᵀMΦ from I that any component's extraction found."""
    contact: FirstContact | None = None
    readings: dict[str, tuple[float, str]] = field(default_factory=dict)
    """Value and unit of the quantities of a run without contact."""
    impacts: Impacts | None = None
    integrator: str = ""
    energy_drift: float | None = None
    momentum_residual: float | None = None
    """None where no body can move freely, or nothing pushes it."""
    momentum_round_off: float = 0.0
    """What the last digit of the bodies' own momentum is, over the impulse."""
    energy_round_off: float = 0.0
    """What the last digit of all energy is, over the energy exchanged."""
    force_round_off: float = 0.0
    """What round-off of the frequencies in contact leaves in a force found over a residual flexibility."""
    gap_round_off: float = 0.0
    """What the last digit of places is, over the least gap at the start."""
    rise: float | None = None
    """Largest growth of mechanical energy less work of loads, over the energy that is exchanged."""
    loss: float = 0.0
    """Energy dissipated [J]."""
    exchanged: float = 0.0
    """[J]"""
    penetration: float | None = None
    """Deepest overlap at a frame beyond what the bodies yield [m]."""
    penetration_bound: float | None = None
    """What layers, laws and round-off allow for the energy that is there [m]."""
    condition: float | None = None
    """Of the contacts' compliance or mobility at unit diagonal; of the kept stiffness where nothing touches."""
    steps: int = 0
    substeps: int = 1
    step: float = 0.0
    """[s]"""
    seconds: float = 0.0
    """Of modes and solver."""


@dataclass(frozen=True)
class Refusal:
    """A case that was not run to its end, and why."""

    reason: str
    seconds: float = 0.0
