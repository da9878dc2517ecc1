"""What every run of an integrator fills in and tells."""

from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from gudgeon.solver.result import Result


class Samples(NamedTuple):
    """What an integrator fills, one row a sample. Shapes: s samples, k contacts, L loads, r rigid coordinates."""

    forces: np.ndarray
    """Mean resultant on the body of each contact [N], (s, k, 3)."""
    energies: np.ndarray
    """As in `Trajectory`, at the end [J], (s, 5)."""
    loads: np.ndarray
    """Mean of each load row, (s, L)."""
    snapshots: np.ndarray
    """Rigid coordinates, their rates, length errors of the joints, at the end, (s, 2 r + j)."""
    gauges: np.ndarray
    """At the end, (s, G); no columns where the integrator reads none."""


@dataclass(frozen=True)
class Outcome:
    """Shapes: m coordinates, c contact rows, F functions of traction spaces, k contacts."""

    q: np.ndarray
    v: np.ndarray
    multipliers: np.ndarray
    """[N], (c,)"""
    impulses: np.ndarray
    """[N s], (c,)"""
    extreme: np.ndarray
    """E₀, largest energy error, largest exchange [J], deepest penetration [m], first and last contact [s], (6,)."""
    counts: np.ndarray
    """Active rows, steps in contact, pivots, and more that an integrator counts."""
    masters: np.ndarray
    """Outward displacement of the functions [m], (F,)."""
    master_impulses: np.ndarray
    """On the functions [N s], (F,)."""
    drag_impulse: np.ndarray
    """Along the way of each contact [N s], (k,)."""
    impacts: list[np.ndarray] = field(default_factory=list)
    """Impacts of each contact as in `Trajectory.impacts`, (b, 7) each; none where the integrator locates none."""
    drags: np.ndarray = field(default_factory=lambda: np.empty(0))
    """Friction's impulse on each row [N s], (c,)."""
    slips: list[list[tuple[float, bool]]] = field(default_factory=list)
    """Of each contact, times at which a point begins to slip, True, or sticks, False [s]."""
    springs: np.ndarray = field(default_factory=lambda: np.empty(0))
    """Impulse of each spring, positive where it pulls [N s], (b,)."""
    work: dict[str, int] = field(default_factory=dict)
    """What the integrator counts of its own."""


class Marching(Protocol):
    """A run of an integrator, made of a system and its step, or sample interval where its steps are its own [s]."""

    failure: Result
    """Why it could not go on."""

    def advance(self, first: int, stride: int, out: Samples) -> bool:
        """Fill samples of `stride` steps from number `first`; False where it failed."""
        ...

    def outcome(self) -> Outcome:
        """Return where the run stands."""
        ...
