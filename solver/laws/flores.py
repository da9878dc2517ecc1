"""Flores' law: for soft materials, all restitutions."""

from typing import Literal

from gudgeon.solver.laws.base import Coefficients, HertzContact, RestitutionAboveZero
from gudgeon.solver.laws.restitution import departure


class Flores(HertzContact):
    """F = K dⁿ (1 + χ ḋ/v⁻) with χ = 8 (1 − e)/(5 e).

    P. Flores, M. Machado, M. T. Silva, J. M. Martins, On the continuous contact force models for soft materials in
    multibody dynamics, Multibody System Dynamics 25 (2011) 357-375.
    """

    kind: Literal["flores"]
    restitution: RestitutionAboveZero

    def coefficients(self) -> Coefficients:
        """Return K, n and χ."""
        return super().coefficients()._replace(loss=loss(self.restitution))

    def warning(self) -> str | None:
        """Return what is delivered where it is not what was asked."""
        return departure(self.kind, self.restitution, loss)


def loss(restitution: float) -> float:
    """Return χ [1] of the restitution [1]."""
    return 8 * (1 - restitution) / (5 * restitution)
