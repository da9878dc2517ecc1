"""Joints on other joints: two that turn together, and one whose motion is given over time."""

from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field, field_validator

from gudgeon.solver.forces.expression import function_of
from gudgeon.solver.forces.given import BY_VALUES, EXPRESSION
from gudgeon.solver.forces.history import LOOKED_AT, Amount
from gudgeon.solver.forces.jumps import jump_of
from gudgeon.solver.forces.signals import Function, spline
from gudgeon.solver.numbers import PositiveRatio, Ratio, Strict, TimeValue

KINKED = ("step", "abs", "min", "max")
"""Functions of expressions that jump, or whose rates do."""


class Gear(Strict):
    """Two joints that turn together: angle = ∓ ratio · angle of the other, each about its own axis since the start."""

    kind: Literal["gear"]
    joint: str = Field(description="Revolute, cylindrical or screw joint")
    other: str = Field(description="Another one")
    ratio: PositiveRatio = Field(description="Turns of `joint` for one turn of `other`; teeth of `other` over `joint`")
    meshing: Literal["external", "internal"] = Field(
        default="external",
        description="external: the joints turn in opposite directions, seen along their axes; internal: in the same",
    )

    @field_validator("ratio", mode="before")
    @classmethod
    def _has_no_sign(cls, value: Any) -> Any:
        if isinstance(value, int | float) and value <= 0:
            direction = 'meshing = "external" or "internal" gives the direction'
            raise ValueError(f"{value:g} given; allowed: above 0; {direction}")
        return value

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints that it couples."""
        return self.joint, self.other

    @property
    def signed_ratio(self) -> float:
        """Angle of the joint over that of the other."""
        return -self.ratio if self.meshing == "external" else self.ratio


BETWEEN = np.linspace(0.0, 1.0, 9)
"""Places between two rows of a table at which its spline is read."""
OVERSHOT = 0.25
"""How far the spline of a table leaves the range of its rows, over that range, from which on it is said."""
ASTRAY = 1e3
"""The same from which on it is refused: rows that jump, which asks for an infinite acceleration."""


class Driven(Amount):
    """The angle or displacement of a joint, given over time, in addition to what it is at the start."""

    unbounded: ClassVar[str] = "acceleration"
    kind: Literal["driven"]
    joint: str = Field(description="Revolute, cylindrical, screw or translational joint")
    motion: Literal["angle", "displacement"] | None = Field(
        default=None,
        description="What is given; default: the displacement of a translational joint, the angle of others",
    )
    values: tuple[tuple[TimeValue, Ratio], ...] = Field(
        default=(), description=BY_VALUES + ", by a cubic spline", json_schema_extra={"unit": ["s", "rad or m"]}
    )
    expression: str | None = Field(
        default=None,
        description="Angle [rad] or displacement [m]" + EXPRESSION,
        json_schema_extra={"unit": ["s", "rad or m"]},
    )

    @property
    def joints(self) -> tuple[str, ...]:
        """Name of the joint that it drives."""
        return (self.joint,)

    def given(self, joint: object) -> str:
        """Return what is given of the joint that it drives: its displacement if that slides alone, else its angle."""
        slides = getattr(joint, "slides", False) and not getattr(joint, "turns", False)
        return self.motion or ("displacement" if slides else "angle")

    def function(self, key: str) -> Function:
        """Return the motion over time, of which refusals name the joint `key`."""
        return spline(self.values) if self.expression is None else function_of(self.expression, f"{key}.expression")

    def overshoot(self, duration: float) -> tuple[str, bool] | None:
        """Return where the spline of a table leaves the range of its rows in a run [s] by much, and whether by so much
        that it is refused; None where not."""
        if not self.values:
            return None
        (start, stop), row_values = (0.0, duration), np.array(self.values, float)[:, 1]
        low, high = float(row_values.min()), float(row_values.max())
        knots = np.array(self.values, float)[:, 0]
        times = np.unique(np.clip((knots[:-1, None] + np.diff(knots)[:, None] * BETWEEN).ravel(), start, stop))
        curve = spline(self.values).read(times)[:, 0]
        beyond = np.maximum(curve - high, low - curve)
        peak = int(beyond.argmax())
        if beyond[peak] <= OVERSHOT * (high - low):
            return None
        text = (
            f"values: the cubic spline through its rows, which lie between {low:.6g} and {high:.6g}, reaches"
            f" {curve[peak]:.6g} at {times[peak]:.6g} s; give rows as close together around a change as within it, or"
            " an expression"
        )
        return text, bool(beyond[peak] > ASTRAY * (high - low))

    def _course(self, times: np.ndarray) -> np.ndarray:
        assert self.expression is not None
        return function_of(self.expression, "").plain(times, 2)

    def jump(self, duration: float, key: str) -> tuple[str, float] | None:
        """Return what jumps, 'motion' or 'velocity', and when [s]; None without a jump.

        Raises:
            SceneError: motion, rate or second rate is not finite at a time.
        """
        grid = np.linspace(0.0, duration, LOOKED_AT)
        function = self.function(key)
        function.read(grid, 2)
        if self.expression is None or not any(name in self.expression for name in KINKED):
            return None
        for order, quantity in enumerate(("motion", "velocity")):
            time = jump_of(lambda t, order=order: function.read(t, order)[:, order], grid)
            if time is not None:
                return quantity, time
        return None
