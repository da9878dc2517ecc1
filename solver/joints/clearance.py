"""A worn revolute joint: a journal that moves in its bearing by their clearance and is pressed where it touches.

The journal is on `body`, the bearing on the other one. Indentation δ = e − c, with e the distance of both axes at right
angles to the bearing's and c the radial clearance (P. Flores, J. Ambrósio, J. C. P. Claro, H. M. Lankarani, Kinematics
and Dynamics of Multibody Systems with Imperfect Joints, Springer 2008, chapter 3; for tilted journals chapter 5).
"""

from typing import ClassVar, Literal

from pydantic import Field, model_validator

from gudgeon.solver.joints.bearing import JournalBearing
from gudgeon.solver.joints.markers import Axial, Square
from gudgeon.solver.joints.wear import PRESSED, JournalWear
from gudgeon.solver.laws import Law
from gudgeon.solver.laws.archard import DEEPEST
from gudgeon.solver.laws.base import Coefficients
from gudgeon.solver.numbers import Length, PositiveSpeed, RatioFromZero, Stiffness, Strict

STICKING = 0.8235294117647058
"""2 (1 − ν)/(2 − ν) for ν = 0.3: tangential over normal stiffness of round contacts that stick, of bodies of one
material (R. D. Mindlin, Compliance of elastic bodies in contact, J. Appl. Mech. 16 (1949) 259-268)."""


class JournalFriction(Strict):
    """Coulomb's friction with sticking by a tangential spring; or friction that rises with the sliding speed."""

    coefficient: RatioFromZero = Field(description="μ of friction [1]")
    speed: PositiveSpeed | None = Field(
        default=None,
        description="v₀ of friction F μ v/√(v² + v₀²): at this sliding speed it is 71 % of μ F, and a joint that should"
        " stick creeps, slower than this; default: it sticks by a spring, and slips where its force reaches μ F [m/s]",
    )
    stiffness: Stiffness | None = Field(
        default=None,
        description="Of the tangential spring by which the journal sticks; default: by Mindlin 0.82 times that of the"
        " law at an indentation of 2 % of the clearance [N/m]",
    )

    @model_validator(mode="after")
    def _one(self) -> "JournalFriction":
        if self.speed is not None and self.stiffness is not None:
            raise ValueError("stiffness: friction with a `speed` does not stick; give one of both")
        return self


class Clearance(Axial):
    """Holds a journal within its bearing, with a contact law; leaves all else, along the axis too."""

    along: ClassVar[tuple[int, ...]] = ()
    squares: ClassVar[tuple[Square, ...]] = ()
    kind: Literal["clearance"]
    clearance: Length = Field(description="Radius of the bearing less that of the journal [m]")
    radius: Length = Field(description="Radius of the journal [m]")
    law: Law | None = Field(
        default=None, description="Force of a touching section as a function of indentation; or give `bearing`"
    )
    bearing: JournalBearing | None = Field(
        default=None, description="Elastic bearing, whose pressure over its bore presses the journal instead of a law"
    )
    length: Length | None = Field(
        default=None,
        description="Of the journal, whose two end sections touch by half the law's force each, so that it holds a"
        " tilted journal; default: its middle section touches alone, and it may tilt",
    )
    friction: JournalFriction | None = Field(default=None, description="Friction of the journal; default: none")
    wear: JournalWear | None = Field(default=None, description="Wear of bearing and journal; default: none")

    @property
    def sections(self) -> tuple[float, ...]:
        """Places of the touching sections along the journal's axis, from its point [m]."""
        return (0.0,) if self.length is None else (-0.5 * self.length, 0.5 * self.length)

    def rubbing(self, law: Coefficients) -> tuple[float, float, float, float]:
        """Return coefficient [1], speed [m/s], stiffness [N/m], 0 without sticking, and way over which it turns [m].

        Args:
            law: Of the joint, or of its bearing.
        """
        if self.friction is None:
            return 0.0, 1.0, 0.0, 0.0
        mu, usual = self.friction.coefficient, PRESSED * self.clearance
        if self.friction.speed is not None or mu == 0:
            return mu, self.friction.speed or 1.0, 0.0, 0.0
        stiffness = self.friction.stiffness or STICKING * law.exponent * law.stiffness * usual ** (law.exponent - 1)
        return mu, 1.0, stiffness, usual

    @model_validator(mode="after")
    def _fits(self) -> "Clearance":
        if self.clearance >= self.radius:
            raise ValueError(f"clearance {self.clearance} is not below the radius {self.radius} of the journal")
        if (self.law is None) == (self.bearing is None):
            raise ValueError("law: give either a law, or an elastic bearing")
        if self.bearing is not None:
            self._check_bearing()
        if self.wear is not None:
            self._check_wear(self.wear)
        return self

    def _check_bearing(self) -> None:
        """Raise a ValueError where an elastic bearing does not carry what the joint asks for."""
        if self.length is not None:
            raise ValueError("length: given, but an elastic bearing presses along its whole width; leave it out")
        for key in ("journal_coefficient", "journal_depth", "indentation") if self.wear is not None else ():
            if getattr(self.wear, key):
                raise ValueError(
                    f"wear.{key}: given, but before an elastic bearing the journal stays round; leave it out"
                )

    def _check_wear(self, wear: JournalWear) -> None:
        """Raise a ValueError where wear does not fit the joint."""
        if wear.length is None and self.length is None and (self.bearing is None or self.bearing.length is None):
            raise ValueError("wear.length: is missing; the joint has no length, and depths are volumes per area")
        sections = len(self.sections)
        for key in ("bearing_depth", "journal_depth"):
            rows = getattr(wear, key)
            if rows and len(rows) != sections:
                raise ValueError(f"wear.{key}: {len(rows)} lists given; the joint has {sections} touching sections")
            for row in rows:
                if max(row) > DEEPEST * self.radius:
                    raise ValueError(
                        f"wear.{key}: {max(row):g} m given; allowed: up to {DEEPEST:g} of the radius,"
                        f" {DEEPEST * self.radius:g} m"
                    )

    def worn_areas(self) -> tuple[float, float]:
        """Return the area of a cell of a section's bearing and journal [m²]; there is wear."""
        assert self.wear is not None
        length = self.wear.length or self.length or (self.bearing and self.bearing.length)
        assert length is not None
        section_length = self.wear.step * length / len(self.sections)
        return (self.radius + self.clearance) * section_length, self.radius * section_length
