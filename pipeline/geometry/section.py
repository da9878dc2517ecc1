"""Cross-sections of beams: area, second moment about the axis of bending, height, and shear coefficient.

The shear coefficient κ = I² / (A ∫ Q²/b dz) equates the strain energy of the parabolic shear stress Q V / (I b) with
that of the mean one, V² / (2 κ G A); Q is the first moment of the part beyond z, b the width there (Gere & Timoshenko,
Mechanics of Materials, form factor for shear): 5/6 for a rectangle, 9/10 for a circle.
"""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from gudgeon.solver.numbers import Area, Length, PositiveRatio, SecondMoment, Strict

Coefficient = Annotated[PositiveRatio, Field(le=1)]
SHEAR = Field(default=None, description="Shear coefficient κ; by the energy of the shear stress by default")


class Rectangle(Strict):
    """Solid rectangle."""

    shear_form: ClassVar[float] = 5 / 6
    """κ by the energy of the shear stress."""
    kind: Literal["rectangle"]
    width: Length = Field(description="Width across the plane of bending [m]")
    height: Length = Field(description="Height in the plane of bending [m]")
    shear_coefficient: Coefficient | None = SHEAR

    @property
    def area(self) -> float:
        """Area [m^2]."""
        return self.width * self.height

    @property
    def second_moment(self) -> float:
        """Second moment of area about the axis of bending [m^4]."""
        return self.width * self.height**3 / 12

    @property
    def lateral_moment(self) -> float:
        """Second moment of area about the axis in the plane of bending [m^4]."""
        return self.height * self.width**3 / 12

    @property
    def torsion_constant(self) -> float:
        """Torsional stiffness over G [m^4], by the series for a rectangle (Timoshenko & Goodier, art. 109)."""
        b, a = sorted((self.width, self.height))
        n = np.arange(1, 60, 2)
        return float(a * b**3 / 3 * (1 - 192 * b / (np.pi**5 * a) * (np.tanh(n * np.pi * a / (2 * b)) / n**5).sum()))


class Circle(Strict):
    """Solid circle."""

    shear_form: ClassVar[float] = 9 / 10
    """κ by the energy of the shear stress."""
    kind: Literal["circle"]
    radius: Length = Field(description="Radius")
    shear_coefficient: Coefficient | None = SHEAR

    @property
    def height(self) -> float:
        """Height in the plane of bending [m]."""
        return 2 * self.radius

    @property
    def area(self) -> float:
        """Area [m^2]."""
        return np.pi * self.radius**2

    @property
    def second_moment(self) -> float:
        """Second moment of area about the axis of bending [m^4]."""
        return np.pi * self.radius**4 / 4

    @property
    def lateral_moment(self) -> float:
        """Second moment of area about the axis in the plane of bending [m^4]."""
        return self.second_moment

    @property
    def torsion_constant(self) -> float:
        """Torsional stiffness over G [m^4]."""
        return 2 * self.second_moment


class IBeam(Strict):
    """Two equal flanges and a web between them, without fillets."""

    kind: Literal["i-beam"]
    height: Length = Field(description="Overall height [m]")
    width: Length = Field(description="Width of the flanges [m]")
    flange: Length = Field(description="Thickness of each flange [m]")
    web: Length = Field(description="Thickness of the web [m]")
    shear_coefficient: Coefficient | None = SHEAR

    @field_validator("flange")
    @classmethod
    def _leaves_a_web(cls, value: float, info: ValidationInfo) -> float:
        height = info.data.get("height")
        if height is not None and 2 * value >= height:
            raise ValueError(f"{value} given, two flanges must be lower than the height {height} m")
        return value

    @field_validator("web")
    @classmethod
    def _within_the_flanges(cls, value: float, info: ValidationInfo) -> float:
        width = info.data.get("width")
        if width is not None and value > width:
            raise ValueError(f"{value} given, the web is at most as thick as the flanges are wide, {width} m")
        return value

    @property
    def _clear(self) -> float:
        return self.height - 2 * self.flange

    @property
    def area(self) -> float:
        """Area [m^2]."""
        return 2 * self.width * self.flange + self.web * self._clear

    @property
    def second_moment(self) -> float:
        """Second moment of area about the axis of bending [m^4]."""
        return (self.width * self.height**3 - (self.width - self.web) * self._clear**3) / 12

    @property
    def shear_form(self) -> float:
        """κ by the energy of the shear stress."""
        x, w = np.polynomial.legendre.leggauss(3)
        half, clear = self.height / 2, self._clear / 2
        z = clear / 2 * (x + 1)
        Q = self.width * (half**2 - clear**2) / 2 + self.web * (clear**2 - z**2) / 2
        energy = clear / 2 * (w @ Q**2) / self.web
        z = clear + (half - clear) / 2 * (x + 1)
        energy += (half - clear) / 2 * (w @ (half**2 - z**2) ** 2) * self.width / 4
        return float(self.second_moment**2 / (self.area * 2 * energy))


class General(Strict):
    """Any section with given area and second moment, and its outer fibres at ± height / 2."""

    shear_form: ClassVar[None] = None
    kind: Literal["general"]
    area: Area = Field(description="Area")
    second_moment: SecondMoment = Field(description="About the axis of bending [m^4]")
    height: Length = Field(description="Distance of the two outer fibres")
    shear_coefficient: Coefficient | None = Field(
        default=None, description="Shear coefficient κ; theory 'timoshenko' needs it"
    )
    lateral_moment: SecondMoment | None = Field(
        default=None,
        exclude_if=lambda value: value is None,
        description="About the axis in the plane of bending [m^4]; motion 'space' needs it",
    )
    torsion_constant: SecondMoment | None = Field(
        default=None,
        exclude_if=lambda value: value is None,
        description="Torsional stiffness over G [m^4]; motion 'space' needs it",
    )


def shear_coefficient_of(section: "Rectangle | Circle | IBeam | General") -> float | None:
    """Return the shear coefficient κ of a section, as given or by its form; None of one that states none."""
    return section.shear_form if section.shear_coefficient is None else section.shear_coefficient


Section = Annotated[Rectangle | Circle | IBeam | General, Field(discriminator="kind")]
"""Any section, discriminated by its `kind`."""
