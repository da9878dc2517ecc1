"""What every recipe is given and gives back."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse


@dataclass(frozen=True)
class ContactRows:
    """All contact points, traction functions and loads of a component, interface after interface."""

    B: sparse.csr_matrix
    """Displacement conjugate to each force: along the outward normal at a point, and so on, (c, dofs)."""
    pressures: np.ndarray
    """Contact forces [N] of the pressure fields that ask for a static shape, (c, k); none on loads."""


@dataclass(frozen=True)
class Reduction:
    """Elastic coordinates, diagonal in mass and stiffness."""

    angular_frequencies: np.ndarray
    """[rad/s], (m,)."""
    Phi: np.ndarray
    """(dofs, m)"""
    normal_count: int
    residual_flexibility: np.ndarray | None
    """[m/N and the like], (c, c)"""
    quality: dict[str, Any]
