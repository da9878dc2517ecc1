"""What the laws share: their four coefficients, and stiffness and exponent of a Hertzian contact."""

from collections.abc import Sequence
from math import sqrt
from typing import Literal, NamedTuple

from pydantic import Field, model_validator

from gudgeon.solver.numbers import Exponent, HertzStiffness, Length, Modulus, Strict


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


class ContactLaw(Strict):
    """What every law has beside its own coefficients."""

    def coefficients(self) -> Coefficients:
        """Return the four coefficients of the whole contact."""
        raise NotImplementedError

    def of_points(self, areas: Sequence[float]) -> list[Coefficients]:
        """Return the coefficients of each point of a contact, which share K and c by their areas.

        Points that press alike give the force of the law together, on whatever mesh.

        Args:
            areas: Of the points [m^2], c of them; all zero where the points have none, which share alike.
        """
        whole, total = self.coefficients(), sum(areas)
        shares = [area / total if total > 0 else 1 / len(areas) for area in areas]
        return [whole._replace(stiffness=whole.stiffness * share, damping=whole.damping * share) for share in shares]

    def warning(self) -> str | None:
        """Return one line where the law is used outside its range of validity."""
        return None


class HertzContact(ContactLaw):
    """K and n of two smooth surfaces in contact: given, or K = 4/3 E* √R of two spheres.

    H. Hertz, J. Reine Angew. Math. 92 (1882) 156-171; K. L. Johnson, Contact Mechanics (1985), chapter 4.
    """

    stiffness: HertzStiffness | None = Field(default=None, description="K [N/m^n]; or give radius and modulus")
    radius: Length | None = Field(default=None, description="Of both surfaces, 1/R = 1/R1 + 1/R2 [m]")
    modulus: Modulus | None = Field(
        default=None,
        description="Of both materials, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2 [Pa]",
    )
    exponent: Exponent = Field(default=1.5, description="n [1]")

    @model_validator(mode="after")
    def _one_stiffness(self) -> "HertzContact":
        present = (self.stiffness is not None, self.radius is not None, self.modulus is not None)
        if present not in ((True, False, False), (False, True, True)):
            raise ValueError("give either stiffness, or radius and modulus")
        if self.stiffness is None and self.exponent != 1.5:
            raise ValueError(f"exponent is {self.exponent:g}, it must be 1.5 where radius and modulus are given")
        return self

    def coefficients(self) -> Coefficients:
        """Return K and n, without loss or damping."""
        if self.radius is not None and self.modulus is not None:
            return Coefficients(4 / 3 * self.modulus * sqrt(self.radius), self.exponent, 0.0, 0.0)
        assert self.stiffness is not None
        return Coefficients(self.stiffness, self.exponent, 0.0, 0.0)


class Hertz(HertzContact):
    """F = K dⁿ, elastic: without loss."""

    kind: Literal["hertz"]
