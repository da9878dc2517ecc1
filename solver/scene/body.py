"""Bodies of a scene."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from gudgeon.solver.numbers import EachOnce, Strict
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
    freedom: Annotated[tuple[Freedom, ...], EachOnce] = Field(
        default=ALL_FREE, description="Free rigid motions along and about the axes of the scene; default: all"
    )
    damping: Damping | None = Field(default=None, description="Damping of the elastic motion; none by default")
    attachment: Literal["mean-axis", "fixed"] = Field(
        default="mean-axis",
        exclude_if=lambda value: value == "mean-axis",
        description="Frame of a body that deforms and turns by any angle. mean-axis: the frame of its free modes, which"
        " elastic motion alone does not turn; fixed: it turns with the interface `attached_to`",
    )
    attached_to: str | None = Field(
        default=None,
        exclude_if=lambda value: value is None,
        description="Interface of kind 'tie' with which the frame turns; for attachment 'fixed'",
    )
    geometric_stiffness: bool = Field(
        default=True,
        exclude_if=lambda value: value,
        description="Whether loads stiffen or soften the body: in small motion weight, loads and the forces of springs,"
        " motions and contacts at the start, as they turn it and stress it along; of a body that deforms and turns by"
        " any angle the stress by rotation, reactions and loads; false: without it",
    )
    gauges: Annotated[tuple[str, ...], EachOnce] = Field(
        default=(), description="Gauges of its component to record over time"
    )

    @model_validator(mode="after")
    def _attached(self) -> "Body":
        if (self.attachment == "fixed") != (self.attached_to is not None):
            raise ValueError(
                "attachment 'fixed' needs attached_to, an interface of kind 'tie', and 'mean-axis' has none"
            )
        return self
