"""A force that moves over a surface at constant speed, or is fixed; it starts as a step or rises smoothly."""

from typing import Literal

import numpy as np
from pydantic import Field

from gudgeon.solver.numbers import Coordinate, ForceValue, Speed, Strict, TimeFromZero


class MovingForce(Strict):
    """Force against the outward normal of a traction space, on a body that is undeformed at the start."""

    kind: Literal["moving"]
    body: str = Field(description="Name of a body of the scene")
    interface: str = Field(description="Interface of kind 'traction'; its knot spacing is the size of the footprint")
    force: ForceValue = Field(description="Force, positive inwards [N]")
    at: tuple[Coordinate, Coordinate] = Field(description="Coordinates across and along at the start [m]")
    speed: Speed = Field(default=0.0, description="Speed along [m/s]; 0: at rest")
    rise: TimeFromZero = Field(default=0.0, description="Rise time, as half a cosine [s]; 0: a step")

    def places(self, time: np.ndarray) -> np.ndarray:
        """Return the coordinates across and along [m], (t, 2), at times [s], (t,)."""
        return np.column_stack([np.full(len(time), self.at[0]), self.at[1] + self.speed * time])

    def amounts(self, time: np.ndarray) -> np.ndarray:
        """Return the force [N], (t,), at times [s], (t,)."""
        if self.rise == 0:
            return np.full(len(time), self.force)
        return self.force * 0.5 * (1 - np.cos(np.pi * np.clip(time / self.rise, 0.0, 1.0)))
