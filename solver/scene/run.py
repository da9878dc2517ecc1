"""How long and how finely a scene runs."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from gudgeon.solver.numbers import STRICT, Positive
from gudgeon.solver.vectors import Vector


class Run(BaseModel):
    """How long, and how fine."""

    model_config = STRICT
    duration: Positive = Field(description="[s]", json_schema_extra={"unit": "s"})
    step: Positive | None = Field(
        default=None,
        description="[s]; automatic if left out: 0.2/ω_c, or what the accuracy asks for; a larger one is divided into"
        " substeps, and one that does not divide the run is so much shorter; integrator 'event' has none",
        json_schema_extra={"unit": "s"},
    )
    accuracy: Annotated[float, Field(ge=1e-12, le=0.1)] | None = Field(
        default=None,
        description="Relative error that the step is chosen for: of the force where a law is integrated (1e-8 by"
        " default), of the energy balance elsewhere; event location needs none",
        json_schema_extra={"unit": "1"},
    )
    integrator: Literal["auto", "event", "collocation", "discrete-gradient", "explicit", "implicit"] = Field(
        default="auto",
        description="event: exact motion between located events, for linear and rigid contact of a few points;"
        " collocation: high order, for contact laws; discrete-gradient: energy to round-off at any step; explicit: explicit"
        " contact, step 0.2/ω_c; implicit: implicit contact, for damping, joints, loads and sliding pairs; auto takes"
        " what the scene's contacts ask for",
    )
    gravity: Vector = Field(default=(0.0, 0.0, 0.0), description="[m/s^2]", json_schema_extra={"unit": "m/s^2"})
    samples: int = Field(default=4000, ge=10, le=1_000_000, description="Points of the force and energy histories")
    frames: int = Field(default=200, ge=2, le=10_000, description="Stored deformations")
