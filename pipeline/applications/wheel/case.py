"""A wheel ready to be solved, and its modes."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gudgeon.pipeline.applications.wheel.cyclic.sector import Sector
from gudgeon.pipeline.applications.wheel.cyclic.whole_wheel import Mistuning
from gudgeon.pipeline.applications.wheel.scene import Wheel


@dataclass(frozen=True)
class Case:
    """A wheel ready to be solved."""

    name: str
    """Name of the wheel in the scene, for messages."""
    wheel: Wheel
    sector: Sector
    part: sparse.csr_matrix
    """Stiffness of the blade in its sector [N/m], (dofs, dofs)."""
    row: np.ndarray
    """Mean displacement of the blade's surface along the force, over a sector's dofs, (dofs,)."""
    changes: np.ndarray
    """Relative change of each blade's stiffness, (N,)."""

    def mistuning(self, mistuned: bool) -> Mistuning | None:
        """Return the stiffness of the blades; None for the tuned wheel."""
        return Mistuning(self.part, 1 + self.changes) if mistuned else None


@dataclass(frozen=True)
class Modes:
    """Lowest elastic modes of a whole wheel, full or reduced."""

    angular_frequencies: np.ndarray
    """[rad/s], (count,)"""
    blades: np.ndarray
    """Motion of each blade in each mode [kg^-½], (N, count)."""
    counts: dict[str, float]
    """Coordinates, physical dofs kept on a face, interface modes, and the CPU time for these modes [s]."""
