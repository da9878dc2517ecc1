"""Tables `[report]` and `[plot]` of a scene: reference, sweep and compared curves."""

from typing import Annotated, Any

from pydantic import Field, field_validator, model_validator

from gudgeon.solver.numbers import Duration, Strict, TimeFromZero


class FullFE(Strict):
    """Full-FE runs; the finest one, or their extrapolation, is the reference if no file is given."""

    steps: tuple[Duration, ...] = Field(
        default=(2e-6, 1e-6, 5e-7, 2.5e-7), min_length=2, description="Time steps, coarse to fine [s]"
    )

    extrapolate: bool = Field(
        default=False,
        description="The reference is Richardson's extrapolation of the runs with the two finest steps, with the order"
        " observed over the three finest",
    )

    @field_validator("steps")
    @classmethod
    def _able(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if len(set(value)) < len(value):
            raise ValueError(f"{list(value)} given, steps must be different from each other")
        return value


class Pulse(Strict):
    """An exact force history: constant from first contact on."""

    height: str = Field(description="Name under `expected` in the reference [N]")
    duration: str = Field(description="Name under `expected` in the reference [s]")


class Report(Strict):
    """Reference values and compared models."""

    reference: str | None = Field(default=None, description="JSON file with reference values, relative to the scene")
    quantities: dict[str, str] = Field(
        default={}, description="Quantity of the run → name under `expected` in the reference"
    )
    pulse: Pulse | None = Field(default=None, description="Compare the force with an exact rectangular pulse")
    history: str | None = Field(
        default=None,
        description="Force of the contact in force.png: path under `histories` in the reference, '.' for itself, to `t`"
        " [s] and `F` [N]",
    )
    window: TimeFromZero = Field(
        default=40e-6, description="Full width of the Hann window on forces, both sides [s]; 0: none"
    )
    until: Duration | None = Field(
        default=None, description="Compare up to this time [s]; the impact that it cuts is not judged"
    )
    full_fe: FullFE | None = Field(default=None, description="Compare with full-FE runs on the same mesh")
    models: dict[str, dict[str, Any]] = Field(default={}, description="Name → changes of the scene, as nested tables")
    sweep: dict[str, Annotated[list[Any], Field(min_length=1)]] = Field(
        default={},
        description="Path of a key → its values, coarse to fine; every model runs with every combination. A star is any"
        " name of a table: 'component.*.modes.normal_count'",
    )
    rivals: tuple[str, ...] = Field(
        default=(),
        description="Names of models that are other methods: the table of costs compares the best of each with the"
        " others",
    )
    interest: tuple[str, ...] = Field(
        default=(),
        description="Quantities whose errors count for the front and for --tolerance: quantities of the run, force,"
        " impulse, energy drift, and those of impacts such as NAME.impact1.impulse; a star is any text:"
        " '*.impact*.impulse'. Default: all that have a reference",
    )
    changes: dict[str, dict[str, Any]] = Field(
        default={}, description="Name → design change, as nested tables; reuse is compared with recompute"
    )

    @model_validator(mode="after")
    def _known(self) -> "Report":
        for name in self.rivals:
            if name not in self.models:
                raise ValueError(f"rivals: '{name}' given, models are {', '.join(self.models) or 'none'}")
        return self


class Plot(Strict):
    """Further curves of the pictures."""

    label: str = Field(default="this run", description="Name of the run itself in the legend")
    compare: dict[str, dict[str, Any]] = Field(
        default={}, description="Name → changes of the scene, as nested tables; cycle.png shows their curves"
    )
