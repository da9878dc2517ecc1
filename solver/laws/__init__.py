"""Laws of a compliant contact: force over indentation and its rate. A new one is a file and a line or two here.

Every law comes down to four coefficients of one formula; one compiled function (`solver.laws.force`) serves all:

    F = max(0, K dⁿ (1 + χ ḋ/v⁻) + c ḋ)   for d > 0,   0 otherwise

with the indentation d [m], its rate ḋ [m/s], and the approach speed v⁻ [m/s] at which this contact began. A law has

    coefficients() -> Coefficients     stiffness K, exponent n, loss χ, damping c
    energy(indentation) -> float       what the elastic part stores, K dⁿ⁺¹/(n+1) [J]
    warning() -> str | None            one line where it is used outside its validity; the caller names the key

It never pulls, and over any closed path of d it dissipates or keeps energy.
"""

from typing import Annotated

from pydantic import Field

from gudgeon.solver.laws.base import Coefficients
from gudgeon.solver.laws.exact import Exact
from gudgeon.solver.laws.flores import Flores
from gudgeon.solver.laws.gonthier import Gonthier
from gudgeon.solver.laws.hertz import Hertz
from gudgeon.solver.laws.hu_guo import HuGuo
from gudgeon.solver.laws.hunt_crossley import HuntCrossley
from gudgeon.solver.laws.lankarani_nikravesh import LankaraniNikravesh
from gudgeon.solver.laws.linear import Linear

__all__ = ["LAWS", "Coefficients", "Law"]

LAWS = {
    "linear": Linear,
    "hertz": Hertz,
    "hunt-crossley": HuntCrossley,
    "lankarani-nikravesh": LankaraniNikravesh,
    "flores": Flores,
    "hu-guo": HuGuo,
    "gonthier": Gonthier,
    "exact": Exact,
}

Law = Annotated[
    Linear | Hertz | HuntCrossley | LankaraniNikravesh | Flores | HuGuo | Gonthier | Exact,
    Field(discriminator="kind"),
]
