"""Hunt and Crossley's law: damping by the depth, for restitution near 1."""

from typing import Literal

from gudgeon.solver.laws.base import Coefficients, HertzContact, Restitution
from gudgeon.solver.laws.restitution import departure


class HuntCrossley(HertzContact):
    """F = K dⁿ (1 + χ ḋ/v⁻) with χ = 3 (1 − e)/2.

    K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42
    (1975) 440-445. First order in 1 − e; at e = 0 it delivers 0.49.
    """

    kind: Literal["hunt-crossley"]
    restitution: Restitution

    def coefficients(self) -> Coefficients:
        """Return K, n and χ."""
        return super().coefficients()._replace(loss=loss(self.restitution))

    def warning(self) -> str | None:
        """Return what is delivered where it is not what was asked."""
        return departure(self.kind, self.restitution, loss)


def loss(restitution: float) -> float:
    """Return χ [1] of the restitution [1]."""
    return 3 * (1 - restitution) / 2
