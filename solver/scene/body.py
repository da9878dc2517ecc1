"""Bodies of a scene."""

from typing import Annotated, Literal

from pydantic import Field

from gudgeon.solver.numbers import Frequency, PositiveRatio, Strict
from gudgeon.solver.vectors import Place, Spin, Velocity

Freedom = Literal["x", "y", "z", "rx", "ry", "rz"]


ALL_FREE: tuple[Freedom, ...] = ("x", "y", "z", "rx", "ry", "rz")


class Damping(Strict):
    """Stiffness-proportional damping, given by its damping ratio at one frequency."""

    ratio: Annotated[PositiveRatio, Field(lt=1)] = Field(
        description="Damping ratio at `frequency`, relative to critical damping"
    )
    frequency: Frequency = Field(description="Frequency of that damping ratio [Hz]")

    @property
    def stiffness_factor(self) -> float:
        """β of C = β K [s]; the ratio at ω is βω/2."""
        return self.ratio / (3.141592653589793 * self.frequency)


class Body(Strict):
    """A component placed in the scene, with its state at the start."""

    component: str | None = Field(default=None, description="Name of its component; default: the name of the body")
    position: Place = Field(default=(0.0, 0.0, 0.0), description="Position of the component's origin at the start [m]")
    velocity: Velocity = Field(default=(0.0, 0.0, 0.0), description="Velocity of the centre of mass at the start [m/s]")
    angular_velocity: Spin = Field(
        default=(0.0, 0.0, 0.0),
        description="Angular velocity at the start [rad/s]",
    )
    freedom: tuple[Freedom, ...] = Field(default=ALL_FREE, description="Free rigid motions; default: all")
    damping: Damping | None = None
    gauges: tuple[str, ...] = Field(default=(), description="Gauges of its component to record over time")
