"""Where a run stands: what every integrator tells of itself."""

from dataclasses import dataclass

import numpy as np


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
    tally: np.ndarray
    """Active rows, steps in contact, pivots, and more that an integrator counts."""
    masters: np.ndarray
    """Outward displacement of the functions [m], (F,)."""
    master_impulses: np.ndarray
    """On the functions [N s], (F,)."""
    drag_impulse: np.ndarray
    """Along the way of each contact [N s], (k,)."""
