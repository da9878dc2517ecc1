"""A spring between a point of a body and the ground or another body."""

from typing import Literal

from pydantic import Field, model_validator

from gudgeon.solver.numbers import Coordinate, DampingConstant, Stiffness, Strict
from gudgeon.solver.vectors import Direction, Place


class Spring(Strict):
    """Linear spring along one direction, relaxed at the start; it acts on rigid bodies."""

    kind: Literal["spring"]
    body: str
    against: str | None = Field(default=None, description="Other body; default: the ground")
    direction: Direction = Field(description="Direction of any length")
    at: Place = Field(
        default=(0.0, 0.0, 0.0),
        description="Point of the body, in its component's axes and relative to its origin [m]",
    )
    stiffness: Stiffness
    damping: DampingConstant = 0.0
    stretch: Coordinate = Field(default=0.0, description="Elongation at the start [m]")

    @model_validator(mode="after")
    def _two(self) -> "Spring":
        if self.against == self.body:
            raise ValueError("a spring needs two bodies, or one and the ground")
        return self
