"""The linear law: a spring, with an optional parallel dashpot."""

from typing import Literal

from pydantic import Field

from gudgeon.solver.laws.base import Coefficients, ContactLaw
from gudgeon.solver.numbers import DampingConstant, Stiffness


class Linear(ContactLaw):
    """F = K d + c ḋ: Kelvin-Voigt. With a dashpot the force jumps to c v⁻ as contact begins.

    Contact ends where the force vanishes, at d > 0. The restitution decreases with the damping ratio c/(2 √(K m)), so
    it depends on the mass.

    W. Goldsmith, Impact (1960); K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440-445 on its flaws.
    """

    kind: Literal["linear"]
    stiffness: Stiffness = Field(description="K [N/m]")
    damping: DampingConstant = Field(default=0.0, description="c [N s/m]")

    def coefficients(self) -> Coefficients:
        """Return K, n = 1 and c."""
        return Coefficients(self.stiffness, 1.0, 0.0, self.damping)
