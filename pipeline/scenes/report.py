"""What a scene says about its reference and its sweep."""

import itertools
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, field_validator

STRICT = ConfigDict(extra="forbid", frozen=True)


class FullFE(BaseModel):
    """The full FE beside the models; its finest run is the reference where no file is."""

    model_config = STRICT
    steps: tuple[float, ...] = Field(default=(2e-6, 1e-6, 5e-7, 2.5e-7), min_length=2, description="Coarse to fine [s]")

    @field_validator("steps")
    @classmethod
    def _able(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if not all(0 < step < float("inf") for step in value) or len(set(value)) < len(value):
            raise ValueError(f"{list(value)} given, steps must be positive, finite and different from each other")
        return value


class Pulse(BaseModel):
    """An exact force history: constant from the first touch on."""

    model_config = STRICT
    height: str = Field(description="Name under `expected` in the reference [N]")
    duration: str = Field(description="Name under `expected` in the reference [s]")


class Vectors(BaseModel):
    """Error against the number of vectors under a force that moves, and the price of making them again."""

    model_config = STRICT
    force: str = Field(description="Name of the force, of kind 'moving'")
    counts: tuple[int, ...] = Field(
        default=(2, 4, 8, 16, 32), min_length=1, description="Numbers of vectors, ascending"
    )
    places: int = Field(default=16, ge=2, description="Equal parts of the way at which vectors are made again")
    steps: int = Field(default=1600, ge=100, description="Time steps of a run; rounded up to 20 a place")
    root: float = Field(gt=0, description="Stress is compared within this distance of the supports [m]")
    meshes: tuple[float, ...] = Field(default=(), description="Further edge lengths at which the price is measured [m]")

    @field_validator("counts")
    @classmethod
    def _ascending(cls, value: tuple[int, ...]) -> tuple[int, ...]:
        if value[0] < 1 or any(a >= b for a, b in itertools.pairwise(value)):
            raise ValueError(f"{list(value)} given, they must ascend from 1 or more")
        return value

    @field_validator("meshes")
    @classmethod
    def _sizes(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if any(not 0 < size < float("inf") for size in value):
            raise ValueError(f"{list(value)} given, edge lengths must be positive")
        return value


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
    full_fe: FullFE | None = Field(default=None, description="Compare with the full-FE run on the same mesh")
    vectors: Vectors | None = Field(
        default=None, description="Compare numbers and kinds of vectors under a moving force, instead of models"
    )
    models: dict[str, dict[str, Any]] = Field(default={}, description="Name → changes of the scene, as nested tables")
    sweep: dict[str, Annotated[list[Any], Field(min_length=1)]] = Field(
        default={},
        description="Path of a key → its values, coarse to fine; every model runs with every combination. A star stands"
        " for all names of a table: 'component.*.modes.normal_count'",
    )
    interest: tuple[str, ...] = Field(
        default=(),
        description="Quantities whose errors count for the front and for --tolerance: names of the run's quantities,"
        " or force, impulse, energy drift and those of a slap; all that have a reference by default",
    )
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
