"""The numbers of a run that the rules read, the same for every kind of scene."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class FirstContact:
    """The first contact of a run, from located impacts or from the sampled force."""

    start: float
    """[s]"""
    impulse: float
    """[N s]"""
    duration: float
    """[s]"""
    force: float
    """Largest force [N], averaged over the window; 0 for an impact of no duration."""


@dataclass(frozen=True)
class Impacts:
    """Impacts of a contact of one row between rigid bodies, or with Newton's restitution."""

    restitution: float | None
    """Separation speed over approach speed; None if no closed form is known."""
    mass: float
    """Effective mass 1 / (row · row) [kg]."""
    closing: np.ndarray
    """Speed of approach of each impact [m/s], (b,)."""
    approach: float
    """Speed of approach at the start [m/s]."""
    alone: bool
    """Whether the bodies are rigid and no other force acts on them: the impulse is then known."""
    impact: bool
    """Whether impacts have no duration and none are merged: the energy loss is then known."""


@dataclass(frozen=True)
class Evidence:
    """The numbers of one run."""

    frequencies: dict[str, np.ndarray] = field(default_factory=dict)
    """ω of the normal modes of each component's whole mesh [rad/s]."""
    shear: dict[str, float] = field(default_factory=dict)
    """Shear modulus of each elastic component [Pa]."""
    contrast: float = 1.0
    """Largest ratio of two moduli within a part: round-off of the stiffer one is so many times larger in the other."""
    passing: float = 0.0
    """`run.accuracy` of a mechanism that passed positions at which its joints depend on each other, by steps whose size
    round-off decides; 0 of others."""
    estimated: float | None = None
    """Largest estimated relative error of the frequency of a kept mode."""
    orthogonality: float | None = None
    """Largest deviation of ΦᵀMΦ from I of any component."""
    contact: FirstContact | None = None
    readings: dict[str, tuple[float, str]] = field(default_factory=dict)
    """Value and unit of the quantities of a run without contact."""
    impacts: Impacts | None = None
    integrator: str = ""
    energy_drift: float | None = None
    contradiction: tuple[str, float] = ("", 0.0)
    """What the record says twice and least alike, and the relative difference over the allowed one."""
    momentum_residual: float | None = None
    """None if no body can move freely, or no force acts on it."""
    momentum_round_off: float = 0.0
    """Round-off of the bodies' momentum over the impulse."""
    pulled: bool = False
    """Whether gravity acts, which adds the same to the momentum in every step."""
    energy_round_off: float = 0.0
    """Round-off of the energy over the energy exchanged."""
    force_round_off: float = 0.0
    """Relative round-off of a force computed over a residual flexibility, from the frequencies in contact."""
    gap_round_off: float = 0.0
    """Round-off of positions over the least initial gap."""
    rise: float | None = None
    """Largest increase of the mechanical energy minus the work of the loads, over the energy exchanged."""
    loss: float = 0.0
    """Energy dissipated [J]."""
    exchanged: float = 0.0
    """[J]"""
    unrest: float | None = None
    """Largest kinetic over the largest strain energy; None where nothing is deformed."""
    deepest: float | None = None
    """Deepest overlap at a frame beyond the deformation of the bodies [m]."""
    penetration: float | None = None
    """Overlap of the point that exceeds its bound most, or is nearest to it [m]."""
    penetration_bound: float | None = None
    """Its bound: overlap that layers, laws and round-off allow for the energy of the run [m]."""
    basis: float | None = None
    """Estimated relative error of the impulse due to the modal basis; None without an estimate."""
    mesh: float | None = None
    """The same due to the mesh."""
    stepped: float | None = None
    """The same due to a given step."""
    changed: float | None = None
    """Largest estimated change by a design with reused modes over its tolerance; None where no modes are reused."""
    turned: float | None = None
    """Largest rotation of a body over the limit of the scene; None where no body can turn."""
    condition: float | None = None
    """Condition number of the contacts' compliance or mobility at unit diagonal; without contacts, of the stiffness."""
    steps: int = 0
    substeps: int = 1
    step: float = 0.0
    """[s]"""
    seconds: float = 0.0
    """Wall time of the run [s]."""


@dataclass(frozen=True)
class Refusal:
    """The reason why a case did not run to its end, and the wall time until then [s]."""

    reason: str
    seconds: float = 0.0
