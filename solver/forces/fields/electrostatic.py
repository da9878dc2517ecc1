"""Forces from an energy over the pose of a body: of charged conductors, of parallel plates, of adhesion."""

from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from gudgeon.solver.forces.ends import TwoEnds
from gudgeon.solver.numbers import (
    AbsolutePermittivity,
    Angle,
    Area,
    Charge,
    Coordinate,
    Length,
    Name,
    Potential,
    RotationAngle,
    Strict,
    SurfaceEnergy,
)
from gudgeon.solver.vectors import Direction, Place, rotation_of

VACUUM = 8.8541878128e-12
"""Permittivity of vacuum [F/m]."""


TOUCHING = 1e-3
"""Default gap at which plates touch, over that at the start."""


class FieldForce(TwoEnds):
    """A force and torque that are the gradient of a co-energy over the pose of a body.

    The pose is the motion of a point of the body since the start, and the rotation vector, both seen from the other
    end, along axes that turn with that.
    """

    def axes(self) -> np.ndarray:
        """Return the field's axes as columns, along those of the scene, (3, 3)."""
        return np.eye(3)


class Electrostatic(FieldForce):
    """Attraction and torque of charged conductors, by the capacitances of a scene of conductors on a grid of poses."""

    kind: Literal["electrostatic"]
    field: str | None = Field(
        default=None,
        description="Scene file of conductors with a table [poses]: its moved conductors are the body, its others the"
        " other end, and its pivot is at `at` as the run starts; computed first where the database has it not",
    )
    record: str | None = Field(
        default=None, description="Key of a grid of poses in the database, instead of a scene file of conductors"
    )
    potentials: dict[Name, Potential] = Field(
        default={},
        description="Potentials of conductors that replace those of the scene of conductors [V]; a floating conductor"
        " named here is held",
        json_schema_extra={"unit": "V"},
    )
    start: tuple[Coordinate, Coordinate, Coordinate] = Field(
        default=(0.0, 0.0, 0.0),
        description="Translation of the moved conductors from their position in the scene of conductors, as the run"
        " starts, along the field's axes [m]",
    )
    turn: tuple[Angle, Angle, Angle] = Field(
        default=(0.0, 0.0, 0.0),
        description="Rotation vector from the axes of this scene to those of the field [deg]; default: the same axes",
    )
    off_axis_length: Length | None = Field(
        default=None,
        description="Motion along a translation that the grid has not, up to which C is taken as constant [m]; default:"
        " a thousandth of the grid's smallest extent",
    )
    off_axis_angle: RotationAngle = Field(
        default=1e-3,
        description="Rotation about an axis that the grid has not, up to which C is taken as constant [rad]",
    )

    def axes(self) -> np.ndarray:
        """See `FieldForce`."""
        return rotation_of(np.radians(np.array(self.turn, float)))

    @model_validator(mode="after")
    def _one_field(self) -> "Electrostatic":
        if self.field is None and self.record is None:
            raise ValueError("give field, the scene file of conductors, or record, the key of a grid of poses")
        return self


class Adhesion(FieldForce):
    """Adhesion of a sphere to a plane by Derjaguin, Muller and Toporov: 2 π w R where they touch, less beyond.

    The force is 2 π w R/(1 + gap/range)² at a gap, and constant where there is none; with a contact of
    Hertz's law in addition it is their theory. The work to pull it off is 2 π w R · range.
    """

    kind: Literal["adhesion"]
    work: SurfaceEnergy = Field(description="Work of adhesion w [J/m^2]")
    radius: Length = Field(description="Of the sphere R, whose centre is at `at` or `interface` [m]")
    range: Length = Field(description="Gap at which a quarter of the force is left [m]; atoms have about 3e-10")
    point: Place = Field(description="A point of the plane, as the run starts [m]")
    normal: Direction = Field(description="Of the plane, towards the sphere, of any length")


class ElectrostaticPressure(Strict):
    """Attraction of the surface of a body by a plane electrode: the pressure ½ ε V²/g² at each contact point's gap."""

    kind: Literal["electrostatic-pressure"]
    body: str = Field(description="Name of a body of the scene")
    interface: str = Field(description="Interface of kind 'points', which faces the plane")
    point: Place = Field(description="A point of the plane [m]")
    normal: Direction = Field(description="Of the plane, towards the body, of any length")
    potential: Potential = Field(description="Voltage between surface and plane [V]")
    permittivity: AbsolutePermittivity = Field(
        default=VACUUM, description="Of what is between them [F/m]; default: vacuum"
    )
    least_gap: Length | None = Field(
        default=None,
        description="Gap at which a point touches, and the run ends unless a contact stops it before [m]; default: a"
        " thousandth of the largest gap as the run starts",
    )


class ParallelPlates(FieldForce):
    """Attraction of two parallel plates, ½ ε A V²/g², without the field beyond their edges."""

    kind: Literal["parallel-plates"]
    area: Area = Field(description="Of the overlap of the plates, which stays [m^2]")
    gap: Length = Field(description="Between them, as the run starts [m]")
    least_gap: Length | None = Field(
        default=None,
        description="Gap at which the plates touch, and the run ends unless a contact stops the body before [m];"
        " default: a thousandth of `gap`",
    )
    direction: Direction = Field(
        default=(0.0, 0.0, 1.0),
        description="Normal of any length, from the plate of the other end to that of the body: motion of the body"
        " along it opens the gap",
    )
    potential: Potential | None = Field(default=None, description="Voltage between the plates [V]")
    charge: Charge | None = Field(default=None, description="Charge of a plate instead of the voltage [C]")
    permittivity: AbsolutePermittivity = Field(
        default=VACUUM, description="Of what is between the plates [F/m]; default: vacuum"
    )

    @model_validator(mode="after")
    def _one_condition(self) -> "ParallelPlates":
        if (self.potential is None) == (self.charge is None):
            count = "both" if self.charge is not None else "neither"
            raise ValueError(f"{count} of potential [V] and charge [C] given; one of them is needed")
        if self.touching >= self.gap:
            raise ValueError(f"least_gap: {self.least_gap:g} m given; allowed: below gap, {self.gap:g} m")
        return self

    @property
    def touching(self) -> float:
        """Gap at which the plates touch [m]."""
        return TOUCHING * self.gap if self.least_gap is None else self.least_gap
