"""What a scene says about its reference and its sweep."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

STRICT = ConfigDict(extra="forbid", frozen=True)


class Nodal(BaseModel):
    """The nodal synthesis as reference."""

    model_config = STRICT
    steps: tuple[float, ...] = Field(default=(2e-6, 1e-6, 5e-7, 2.5e-7), min_length=2, description="Coarse to fine [s]")


class Pulse(BaseModel):
    """An exact force history: constant from the first touch on."""

    model_config = STRICT
    height: str = Field(description="Name under `expected` in the reference [N]")
    duration: str = Field(description="Name under `expected` in the reference [s]")


class Report(BaseModel):
    """Reference values and the models to compare."""

    model_config = STRICT
    reference: str | None = Field(default=None, description="JSON file with reference values, beside the scene")
    quantities: dict[str, str] = Field(
        default={}, description="Quantity of the run → name under `expected` in the reference"
    )
    pulse: Pulse | None = Field(default=None, description="Compare the force with an exact rectangular pulse")
    window: float = Field(
        default=40e-6, ge=0, description="Full width of the Hann window on forces, both sides [s]; 0: none"
    )
    until: float | None = Field(
        default=None, gt=0, description="Compare up to this time [s]; chatter may make later motion irreproducible"
    )
    nodal: Nodal | None = Field(default=None, description="Compare with the nodal synthesis on the same mesh")
    models: dict[str, dict[str, Any]] = Field(default={}, description="Name → changes of the scene, as nested tables")
    changes: dict[str, dict[str, Any]] = Field(
        default={}, description="Name → a design change, as nested tables; reuse is compared with recompute"
    )


class Plot(BaseModel):
    """What the pictures show beside the run itself."""

    model_config = STRICT
    label: str = Field(default="this run", description="Name of the run itself among the compared ones")
    compare: dict[str, dict[str, Any]] = Field(
        default={}, description="Name → changes of the scene, as nested tables; their curves stand in cycle.png"
    )
