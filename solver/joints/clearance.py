"""A worn revolute joint: a journal that moves in its bearing by their clearance and is pressed where it touches.

The journal is on `body`, the bearing on the other one. Indentation δ = e − c, with e the distance of both axes at right
angles to the bearing's and c the radial clearance (P. Flores, J. Ambrósio, J. C. P. Claro, H. M. Lankarani, Kinematics
and Dynamics of Multibody Systems with Imperfect Joints, Springer 2008, chapter 3; for tilted journals chapter 5).
"""

from typing import ClassVar, Literal

from pydantic import Field, model_validator

from gudgeon.solver.joints.markers import Axial, Square
from gudgeon.solver.laws import Law
from gudgeon.solver.numbers import Length, PositiveSpeed, RatioFromZero, Strict


class JournalFriction(Strict):
    """Friction of which the force rises with the sliding speed: F μ v/√(v² + v₀²)."""

    coefficient: RatioFromZero = Field(description="μ, of kinetic friction [1]")
    speed: PositiveSpeed = Field(
        description="v₀: at this sliding speed friction is 71 % of μ F, and a joint that should stick creeps, slower"
        " than this [m/s]"
    )


class Clearance(Axial):
    """Holds a journal within its bearing, with a contact law; leaves all else, along the axis too."""

    along: ClassVar[tuple[int, ...]] = ()
    squares: ClassVar[tuple[Square, ...]] = ()
    kind: Literal["clearance"]
    clearance: Length = Field(description="Radius of the bearing less that of the journal [m]")
    radius: Length = Field(description="Radius of the journal [m]")
    law: Law = Field(description="Force of a touching section as a function of indentation")
    length: Length | None = Field(
        default=None,
        description="Of the journal, whose two end sections touch by half the law's force each, so that it holds a"
        " tilted journal; default: its middle section touches alone, and it may tilt",
    )
    friction: JournalFriction | None = Field(default=None, description="Friction of the journal; default: none")

    @property
    def sections(self) -> tuple[float, ...]:
        """Places of the touching sections along the journal's axis, from its point [m]."""
        return (0.0,) if self.length is None else (-0.5 * self.length, 0.5 * self.length)

    @model_validator(mode="after")
    def _fits(self) -> "Clearance":
        if self.clearance >= self.radius:
            raise ValueError(f"clearance {self.clearance} is not below the radius {self.radius} of the journal")
        return self
