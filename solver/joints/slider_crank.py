"""A crank of constant speed with a massless rod of constant length to a point of a body."""

import math
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from gudgeon.solver.forces.expression import function_of
from gudgeon.solver.forces.signals import Function
from gudgeon.solver.joints.markers import Marker
from gudgeon.solver.numbers import Angle, Length, RotationRate
from gudgeon.solver.vectors import Direction, Place, unit


class SliderCrank(Marker):
    """The crank pin is at centre + radius (cos θ along + sin θ lateral), θ = start + speed t; a massless rod holds a
    point of the body."""

    kind: Literal["slider-crank"]
    crank_radius: Length = Field(description="Distance of the crank pin from the axis of the crank")
    rod_length: Length = Field(description="Between crank pin and piston pin [m]")
    speed: RotationRate = Field(description="Speed of the crank")
    start: Angle = Field(
        default=0.0,
        description="Crank angle at the start, from the upper dead centre [deg]",
    )
    centre: Place = Field(default=(0.0, 0.0, 0.0), description="Crank axis [m]")
    along: Direction = Field(default=(0.0, 0.0, 1.0), description="From the crank axis to the upper dead centre")
    lateral: Direction = Field(default=(1.0, 0.0, 0.0), description="Velocity direction of the pin at that point")

    @model_validator(mode="after")
    def _fits(self) -> "SliderCrank":
        along, lateral = self.axes
        if abs(along @ lateral) > 1e-9:
            raise ValueError("along and lateral must be at right angles")
        if self.rod_length <= self.crank_radius:
            raise ValueError(
                f"rod_length is {self.rod_length} m, it must be above crank_radius = {self.crank_radius} m plus the"
                " offset of the pin"
            )
        return self

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Unit vectors `along` and `lateral`, (3,) each."""
        return unit(self.along), unit(self.lateral)

    @property
    def rate(self) -> float:
        """Speed of the crank [rad/s]."""
        return self.speed * 2 * np.pi / 60

    def angle(self, time: np.ndarray) -> np.ndarray:
        """Return the crank angle [rad] at times [s]."""
        return np.radians(self.start) + self.rate * time

    def crank_pin(self, time: np.ndarray) -> np.ndarray:
        """Return lateral and along position [m] of the crank pin and their rates [m/s], (t, 4)."""
        along, lateral = self.axes
        centre = np.asarray(self.centre, float)
        angle, r, rate = self.angle(time), self.crank_radius, self.rate
        return np.column_stack(
            [
                centre @ lateral + r * np.sin(angle), centre @ along + r * np.cos(angle),
                r * rate * np.cos(angle), -r * rate * np.sin(angle),
            ]
        )  # fmt: skip

    def pin(self, axis: int) -> Function:
        """Return the way of the crank pin from the centre along an axis of the scene over time [m]."""
        along, lateral = (float(line[axis]) for line in self.axes)
        angle = f"({math.radians(self.start)!r} + {self.rate!r}*t)"
        text = f"{self.crank_radius!r}*({along!r}*cos{angle} + {lateral!r}*sin{angle})"
        return function_of(text, "joint")

    def piston_pin(self, time: np.ndarray, lateral: float, lateral_rate: float = 0.0) -> np.ndarray:
        """Return position, velocity and acceleration along of a pin at a lateral coordinate, SI units, (t, 3).

        Args:
            lateral: [m]
            lateral_rate: Its constant rate [m/s].

        Raises:
            ValueError: the rod does not reach the pin at every time.
        """
        pin = self.crank_pin(time)
        across = lateral - pin[:, 0]
        if np.abs(across).max() >= self.rod_length:
            raise ValueError("the rod does not reach the pin")
        height = np.sqrt(self.rod_length**2 - across**2)
        rate = across * (pin[:, 2] - lateral_rate) / height
        turn = self.rate**2
        centre = np.asarray(self.centre, float)
        along, side = self.axes
        swing = -turn * (pin[:, 0] - centre @ side)
        curve = (-((pin[:, 2] - lateral_rate) ** 2) + across * swing - rate**2) / height
        return np.column_stack([pin[:, 1] + height, pin[:, 3] + rate, -turn * (pin[:, 1] - centre @ along) + curve])

    def tangent(self, time: np.ndarray, lateral: float) -> np.ndarray:
        """Return tan β of the rod, (lateral of pin − crank pin) over height, (t,): side force on the pin per axial."""
        across = lateral - self.crank_pin(time)[:, 0]
        return across / np.sqrt(self.rod_length**2 - across**2)
