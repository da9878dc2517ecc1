"""Lankarani and Nikravesh's law: the loss of energy of a restitution near 1."""

from typing import Literal

from gudgeon.solver.laws.base import Coefficients, HertzContact, Restitution
from gudgeon.solver.laws.restitution import departure


class LankaraniNikravesh(HertzContact):
    """F = K dⁿ (1 + χ ḋ/v⁻) with χ = 3 (1 − e²)/4.

    H. M. Lankarani, P. E. Nikravesh, A contact force model with hysteresis damping for impact analysis of multibody
    systems, J. Mech. Des. 112 (1990) 369-376. Equates the work of the damping, taken along the elastic path, with the
    energy lost; far off for low restitution (0.5 delivers 0.725).
    """

    kind: Literal["lankarani-nikravesh"]
    restitution: Restitution

    def coefficients(self) -> Coefficients:
        """Return K, n and χ."""
        return super().coefficients()._replace(loss=loss(self.restitution))

    def warning(self) -> str | None:
        """Return what is delivered where it is not what was asked."""
        return departure(self.kind, self.restitution, loss)


def loss(restitution: float) -> float:
    """Return χ [1] of the restitution [1]."""
    return 3 * (1 - restitution) * (1 + restitution) / 4
