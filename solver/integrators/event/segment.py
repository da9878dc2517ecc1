"""Motion between two events."""

from dataclasses import dataclass

import numpy as np

from gudgeon.solver.integrators.event.motion import Course, Motion
from gudgeon.solver.integrators.event.regimes import Regime, Watch
from gudgeon.solver.integrators.event.search import first_crossing


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
    """Event at its end, None at the run's end."""


def segment(
    start: float, motion: Motion, regime: Regime, watched: Course, run_end: float, *, floor: np.ndarray | None = None
) -> Segment:
    """Return the motion from `start` to the first event, at the run's end `run_end` [s] at the latest.

    Args:
        watched: The functions of the regime's events.
        floor: As in `first_crossing`.
    """
    crossing = first_crossing(watched, run_end - start, floor)
    if crossing is None:
        return Segment(start, motion, regime, run_end, None)
    return Segment(start, motion, regime, start + crossing[0], regime.events[crossing[1]])
