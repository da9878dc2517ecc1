"""Laws of a compliant contact: force over indentation and its rate.

Every law comes down to four coefficients of one formula; one function (`solver/core/laws/power.hpp`) serves all:

    F = max(0, K dⁿ (1 + χ ḋ/v⁻) + c ḋ)   for d > 0,   0 otherwise

with the indentation d [m], its rate ḋ [m/s], and the approach speed v⁻ [m/s] at which this contact began. A law has

    coefficients() -> Coefficients     stiffness K, exponent n, loss χ, damping c
    warning() -> str | None            one line where it is used outside its range of validity

It never pulls, and over any closed path of d it dissipates or keeps energy.
"""

from typing import Annotated

from pydantic import Field

from gudgeon.solver.laws.base import Coefficients, Hertz
from gudgeon.solver.laws.dissipative import LOSSES, Dissipative
from gudgeon.solver.laws.linear import Linear

__all__ = ["LAWS", "Coefficients", "Law"]

LAWS = {"linear": Linear, "hertz": Hertz} | dict.fromkeys(LOSSES, Dissipative)

Law = Annotated[Linear | Hertz | Dissipative, Field(discriminator="kind")]
