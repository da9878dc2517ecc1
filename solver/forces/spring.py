"""A spring with a dashpot between a point of a body and the ground or another body, along one direction."""

from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from gudgeon.solver.forces.ends import TwoEnds
from gudgeon.solver.numbers import Coordinate, DampingConstant, ForceValue, Length, Stiffness
from gudgeon.solver.vectors import Direction, Place

Knots = tuple[tuple[Coordinate, ForceValue], ...]


class Spring(TwoEnds):
    """Spring along one direction, linear or by a table of its force over its elongation, with a parallel dashpot."""

    kind: Literal["spring"]
    direction: Direction | None = Field(
        default=None,
        description="Direction of any length, from the other end to this one: motion of the body along it elongates the"
        " spring. Default: the line from one interface to the other, or the normal of a single contact point",
    )
    stiffness: Stiffness | None = Field(
        default=None, description="Stiffness [N/m]; it may be left out where a table or a damping is given"
    )
    damping: DampingConstant = Field(default=0.0, description="Damping constant of the parallel dashpot")
    against_at: Place | None = Field(
        default=None,
        description="Point of the other body, as `at`, or point of the ground in the scene [m]: the spring acts along"
        " the line between both points, which turns with them, as it does in scenes of integrator turning between two"
        " interfaces without a `direction`",
    )
    length: Length | None = Field(
        default=None,
        description="Distance of the points without force [m], with `against_at`; default: that at the start less"
        " `stretch`",
    )
    stretch: Coordinate = Field(default=0.0, description="Elongation at the start [m]")
    preload: ForceValue = Field(
        default=0.0, description="Tension at zero elongation [N], added to that of stiffness or table"
    )
    table: str | None = Field(
        default=None,
        description="CSV: elongation [m], tension [N]; piecewise linear, continued beyond its ends with their slopes",
    )
    values: Knots = Field(
        default=(),
        description="The same as pairs; read from the table if one is given",
        json_schema_extra={"unit": ["m", "N"]},
    )

    @model_validator(mode="after")
    def _one_law(self) -> "Spring":
        tabled = self.table is not None or bool(self.values)
        if tabled and self.stiffness is not None:
            raise ValueError("stiffness and a table both give the force; give only one of them")
        if not tabled and self.stiffness is None and self.damping == 0:
            raise ValueError("give stiffness [N/m], a table or damping [N s/m]")
        if not tabled and self.stiffness is None and self.preload:
            raise ValueError("preload needs a stiffness or a table")
        if self.against_at is None and self.against_interface is None and self.length is not None:
            raise ValueError("length needs against_at or against_interface: it is the distance of two points")
        if self.against_at is not None:
            self._check_points()
        if self.values:
            check_knots("values", np.array(self.values), 1)
        return self

    def _check_points(self) -> None:
        options = {"against_interface": self.against_interface, "direction": self.direction}
        beside = [key for key, value in options.items() if value is not None]
        if beside or self.table is not None or self.values:
            raise ValueError(f"{(beside or ['a table'])[0]} and against_at are given; give only one of them")
        if self.length is not None and self.stretch:
            raise ValueError("length and stretch are given; give only one of them")

    @property
    def tabled(self) -> bool:
        """Whether its force is a table."""
        return self.table is not None or bool(self.values)

    @property
    def damped(self) -> bool:
        """Whether it has a dashpot."""
        return self.damping > 0

    @property
    def linear(self) -> bool:
        """Whether its force is a stiffness times its elongation."""
        return self.stiffness is not None


def check_knots(key: str, knots: np.ndarray, first_row: int) -> None:
    """Raise a ValueError unless elongations [m] of knots, (rows, 2), increase and tensions [N] do not decrease.

    Messages name the file or key `key`, and rows from `first_row` on.
    """
    if len(knots) < 2:
        raise ValueError(f"{key}: {len(knots)} rows given, a table of tension over elongation needs two or more")
    change = np.diff(knots, axis=0)
    for column, wrong, text in (
        (0, change[:, 0] <= 0, "the elongation {:g} m must be above that of the row before"),
        (1, change[:, 1] < 0, "the tension {:g} N is below that of the row before: it must not decrease"),
    ):
        if wrong.any():
            row = int(wrong.argmax()) + 1
            raise ValueError(f"{key}: row {row + first_row}: {text.format(knots[row, column])}")
