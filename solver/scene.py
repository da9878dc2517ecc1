"""The solver's part of a scene: bodies, contacts, and how long to run. SI units."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from solver.obstacles import Obstacle

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Vector = tuple[Finite, Finite, Finite]
STRICT = ConfigDict(extra="forbid", frozen=True)


class Body(BaseModel):
    """A component put into the scene."""

    model_config = STRICT
    component: str | None = Field(default=None, description="Name of its component; the body's own name by default")
    position: Vector = Field(
        default=(0.0, 0.0, 0.0), description="Where the component's origin stands at the start [m]"
    )
    velocity: Vector = Field(default=(0.0, 0.0, 0.0), description="Of the centre of mass at the start [m/s]")
    angular_velocity: Vector = Field(default=(0.0, 0.0, 0.0), description="At the start [rad/s]")


class Contact(BaseModel):
    """An interface of a body against a rigid obstacle."""

    model_config = STRICT
    body: str
    interface: str
    against: Obstacle
    method: Literal["residual", "penalty"] = Field(
        default="residual",
        description="residual: gap = g₀ + BΦq + Rλ, no stiffness to tune; penalty: a spring at each point",
    )
    surface_stiffness: Positive | None = Field(
        default=None, description="Stiffness of a surface layer per area [N/m^3]: asperities, or the penalty's springs"
    )
    dashpot: Literal["none", "wave-guide"] = Field(
        default="none",
        description="wave-guide: impedance of the truncated modes beside R; for single-point contacts on bars only",
    )

    @model_validator(mode="after")
    def _consistent(self) -> "Contact":
        if self.method == "penalty" and self.surface_stiffness is None:
            raise ValueError("method 'penalty' needs surface_stiffness [N/m^3]")
        if self.method == "penalty" and self.dashpot != "none":
            raise ValueError("dashpot 'wave-guide' stands beside R, so it needs method 'residual'")
        return self


class Run(BaseModel):
    """How long, and how fine."""

    model_config = STRICT
    duration: Positive = Field(description="[s]")
    step: Positive | None = Field(
        default=None, description="[s]; automatic (0.2/ω_c) if left out, and divided into substeps if larger than that"
    )
    samples: int = Field(default=4000, ge=10, le=1_000_000, description="Points of the force and energy histories")
    frames: int = Field(default=200, ge=2, le=10_000, description="Stored deformations")


class Scene(BaseModel):
    """Everything the solver needs to know beside the records."""

    model_config = STRICT
    body: dict[str, Body] = Field(min_length=1)
    contact: dict[str, Contact] = {}
    run: Run

    @model_validator(mode="after")
    def _names(self) -> "Scene":
        for name, contact in self.contact.items():
            if contact.body not in self.body:
                raise ValueError(f"contact.{name}.body: no body '{contact.body}', the scene has {', '.join(self.body)}")
        return self

    def component_of(self, body: str) -> str:
        """Return the component that a body is made of."""
        return self.body[body].component or body
