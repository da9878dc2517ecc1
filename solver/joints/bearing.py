"""An elastic bearing of a joint with clearance: what presses the journal is a pressure over its bore.

Places at angles θ_i about the bore have gaps g_i = c + h_i − e·u_i to a round journal at the offset e, less what forces
λ ≥ 0 yield, g + R λ ≥ 0 ⊥ λ. R is the static compliance of a component of the scene that is held by its supports, of
modes and residual flexibility; or of a foundation, a bed of springs without coupling.
"""

from typing import Annotated

from pydantic import Field, model_validator

from gudgeon.solver.laws.restitution import SMALLEST
from gudgeon.solver.numbers import LayerStiffness, Length, Name, Share, Strict, above_zero, sizeable

PLACES = 360
"""Of a foundation, default."""
Load = Annotated[float, above_zero("N"), sizeable("N")]


class JournalBearing(Strict):
    """An elastic bearing instead of a law: a component of the scene, or a foundation."""

    component: Name | None = Field(
        default=None,
        description="Component whose bore is pressed, held by its supports on the body that has the bearing, its origin"
        " at the point of the joint, its axes those of the scene at the start; or give `foundation`",
    )
    interface: Name | None = Field(default=None, description="Its interface of kind `points` on the bore")
    foundation: LayerStiffness | None = Field(
        default=None, description="Pressure per indentation of a foundation of springs between rigid parts [N/m^3]"
    )
    length: Length | None = Field(default=None, description="Of the foundation along the axis [m]")
    places: int = Field(default=PLACES, ge=72, le=1440, description="Number of positions about the axis")
    load: Load = Field(
        description="Largest force that the bearing is tabulated for; a run that exceeds it ends [N]",
    )
    restitution: Share = Field(
        default=1.0,
        description="Separation speed over approach speed, by the loss of the law `exact`; 1: without loss [1]",
    )

    @model_validator(mode="after")
    def _one(self) -> "JournalBearing":
        if self.restitution < SMALLEST:
            raise ValueError(f"restitution: {self.restitution:g} given; it must be above 0")
        keys = [key for key in ("component", "foundation") if getattr(self, key) is not None]
        if len(keys) != 1:
            raise ValueError("give either component with interface, or foundation with length")
        partner = {"component": "interface", "foundation": "length"}
        for key, partner_key in partner.items():
            if (getattr(self, key) is None) != (getattr(self, partner_key) is None):
                missing = partner_key if getattr(self, key) is not None else key
                raise ValueError(
                    f"{missing}: is missing; give either component with interface, or foundation with length"
                )
        return self
