"""The arrays that every integrator fills during a run, and the state and totals that it returns."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from gudgeon.modaldb.records.trajectory import JointHistory, ProbeHistory
from gudgeon.modaldb.records.types import Json
from gudgeon.solver.integrators.paths import NO_PATHS, Paths
from gudgeon.solver.integrators.peaks import Peaks
from gudgeon.solver.result import Result
from gudgeon.solver.system.system import System

START_ENERGY, ENERGY_ERROR, EXCHANGED, DEEPEST = range(4)
"""Entries of `Outcome.extreme`."""
ACTIVE, CONTACT_STEPS, PIVOTS = range(3)
"""First entries of `Outcome.counts`."""
WORK = 4
"""Entry of `Samples.energies`: work of loads and joints [J]."""
PLATEAU = 1e-9
"""Relative difference of windowed forces that count as equal: their time is the middle of the first and the last."""


NO_PROBES = np.zeros((0, 0))


class Samples(NamedTuple):
    """Histories, one row per sample. Shapes: s samples, k contacts, L loads, r rigid coordinates, j joints."""

    forces: np.ndarray
    """Mean resultant on the body of each contact [N], (s, k, 3)."""
    energies: np.ndarray
    """As in `Trajectory`, at the end of the sample [J], (s, 5)."""
    loads: np.ndarray
    """Mean of each load row, (s, L)."""
    snapshots: np.ndarray
    """Rigid coordinates, their rates, length errors of the joints, at the end of the sample, (s, 2 r + j)."""
    gauges: np.ndarray
    """At the end of the sample, (s, G); no columns where the integrator reads none."""
    probes: np.ndarray = NO_PROBES
    """What probes read, at the end of the sample, (s, P)."""
    peaks: Peaks = Peaks.empty()
    """State at each contact's largest force of all samples so far; of no contact where nothing is to be kept."""
    paths: Paths = NO_PATHS
    """Displacements of the points of contacts that have one, and deflections of the bodies."""

    def part(self, here: slice) -> "Samples":
        """Return a range of the samples, with the peaks of all."""
        return self._replace(
            forces=self.forces[here], energies=self.energies[here], loads=self.loads[here],
            snapshots=self.snapshots[here], gauges=self.gauges[here], probes=self.probes[here],
            paths=self.paths.part(here),
        )  # fmt: skip

    def set_states(self, here: slice, system: System, p: np.ndarray, v: np.ndarray, pressed: np.ndarray) -> None:
        """Set what t samples record at their ends, of states p, v, (t, m), and contact forces [N], (t, c)."""
        r = len(system.rigid)
        self.snapshots[here, :r], self.snapshots[here, r : 2 * r] = p[:, system.rigid], v[:, system.rigid]
        if system.gauges:
            self.gauges[here] = system.gauged(p, v) + pressed @ system.gauge_residual.T
        if len(system.probes.names):
            self.probes[here] = system.probes.values(p, v) + pressed @ system.probes.pressed.T
        self.paths.fill(here, p, pressed)


class LinkageHistories(NamedTuple):
    """What a mechanism records itself, of the samples so far."""

    joints: dict[str, JointHistory]
    probes: dict[str, ProbeHistory]
    quantities: Json
    momentum_residual: float
    notes: list[str]
    """What is to be said of the start, one sentence each."""
    impacts: dict[str, np.ndarray]
    """Of joints with clearance, as `Trajectory.impacts`, (b, 9)."""
    wear: Json
    """Of joints that wear, what was added up over their cells."""


@dataclass(frozen=True)
class Outcome:
    """State and totals of a run. Shapes: m coordinates, c contact rows, F functions of traction spaces, k contacts."""

    q: np.ndarray
    v: np.ndarray
    multipliers: np.ndarray
    """[N], (c,)"""
    impulses: np.ndarray
    """[N s], (c,)"""
    extreme: np.ndarray
    """E₀, largest energy error, largest exchange [J], deepest penetration [m], (4,)."""
    counts: np.ndarray
    """Active rows, steps in contact, pivots, then counts that differ between integrators."""
    masters: np.ndarray = field(default_factory=lambda: np.empty(0))
    """Outward displacement of the functions [m], (F,)."""
    master_impulses: np.ndarray = field(default_factory=lambda: np.empty(0))
    """On the functions [N s], (F,)."""
    master_drags: np.ndarray = field(default_factory=lambda: np.empty(0))
    """Impulse and moment about the component's origin of each contact's friction on the body that it slides over
    [N s, N m s], (k, 6); empty where there is none."""
    drag_impulse: np.ndarray = field(default_factory=lambda: np.empty(0))
    """Of each contact along its line of sliding [N s], (k,)."""
    impacts: list[np.ndarray] = field(default_factory=list)
    """Impacts of each contact as in `Trajectory.impacts`, (b, 9) each, at the end of the run."""
    drags: np.ndarray = field(default_factory=lambda: np.empty(0))
    """Friction's impulse at each row on the first body [N s], (c, 3); empty where there is none."""
    friction: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    """Of each row on the first body [N], (c, 3); empty where none is kept."""
    rubbed: np.ndarray = field(default_factory=lambda: np.empty(0))
    """Energy that friction of each contact took [J], (k,)."""
    slips: list[list[tuple[float, bool]]] = field(default_factory=list)
    """Of each contact, times [s] at which a point begins to slip, True, or sticks, False."""
    springs: np.ndarray = field(default_factory=lambda: np.empty(0))
    """Impulse of each spring, positive where it pulls [N s], (b,)."""
    left: int = 0
    """How often a sliding point left its surface with a force."""
    work: dict[str, int | str] = field(default_factory=dict)
    """Further counts by their names."""
    jumps: Mapping[str, list[float]] = field(default_factory=dict)
    """Of a moving force as which the basis of its body changes, jumps of the energy over that of deformation."""
    linkage: Callable[[int], LinkageHistories] | None = None
    """Of a mechanism, returns what it recorded of so many samples."""


class Marching(Protocol):
    """A run of an integrator, made of a system and its step [s], or the sample interval where it chooses its steps."""

    failure: Result
    """Reason, where `advance` returned False."""
    reason: str
    """What there is to say beyond that; empty where nothing."""

    def advance(self, start_step: int, stride: int, out: Samples) -> bool:
        """Advance `len(out.forces)` samples of `stride` steps from step number `start_step`; False where this"
        " failed."""
        ...

    def outcome(self) -> Outcome:
        """Return state and totals at the present time."""
        ...

    def impacts(self) -> list[np.ndarray]:
        """Return the impacts of each contact as in `Trajectory.impacts`, (b, 9) each, present ones until now."""
        ...

    def state(self) -> dict[str, np.ndarray] | None:
        """Return all that the run goes on from after a frame, by name; None where it cannot go on from a state."""
        ...

    def resume(self, stored: Mapping[str, np.ndarray]) -> None:
        """Go on from a state of the same run, with the same bits."""
        ...
