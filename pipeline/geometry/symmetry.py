"""How a sector makes a wheel: number of sectors, the two faces, the axis."""

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, field_validator


class CyclicSymmetry(BaseModel):
    """How a sector makes a wheel."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    sectors: int = Field(ge=2, description="Number of equal sectors of the wheel")
    low: str = Field(default="low", description="Surface on which the sector before begins")
    high: str = Field(default="high", description="The low surface, turned about the axis by one sector")
    axis: tuple[float, float, float] = Field(
        default=(0.0, 0.0, 1.0), description="Axis of the wheel, right-handed", json_schema_extra={"unit": "1"}
    )
    origin: tuple[float, float, float] = Field(
        default=(0.0, 0.0, 0.0), description="A point of the axis [m]", json_schema_extra={"unit": "m"}
    )

    @field_validator("axis")
    @classmethod
    def _is_a_direction(cls, value: tuple[float, float, float]) -> tuple[float, float, float]:
        if not 0 < np.linalg.norm(value) < np.inf:
            raise ValueError(f"{list(value)} given, it must have a finite length above 0")
        return value

    @property
    def angle(self) -> float:
        """Of one sector [rad]."""
        return 2 * np.pi / self.sectors

    @property
    def rotation(self) -> np.ndarray:
        """R, from one sector to the next, (3, 3)."""
        x, y, z = np.array(self.axis) / np.linalg.norm(self.axis)
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        return np.eye(3) + np.sin(self.angle) * cross + (1 - np.cos(self.angle)) * (cross @ cross)

    def harmonics(self) -> range:
        """Return the harmonics 0…N/2."""
        return range(self.sectors // 2 + 1)

    def multiplicity(self, harmonic: int) -> int:
        """Return how often the wheel has each frequency of a harmonic: n and N − n are two."""
        return 1 if (2 * harmonic) % self.sectors == 0 else 2
