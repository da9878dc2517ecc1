"""The two ends of a spring or bushing: points of rigid bodies, interfaces of components, or the ground."""

from pydantic import Field, model_validator

from gudgeon.solver.numbers import Strict
from gudgeon.solver.vectors import Place


class TwoEnds(Strict):
    """An element between a body and the ground or another body."""

    body: str = Field(description="Name of a body of the scene")
    interface: str | None = Field(
        default=None,
        description="Interface of the body's component on which it acts, needed on elastic bodies: kind 'mean' or"
        " 'tie', or for a spring also one of a single contact point, which acts along its normal",
    )
    at: Place = Field(
        default=(0.0, 0.0, 0.0),
        description="Point of a rigid body relative to its component's origin [m]; not used with `interface`",
    )
    against: str | None = Field(default=None, description="Other body; default: the ground")
    against_interface: str | None = Field(
        default=None,
        description="Interface of the other body's component, needed where it is elastic; default: it acts on the point"
        " of the other body that is at the first end",
    )

    @model_validator(mode="after")
    def _two(self) -> "TwoEnds":
        if self.against == self.body:
            raise ValueError("it needs two bodies, or one and the ground")
        if self.against is None and self.against_interface is not None:
            raise ValueError("against_interface is given without against")
        return self

    @property
    def elastic(self) -> bool:
        """Whether it acts through an interface of a component."""
        return self.interface is not None or self.against_interface is not None
