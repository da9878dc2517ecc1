"""Forces, torques and pressures whose amount is given over time."""

from collections.abc import Callable
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from gudgeon.solver.forces.history import History, Point
from gudgeon.solver.numbers import ForceValue, Pressure, Ratio, TimeValue, TorqueValue
from gudgeon.solver.vectors import Direction, Place, unit

BY_VALUES = "The same as pairs; read from the table if one is given"
EXPRESSION = (
    " as an expression of the time t [s]: numbers, t, pi, + - * / **, sin cos tan exp log sqrt abs, min(a, b),"
    " max(a, b), and step(x), which is 0 below x = 0 and 1 from there on"
)


class GivenForce(History):
    """Force along a direction, on the mean of a surface of any body or at a point of a rigid one."""

    kind: Literal["force"]
    interface: str | None = Field(default=None, description="Interface of kind 'mean', over which it is distributed")
    at: Place | None = Field(
        default=None,
        description="Point of a rigid body, in its component's axes and relative to its origin [m], instead of an"
        " interface",
    )
    direction: Direction = Field(description="Direction of any length, in the axes of the scene")
    values: tuple[tuple[TimeValue, ForceValue], ...] = Field(
        default=(), description=BY_VALUES, json_schema_extra={"unit": ["s", "N"]}
    )
    expression: str | None = Field(
        default=None, description="Force [N]" + EXPRESSION, json_schema_extra={"unit": ["s", "N"]}
    )

    @model_validator(mode="after")
    def _one_place(self) -> "GivenForce":
        if (self.interface is None) == (self.at is None):
            raise ValueError("give one of: interface, at")
        return self

    def mix(self) -> np.ndarray:
        """Return the direction, (1, 3)."""
        return unit(self.direction)[None]

    def wrench(self, turned: Callable[[Point], np.ndarray]) -> np.ndarray:
        """Return the direction and its moment, (6,)."""
        assert self.at is not None
        line = unit(self.direction)
        return np.concatenate([line, np.cross(turned(self.at), line)])


class GivenTorque(History):
    """Torque on a rigid body."""

    surface: ClassVar[str | None] = None
    kind: Literal["torque"]
    direction: Direction = Field(description="Axis of any length, in the axes of the scene, by the right hand")
    values: tuple[tuple[TimeValue, TorqueValue], ...] = Field(
        default=(), description=BY_VALUES, json_schema_extra={"unit": ["s", "N m"]}
    )
    expression: str | None = Field(
        default=None, description="Torque [N m]" + EXPRESSION, json_schema_extra={"unit": ["s", "N m"]}
    )

    def wrench(self, turned: Callable[[Point], np.ndarray]) -> np.ndarray:
        """Return no force, and the axis, (6,)."""
        return np.concatenate([np.zeros(3), unit(self.direction)])


class GivenWrench(History):
    """Force and moment on the reference point of a tie, or at a point of a rigid body: six generalised forces."""

    surface: ClassVar[str | None] = "tie"
    kind: Literal["wrench"]
    interface: str | None = Field(
        default=None, description="Interface of kind 'tie', on whose reference point it acts; needed on elastic bodies"
    )
    at: Place | None = Field(
        default=None,
        description="Point of a rigid body, in its component's axes and relative to its origin [m], instead of an"
        " interface",
    )
    force: tuple[ForceValue, ForceValue, ForceValue] = Field(
        default=(0.0, 0.0, 0.0), description="Force along x, y, z of the scene"
    )
    moment: tuple[TorqueValue, TorqueValue, TorqueValue] = Field(
        default=(0.0, 0.0, 0.0), description="Moment about x, y, z of the scene, by the right hand"
    )
    values: tuple[tuple[TimeValue, Ratio], ...] = Field(
        default=(), description=BY_VALUES, json_schema_extra={"unit": ["s", "1"]}
    )
    expression: str | None = Field(
        default=None,
        description="Factor on force and moment over time; default: 1, by `table` and `values` too" + EXPRESSION,
        json_schema_extra={"unit": ["s", "1"]},
    )

    @model_validator(mode="before")
    @classmethod
    def _constant(cls, data: Any) -> Any:
        """Set the factor to one where none is given."""
        if isinstance(data, dict) and not any(data.get(key) for key in ("table", "values", "expression")):
            return data | {"expression": "1"}
        return data

    @model_validator(mode="after")
    def _one_place(self) -> "GivenWrench":
        if (self.interface is None) == (self.at is None):
            raise ValueError("give one of: interface, at")
        return self

    def mix(self) -> np.ndarray:
        """Return its six forces over those of a tie, (6, 6)."""
        return np.eye(6)

    def share(self) -> np.ndarray:
        """Return force and moment at an amount of one [N, N m], (6,)."""
        return np.array([*self.force, *self.moment])

    def wrench(self, turned: Callable[[Point], np.ndarray]) -> np.ndarray:
        """Return the six unit forces and moments with their moments about the origin, (6, 6)."""
        assert self.at is not None
        wrenches = np.eye(6)
        wrenches[:3, 3:] = np.cross(turned(self.at), np.eye(3))
        return wrenches


class GivenPressure(History):
    """Uniform pressure on a surface, positive inwards."""

    surface: ClassVar[str | None] = "pressure"
    kind: Literal["pressure"]
    interface: str = Field(description="Interface of kind 'pressure'")
    values: tuple[tuple[TimeValue, Pressure], ...] = Field(
        default=(), description=BY_VALUES, json_schema_extra={"unit": ["s", "Pa"]}
    )
    expression: str | None = Field(
        default=None, description="Pressure [Pa]" + EXPRESSION, json_schema_extra={"unit": ["s", "Pa"]}
    )
