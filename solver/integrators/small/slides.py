"""What slides over traction spaces, as the core takes it."""

from typing import NamedTuple

import numpy as np


class Slides(NamedTuple):
    """Points that slide over traction spaces, whose functions have ports. Shapes: g sliding contacts.

    The measure of such a point is its own and a weighted sum of those of 4 × 4 functions of cubic splines; its force
    acts on them with the same weights, which change from step to step.
    """

    ports: np.ndarray
    """First and last + 1 port of the points of each contact, (g, 2)."""
    surface: np.ndarray
    """First port of its functions, their number across, and lines of them along, (g, 3)."""
    functions: np.ndarray
    """Ports of the functions of all surfaces, (F,)."""
    window: np.ndarray
    """First and last + 1 port of the functions below its points, (g, 2)."""
    row: np.ndarray
    """∂σ/∂q of the distance slid, (g, m)."""
    chart: np.ndarray
    """Start and spacing along of each traction space [m], (g, 2)."""
    sigma: np.ndarray
    """Distance slid at the end of the step, a step ago, and when rows of closed ports were made [m], (3, g)."""
    drag: np.ndarray
    """Force along the line of sliding on the slope of the deformed surface [N], (g,)."""
    drag_impulse: np.ndarray
    """[N s], (g,)."""
    over: np.ndarray
    """Whether a port is one of a point that slides, (p,)."""
    width: np.ndarray
    """Functions across of its surface, (p,)."""
    height: np.ndarray
    """Coordinate along of each point at σ = 0 [m], (p,)."""
    start: np.ndarray
    """Port of the first function across that it touches in the first line along; −1 beside the surface, (p,)."""
    across: np.ndarray
    """Its weights across, (p, 4)."""
    corner: np.ndarray
    """Port of the first function that it touches at the end of the step and a step ago; −1 beside, (2, p)."""
    along: np.ndarray
    """Its weights along at these times, (2, 4, p)."""
    free: np.ndarray
    """Gap of a point without the forces of the step's end [m], (p,)."""
    inward: np.ndarray
    """Displacement of functions without these forces, and by them [m], (2, p)."""
    left: np.ndarray
    """How many points have left their surface with a force, (1,)."""
