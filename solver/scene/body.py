"""Bodies of a scene."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from gudgeon.solver.numbers import STRICT, Positive
from gudgeon.solver.vectors import Vector

Freedom = Literal["x", "y", "z", "rx", "ry", "rz"]


ALL_FREE: tuple[Freedom, ...] = ("x", "y", "z", "rx", "ry", "rz")


class Damping(BaseModel):
    """Stiffness-proportional damping, given by the ratio that it has at one frequency."""

    model_config = STRICT
    ratio: Annotated[
        float,
        Field(gt=0, lt=1, allow_inf_nan=False, description="Of critical damping", json_schema_extra={"unit": "1"}),
    ]
    frequency: Positive = Field(description="Where it holds [Hz]", json_schema_extra={"unit": "Hz"})

    @property
    def stiffness_factor(self) -> float:
        """β of C = β K [s]; the ratio at ω is βω/2."""
        return self.ratio / (3.141592653589793 * self.frequency)


class Body(BaseModel):
    """A component put into the scene."""

    model_config = STRICT
    component: str | None = Field(default=None, description="Name of its component; the body's own name by default")
    position: Vector = Field(
        default=(0.0, 0.0, 0.0),
        description="Where the component's origin stands at the start [m]",
        json_schema_extra={"unit": "m"},
    )
    velocity: Vector = Field(
        default=(0.0, 0.0, 0.0),
        description="Of the centre of mass at the start [m/s]",
        json_schema_extra={"unit": "m/s"},
    )
    angular_velocity: Vector = Field(
        default=(0.0, 0.0, 0.0), description="At the start [rad/s]", json_schema_extra={"unit": "rad/s"}
    )
    freedom: tuple[Freedom, ...] = Field(default=ALL_FREE, description="Rigid motions that it may make; all by default")
    damping: Damping | None = None
    gauges: tuple[str, ...] = Field(default=(), description="Gauges of its component to read over time")
