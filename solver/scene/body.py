"""Bodies of a scene."""

from typing import Literal

from pydantic import Field

from gudgeon.solver.numbers import Strict
from gudgeon.solver.scene.damping import Damping
from gudgeon.solver.scene.orientation import Orientation
from gudgeon.solver.vectors import Place, Spin, Velocity

Freedom = Literal["x", "y", "z", "rx", "ry", "rz"]


ALL_FREE: tuple[Freedom, ...] = ("x", "y", "z", "rx", "ry", "rz")


class Body(Strict):
    """A component placed in the scene, with its state at the start."""

    component: str | None = Field(default=None, description="Name of its component; default: the name of the body")
    position: Place = Field(default=(0.0, 0.0, 0.0), description="Position of the component's origin at the start [m]")
    orientation: Orientation | None = Field(
        default=None,
        description="Rotation of the component about its origin at the start, before `position`; default: none. The"
        " rotation may be of any size; `freedom`, velocities, contacts and forces are in the axes of the scene, gauges"
        " in those of the body",
    )
    velocity: Velocity = Field(
        default=(0.0, 0.0, 0.0), description="Velocity at the start of the centre of mass, or of `velocity_at` [m/s]"
    )
    velocity_at: Place | None = Field(
        default=None,
        description="Point of the body, in its component's axes and relative to its origin, whose velocity is given"
        " [m]; default: the centre of mass",
    )
    angular_velocity: Spin = Field(
        default=(0.0, 0.0, 0.0),
        description="Angular velocity at the start [rad/s]",
    )
    freedom: tuple[Freedom, ...] = Field(
        default=ALL_FREE, description="Free rigid motions along and about the axes of the scene; default: all"
    )
    damping: Damping | None = Field(default=None, description="Damping of the elastic motion; none by default")
    gauges: tuple[str, ...] = Field(default=(), description="Gauges of its component to record over time")
