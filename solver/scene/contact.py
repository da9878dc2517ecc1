"""Contacts of a scene."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field, field_validator, model_validator

from gudgeon.solver.laws import Law
from gudgeon.solver.methods import METHODS
from gudgeon.solver.numbers import STRICT, Positive
from gudgeon.solver.obstacles import Bore, Plane
from gudgeon.solver.vectors import Direction


class MasterSurface(BaseModel):
    """The traction space of another body, over which the points slide."""

    model_config = STRICT
    shape: Literal["surface"]
    body: str
    interface: str = Field(description="Interface of kind 'traction'")


class OtherBody(BaseModel):
    """An interface of another body, point against point."""

    model_config = STRICT
    shape: Literal["body"]
    body: str
    interface: str = Field(description="Interface of kind 'points' or 'patch' with as many points")


class Friction(BaseModel):
    """Coulomb friction along one line."""

    model_config = STRICT
    static: Annotated[
        float, Field(ge=0, allow_inf_nan=False, description="Coefficient that holds", json_schema_extra={"unit": "1"})
    ]
    kinetic: Annotated[float, Field(ge=0, allow_inf_nan=False)] | None = Field(
        default=None,
        description="Coefficient while sliding; the static one by default",
        json_schema_extra={"unit": "1"},
    )
    direction: Direction = Field(description="Line along which the point slides, any length")

    @property
    def sliding(self) -> float:
        """Kinetic coefficient."""
        return self.static if self.kinetic is None else self.kinetic

    @model_validator(mode="after")
    def _ordered(self) -> "Friction":
        if self.sliding > self.static:
            raise ValueError(f"kinetic {self.sliding} is above static {self.static}; it must not be")
        return self


class Contact(BaseModel):
    """An interface of a body against a rigid obstacle or against another body."""

    model_config = STRICT
    body: str
    interface: str
    against: Annotated[Bore | Plane | MasterSurface | OtherBody, Field(discriminator="shape")]
    method: Literal["residual", "penalty", "constraint", "impact"] = Field(
        default="residual",
        description="residual: gap = g₀ + BΦq + Rλ, no stiffness to tune; penalty: a spring or a law at each point;"
        " constraint: the gap is held at zero from touch until its force would pull (addition-deletion);"
        " impact: Newton's restitution at each impact",
    )
    surface_stiffness: Positive | None = Field(
        default=None,
        description="Stiffness of a surface layer per area [N/m^3]: asperities, or the penalty's springs",
        json_schema_extra={"unit": "N/m^3"},
    )
    law: Law | None = Field(default=None, description="Force of one point over indentation, instead of a layer")
    restitution: Annotated[float, Field(ge=0, le=1)] | None = Field(
        default=None,
        description="Separation speed over approach speed, for method 'impact'; 0 sticks until pulled",
        json_schema_extra={"unit": "1"},
    )
    friction: Friction | None = Field(default=None, description="For rigid contact of rigid bodies; static = 0 is none")
    dashpot: Literal["none", "wave-guide"] = Field(
        default="none",
        description="wave-guide: impedance of the truncated modes beside R; for single-point contacts on bars only",
    )

    @field_validator("friction")
    @classmethod
    def _holds(cls, value: Friction | None) -> Friction | None:
        return value if value is not None and value.static > 0 else None

    @model_validator(mode="after")
    def _consistent(self) -> "Contact":
        if (wrong := METHODS[self.method].refuses(self)) is not None:
            raise ValueError(wrong)
        return self

    @property
    def smooth_law(self) -> bool:
        """Whether its force is a nonlinear function of indentation."""
        return self.law is not None and self.law.kind != "linear"
