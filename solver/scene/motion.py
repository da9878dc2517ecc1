"""Driven bodies of a scene: motions prescribed over time."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from gudgeon.solver.forces.expression import function_of
from gudgeon.solver.forces.given import BY_VALUES
from gudgeon.solver.forces.given import EXPRESSION as GRAMMAR
from gudgeon.solver.forces.history import History
from gudgeon.solver.forces.jumps import jump_of
from gudgeon.solver.numbers import Coordinate, Ratio, TimeValue
from gudgeon.solver.vectors import Direction, Place


class Drive(History):
    """A motion over time of a rigid body, or of an interface; a member sets the unit of its amount."""

    unbounded: ClassVar[str] = "velocity"
    interface: str | None = Field(
        default=None,
        description="Interface of the body that moves so, of kind 'mean' or 'tie'; needed on elastic bodies",
    )
    direction: Direction = Field(description="Direction, or axis, of any length, in the axes of the scene")
    held: bool = Field(
        default=False,
        description="Whether the other motions of the interface, two of a 'mean' or five of a 'tie', are held at zero"
        " where no other motion gives them",
    )
    interpolation: Literal["cubic", "linear"] = Field(
        default="cubic",
        description="Of the rows of a table: a spline with continuous acceleration, or lines, with a jump of velocity"
        " at each row",
    )

    @model_validator(mode="after")
    def _held_interface(self) -> "Drive":
        if self.held and self.interface is None:
            raise ValueError("held needs an interface; what else a rigid body does is held by body.NAME.freedom")
        return self

    def _tabled(self, times: np.ndarray) -> np.ndarray:
        """Return what the table has at times within it [s], (t, 2)."""
        from scipy.interpolate import CubicSpline, PPoly

        knots, values = np.array(self.values, float).T
        if self.interpolation == "cubic":
            curve = CubicSpline(knots, values)
        else:
            curve = PPoly(np.array([np.diff(values) / np.diff(knots), values[:-1]]), knots)
        clipped = np.clip(times, knots[0], knots[-1])
        return np.column_stack([curve(clipped), curve.derivative()(clipped)])

    def places(self, times: np.ndarray, path: str) -> np.ndarray:
        """Return motion [m or rad] and its rate at times [s], (t, 2).

        Raises:
            SceneError: one of them is not finite; it names the motion `path`.
        """
        if self.expression is not None:
            return function_of(self.expression, f"{path}.expression").read(times, 1)
        return self._tabled(times)

    def jump(self, times: np.ndarray, path: str) -> float | None:
        """Return a time [s] between given ones, (t,), at which the motion jumps, as by `step`; None without one."""
        self.places(times, path)  # Refuses an expression that is not finite at one of them.
        if self.expression is None or "step" not in self.expression:
            return None
        return jump_of(lambda t: self.places(t, path)[:, 0], times)


class Translation(Drive):
    """Displacement along a direction, from the body as the scene places it."""

    kind: Literal["translation"]
    at: Place | None = Field(
        default=None,
        description="Point of a rigid body that moves so, in its component's axes and relative to its origin [m];"
        " default: the origin",
    )
    values: tuple[tuple[TimeValue, Coordinate], ...] = Field(
        default=(), description=BY_VALUES, json_schema_extra={"unit": ["s", "m"]}
    )
    expression: str | None = Field(
        default=None, description="Displacement [m]" + GRAMMAR, json_schema_extra={"unit": ["s", "m"]}
    )

    @model_validator(mode="after")
    def _one_place(self) -> "Translation":
        if self.interface is not None and self.at is not None:
            raise ValueError("give one of: interface, at")
        return self


class Rotation(Drive):
    """Small rotation about an axis, by the right hand."""

    kind: Literal["rotation"]
    values: tuple[tuple[TimeValue, Ratio], ...] = Field(
        default=(), description=BY_VALUES, json_schema_extra={"unit": ["s", "rad"]}
    )
    expression: str | None = Field(
        default=None, description="Rotation [rad]" + GRAMMAR, json_schema_extra={"unit": ["s", "rad"]}
    )


Motion = Annotated[Translation | Rotation, Field(discriminator="kind")]
