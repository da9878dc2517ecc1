"""Cyclic symmetry of a wheel: number of sectors, the two faces of a sector, the axis."""

import numpy as np
from pydantic import Field

from gudgeon.pipeline.geometry.numbers import NonZero, Point
from gudgeon.solver.numbers import MOST, Strict


class CyclicSymmetry(Strict):
    """Cyclic symmetry of a wheel of equal sectors."""

    sectors: int = Field(ge=2, le=MOST, description="Number of equal sectors of the wheel")
    low: str = Field(default="low", description="Face of the sector towards the previous sector")
    high: str = Field(default="high", description="Face low, rotated about the axis by one sector")
    axis: NonZero = Field(default=(0.0, 0.0, 1.0), description="Axis of the wheel, right-handed")
    origin: Point = Field(default=(0.0, 0.0, 0.0), description="A point of the axis [m]")

    @property
    def angle(self) -> float:
        """Angle of one sector [rad]."""
        return 2 * np.pi / self.sectors

    @property
    def rotation(self) -> np.ndarray:
        """Rotation R from one sector to the next, (3, 3)."""
        x, y, z = np.array(self.axis) / np.linalg.norm(self.axis)
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        return np.eye(3) + np.sin(self.angle) * cross + (1 - np.cos(self.angle)) * (cross @ cross)

    def harmonics(self) -> range:
        """Return the harmonics (nodal diameters) 0…N/2."""
        return range(self.sectors // 2 + 1)

    def multiplicity(self, harmonic: int) -> int:
        """Return the multiplicity of each frequency of a harmonic: 2, for n and N − n, or 1 if they are the same."""
        return 1 if (2 * harmonic) % self.sectors == 0 else 2
