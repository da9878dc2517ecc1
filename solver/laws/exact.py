"""The law that delivers the restitution that was asked."""

from typing import Literal

from gudgeon.solver.laws.base import Coefficients, HertzContact, RestitutionAboveZero
from gudgeon.solver.laws.restitution import loss_of_restitution


class Exact(HertzContact):
    """F = K dⁿ (1 + χ ḋ/v⁻) with χ the root of χ (1 + e) = ln[(1 + χ)/(1 − χ e)].

    Y. Gonthier, J. McPhee, C. Lange, J.-C. Piedbœuf, A regularized contact model with asymmetric damping and
    dwell-time dependent friction, Multibody System Dynamics 11 (2004) 209-233, where the factor is left implicit.
    """

    kind: Literal["exact"]
    restitution: RestitutionAboveZero

    def coefficients(self) -> Coefficients:
        """Return K, n and χ."""
        return super().coefficients()._replace(loss=loss_of_restitution(self.restitution))
