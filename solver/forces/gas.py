"""Gas pressure on a surface as a function of a crank angle."""

from collections.abc import Callable
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from gudgeon.solver.numbers import Angle, Pressure, Strict


class GasPressure(Strict):
    """Pressure above ambient on an interface of kind 'pressure', as a function of a joint's crank angle."""

    kind: Literal["gas"]
    body: str = Field(description="Name of a body of the scene")
    interface: str = Field(description="Interface of kind 'pressure'")
    joint: str = Field(description="Joint that defines the crank angle")
    table: str | None = Field(
        default=None,
        description="CSV: crank angle [deg], absolute pressure [Pa]; periodic over its span, smooth, and nowhere"
        " outside its rows",
    )
    values: tuple[tuple[Angle, Pressure], ...] = Field(
        default=(),
        description="The same as pairs; read from the table if one is given",
        json_schema_extra={"unit": ["deg", "Pa"]},
    )
    ambient: Pressure = Field(default=1.0e5, description="Pressure on the other side of the surface [Pa]")

    @model_validator(mode="after")
    def _given(self) -> "GasPressure":
        if self.table is None and len(self.values) < 2:
            raise ValueError("give a table")
        return self

    def over_angle(self) -> Callable[[np.ndarray], np.ndarray]:
        """Return the pressure above ambient [Pa] over the crank angle [rad], smooth and between the rows' pressures.

        Source: Fritsch, Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300: a spline would leave them, in tables of few
        rows below zero.
        """
        from scipy.interpolate import PchipInterpolator

        degrees, absolute = np.array(self.values, float).T
        span = degrees[-1] - degrees[0]
        around = np.concatenate([degrees[:-1] - span, degrees[:-1], degrees[:-1] + span, [degrees[-1] + span]])
        curve = PchipInterpolator(around, np.append(np.tile(absolute[:-1], 3), absolute[0]))
        return lambda angle: curve(degrees[0] + np.mod(np.degrees(angle) - degrees[0], span)) - self.ambient

    def pressure(self, angle: np.ndarray) -> np.ndarray:
        """Return the pressure above ambient [Pa] at crank angles [rad]."""
        return self.over_angle()(angle)
