"""What the laws share: their coefficients, and the elastic part of those after Hertz."""

from math import sqrt
from typing import Annotated, NamedTuple

from pydantic import AfterValidator, BaseModel, Field, model_validator

from gudgeon.solver.laws.restitution import SMALLEST
from gudgeon.solver.numbers import STRICT, Length, Positive


def _above_zero(restitution: float) -> float:
    if restitution < SMALLEST:
        raise ValueError(
            f'restitution is {restitution:g}, this law needs more than 0: use method "impact" for restitution 0'
        )
    return restitution


Restitution = Annotated[
    float,
    Field(
        ge=0,
        le=1,
        allow_inf_nan=False,
        description="Speed of leaving by speed of approach [1]",
        json_schema_extra={"unit": "1"},
    ),
]
"""Coefficient of restitution [1]."""

RestitutionAboveZero = Annotated[Restitution, AfterValidator(_above_zero)]
"""The same where the loss grows without bound towards 0."""


class Coefficients(NamedTuple):
    """Of F = max(0, K dⁿ (1 + χ ḋ/v⁻) + c ḋ)."""

    stiffness: float
    """K [N/mⁿ]."""
    exponent: float
    """n [1]."""
    loss: float
    """χ [1]."""
    damping: float
    """c [N s/m]."""

    def energy(self, indentation: float) -> float:
        """Return what the elastic part stores [J] at an indentation [m], K dⁿ⁺¹/(n+1); none out of contact."""
        depth = max(indentation, 0.0)
        return self.stiffness * depth ** (self.exponent + 1) / (self.exponent + 1)


class HertzContact(BaseModel):
    """K and n of two smooth surfaces in contact: given, or K = 4/3 E* √R of two spheres.

    H. Hertz, J. Reine Angew. Math. 92 (1882) 156-171; K. L. Johnson, Contact Mechanics (1985), chapter 4.
    """

    model_config = STRICT
    stiffness: Positive | None = Field(
        default=None, description="K [N/m^n]; or give radius and modulus", json_schema_extra={"unit": "N/m^exponent"}
    )
    radius: Length | None = Field(default=None, description="Of both surfaces, 1/R = 1/R1 + 1/R2 [m]")
    modulus: Positive | None = Field(
        default=None,
        description="Of both materials, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2 [Pa]",
        json_schema_extra={"unit": "Pa"},
    )
    exponent: Positive = Field(default=1.5, description="n [1]", json_schema_extra={"unit": "1"})

    @model_validator(mode="after")
    def _one_stiffness(self) -> "HertzContact":
        given = (self.stiffness is not None, self.radius is not None, self.modulus is not None)
        if given not in ((True, False, False), (False, True, True)):
            raise ValueError("give either stiffness, or radius and modulus")
        if self.stiffness is None and self.exponent != 1.5:
            raise ValueError(f"exponent is {self.exponent:g}, it must be 1.5 where radius and modulus are given")
        return self

    def coefficients(self) -> Coefficients:
        """Return K and n, without any loss."""
        if self.radius is not None and self.modulus is not None:
            return Coefficients(4 / 3 * self.modulus * sqrt(self.radius), self.exponent, 0.0, 0.0)
        assert self.stiffness is not None
        return Coefficients(self.stiffness, self.exponent, 0.0, 0.0)

    def energy(self, indentation: float) -> float:
        """Return what the elastic part stores [J] at an indentation [m]."""
        return self.coefficients().energy(indentation)

    def warning(self) -> str | None:
        """Return one line where the law is used outside its validity."""
        return None
