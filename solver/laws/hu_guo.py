"""Hu and Guo's law: the right slope at restitution 1, the right order at 0."""

from typing import Literal

from gudgeon.solver.laws.base import Coefficients, HertzContact, RestitutionAboveZero
from gudgeon.solver.laws.restitution import departure


class HuGuo(HertzContact):
    """F = K dⁿ (1 + χ ḋ/v⁻) with χ = 3 (1 − e)/(2 e).

    S. Hu, X. Guo, A dissipative contact force model for impact analysis in multibody dynamics, Multibody System
    Dynamics 35 (2015) 131-151.
    """

    kind: Literal["hu-guo"]
    restitution: RestitutionAboveZero

    def coefficients(self) -> Coefficients:
        """Return K, n and χ."""
        return super().coefficients()._replace(loss=loss(self.restitution))

    def warning(self) -> str | None:
        """Return what is delivered where it is not what was asked."""
        return departure(self.kind, self.restitution, loss)


def loss(restitution: float) -> float:
    """Return χ [1] of the restitution [1]."""
    return 3 * (1 - restitution) / (2 * restitution)
