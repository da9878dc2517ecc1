"""Motion between two events."""

from dataclasses import dataclass

from gudgeon.solver.integrators.event.motion import Motion
from gudgeon.solver.integrators.event.regimes import Regime, Watch


@dataclass(frozen=True)
class Segment:
    """Exact motion under one regime."""

    start: float
    """[s]"""
    motion: Motion
    regime: Regime
    end: float
    """Time of the next event, or of the run's end [s]."""
    event: tuple[Watch, int] | None
    """What happens at its end."""
