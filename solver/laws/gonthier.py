"""Gonthier's law in its explicit form."""

from typing import Literal

from gudgeon.solver.laws.base import Coefficients, HertzContact, RestitutionAboveZero
from gudgeon.solver.laws.restitution import departure


class Gonthier(HertzContact):
    """F = K dⁿ (1 + χ ḋ/v⁻) with χ = (1 − e²)/e.

    Y. Gonthier, J. McPhee, C. Lange, J.-C. Piedbœuf, A regularized contact model with asymmetric damping and
    dwell-time dependent friction, Multibody System Dynamics 11 (2004) 209-233; Y. Zhang, I. Sharf, J. Appl. Mech. 76
    (2009) 051002. An approximation of their implicit factor, which is the law 'exact' here: right towards e = 0,
    a third too much loss towards e = 1.
    """

    kind: Literal["gonthier"]
    restitution: RestitutionAboveZero

    def coefficients(self) -> Coefficients:
        """Return K, n and χ."""
        return super().coefficients()._replace(loss=loss(self.restitution))

    def warning(self) -> str | None:
        """Return what is delivered where it is not what was asked."""
        return departure(self.kind, self.restitution, loss)


def loss(restitution: float) -> float:
    """Return χ [1] of the restitution [1]."""
    return (1 - restitution) * (1 + restitution) / restitution
