"""Stiffness of a body by the loads at the start; the system makes it, a scene has none."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gudgeon.solver.forces.dashpots import Dashpots


@dataclass(frozen=True)
class LoadStiffness:
    """Springs of either sign along combinations of a body's own coordinates, b rows."""

    body: str
    interface: str | None
    """Name of the load that has the rows of the elastic coordinates; None of a rigid body."""
    rigid: np.ndarray
    """Elongation per rigid coordinate, (b, r)."""
    stiffness: np.ndarray
    """[N/m], (b,)."""
    kind: ClassVar[str] = "load stiffness"
    against: ClassVar[None] = None
    against_interface: ClassVar[None] = None
    tabled: ClassVar[bool] = False
    damped: ClassVar[bool] = False

    @property
    def elastic(self) -> bool:
        """Whether it acts on elastic coordinates."""
        return self.interface is not None

    @property
    def linear(self) -> bool:
        """Whether every spring resists: loops that take roots of stiffnesses carry no others."""
        return bool((self.stiffness > 0).all())


Made = Dashpots | LoadStiffness
"""Forces that the system makes; a scene has none."""
