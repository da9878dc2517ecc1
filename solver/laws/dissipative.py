"""Hertzian laws with hysteresis damping: one model, and a table of their loss χ over the restitution e."""

from collections.abc import Callable
from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from gudgeon.solver.laws.base import Coefficients, HertzContact
from gudgeon.solver.laws.restitution import SMALLEST, departure, loss_of_restitution
from gudgeon.solver.numbers import Share

Kind = Literal["hunt-crossley", "lankarani-nikravesh", "flores", "hu-guo", "gonthier", "exact"]

LOSSES: dict[Kind, Callable[[float], float]] = {
    # K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42
    # (1975) 440-445. First order in 1 − e; delivers 0.49 at e = 0.
    "hunt-crossley": lambda e: 3 * (1 - e) / 2,
    # H. M. Lankarani, P. E. Nikravesh, A contact force model with hysteresis damping for impact analysis of multibody
    # systems, J. Mech. Des. 112 (1990) 369-376. Equates the work of the damping, taken along the elastic path, with the
    # energy lost; delivers 0.725 at e = 0.5.
    "lankarani-nikravesh": lambda e: 3 * (1 - e) * (1 + e) / 4,
    # P. Flores, M. Machado, M. T. Silva, J. M. Martins, On the continuous contact force models for soft materials in
    # multibody dynamics, Multibody System Dynamics 25 (2011) 357-375.
    "flores": lambda e: 8 * (1 - e) / (5 * e),
    # S. Hu, X. Guo, A dissipative contact force model for impact analysis in multibody dynamics, Multibody System
    # Dynamics 35 (2015) 131-151. The right slope at e = 1, the right order at 0.
    "hu-guo": lambda e: 3 * (1 - e) / (2 * e),
    # Y. Gonthier, J. McPhee, C. Lange, J.-C. Piedbœuf, A regularized contact model with asymmetric damping and
    # dwell-time dependent friction, Multibody System Dynamics 11 (2004) 209-233; Y. Zhang, I. Sharf, J. Appl. Mech. 76
    # (2009) 051002. Approximates the implicit factor of the former, which is 'exact': right towards e = 0, a third too
    # much loss towards e = 1.
    "gonthier": lambda e: (1 - e) * (1 + e) / e,
    # Root of χ (1 + e) = ln[(1 + χ)/(1 − χ e)], which the former paper leaves implicit: delivers e.
    "exact": loss_of_restitution,
}
"""χ [1] of F = K dⁿ (1 + χ ḋ/v⁻) over the restitution e [1]."""

FINITE_AT_ZERO = ("hunt-crossley", "lankarani-nikravesh")
"""Laws with a finite loss at restitution 0."""


class Dissipative(HertzContact):
    """F = K dⁿ (1 + χ ḋ/v⁻) with the loss χ that the kind derives from the restitution."""

    kind: Kind = Field(
        description="Paper by which the loss follows from the restitution; exact: solved so that the law gives it back"
    )
    restitution: Share = Field(description="Separation speed over approach speed [1]")

    @field_validator("restitution")
    @classmethod
    def _finite_loss(cls, restitution: float, info: ValidationInfo) -> float:
        if restitution < SMALLEST and info.data.get("kind") not in FINITE_AT_ZERO:
            raise ValueError(
                f'restitution is {restitution:g}, this law needs more than 0; use method "impact" for restitution 0'
            )
        return restitution

    def coefficients(self) -> Coefficients:
        """Return K, n and χ."""
        return super().coefficients()._replace(loss=LOSSES[self.kind](self.restitution))

    def warning(self) -> str | None:
        """Return the restitution that is delivered where it is not the one given."""
        return departure(self.kind, self.restitution, LOSSES[self.kind])
