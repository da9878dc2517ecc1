"""The `gauge` tables of a component, and the `sensor` tables of a scene, whose bridges they are wired to."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from gudgeon.pipeline.geometry.numbers import NonZero, Point
from gudgeon.pipeline.scenes.modes import optional
from gudgeon.solver.numbers import MOST, EachOnce, Length, Name, PositiveRatio, Ratio, Strict

SECTION_UNITS = {"bending-moment": "N m", "shear-force": "N"}
"""Units of the forces of a beam's section."""
WIRING = {"quarter": 1, "half": 2, "full": 4}
"""Gauges of a bridge."""
ARMS = (1.0, -1.0, 1.0, -1.0)
"""Sign of each arm in a bridge."""
WRENCH = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")


class Gauge(Strict):
    """A position where stress or strain is recorded: a fibre of a beam, its section, a point, or a surface."""

    station: str | None = optional(
        "Station of the beam, or its end left or right, where the bending stress is recorded, positive in tension, or a"
        " section force; where a force acts at the station, the mean of both its sides"
    )
    fibre: Literal["top", "bottom", "left", "right"] | None = optional(
        "Outermost fibre of the beam at the station, for its stress or strain; left and right, in the middle of the"
        " height on the sides of plus and minus the lateral axis, of beams in space and frames"
    )
    point: Point | None = optional("Point of a solid or plane part [m] where six components are recorded")
    direction: NonZero | None = optional(
        "Direction of a strain gauge at a point of the surface, in the component's axes: one value, the normal strain"
        " or stress along it"
    )
    length: Length | None = optional(
        "Length of a strain gauge's grid along its direction, over which the value is the mean; default: at its point"
    )
    surface: str | None = optional(
        "Surface of a solid or plane part, or 'skin', its whole boundary: six components at each node, for pictures; a"
        " body must not name it in gauges"
    )
    quantity: Literal["stress", "strain", "bending-moment", "shear-force"] | None = optional(
        "stress, the default, or strain; of the whole section at a station: bending-moment"
        " E I w″ [N m], which presses the top fibre, or shear-force [N], along z from the side of the end right"
    )

    @model_validator(mode="after")
    def _is_one_of_them(self) -> "Gauge":
        positions = [name for name in ("station", "point", "surface") if getattr(self, name) is not None]
        if len(positions) != 1:
            raise ValueError(
                f"{' and '.join(positions) or 'none'} given; exactly one of station, point and surface is needed"
            )
        section = self.quantity in SECTION_UNITS
        if section and (self.station is None or self.fibre is not None):
            raise ValueError(f"quantity '{self.quantity}' is of a whole section: give a station, and no fibre")
        if not section and (self.fibre is None) == (self.station is not None):
            raise ValueError(
                "fibre, 'top' or 'bottom', must be given with a station, and only then; or quantity"
                " 'bending-moment' or 'shear-force' of its section"
            )
        if self.direction is not None and self.point is None:
            raise ValueError("direction is that of a strain gauge at a point; give a point")
        if self.length is not None and self.direction is None:
            raise ValueError("length is that of a strain gauge's grid; give its direction")
        return self

    @property
    def unit(self) -> str:
        """Unit of the recorded quantity."""
        return SECTION_UNITS.get(self.quantity or "stress", "1" if self.quantity == "strain" else "Pa")


class Channel(Strict):
    """One bridge: its signal is gauge factor / 4 times ε₁ − ε₂ + ε₃ − ε₄ of the gauges that it has [V/V]."""

    gauges: tuple[str, ...] = Field(
        min_length=1, max_length=4, description="Gauges of the body in the bridge's arms, whose signs are + − + −"
    )
    wiring: Literal["quarter", "half", "full"] | None = Field(
        default=None, description="quarter: one gauge; half: two; full: four; default: by their number"
    )

    @model_validator(mode="after")
    def _complete(self) -> "Channel":
        count = len(self.gauges)
        if count not in WIRING.values():
            raise ValueError(f"{count} gauges given; a bridge has 1 (quarter), 2 (half) or 4 (full)")
        if self.wiring is not None and WIRING[self.wiring] != count:
            raise ValueError(f"wiring '{self.wiring}' has {WIRING[self.wiring]} gauges, {count} given")
        return self

    @property
    def wired(self) -> str:
        """Its wiring, as given or by the number of gauges."""
        return self.wiring or {count: name for name, count in WIRING.items()}[len(self.gauges)]


class Sensor(Strict):
    """A body whose strain gauges measure a wrench: their bridges, noise, drift and quantisation."""

    body: str = Field(description="Body whose gauges are wired")
    force: str | None = Field(
        default=None, description="Force of kind 'wrench' that is measured; default: the only one of the scene"
    )
    components: Annotated[tuple[Literal["Fx", "Fy", "Fz", "Mx", "My", "Mz"], ...], EachOnce] = Field(
        default=WRENCH, min_length=1, description="Components that are measured; others are taken not to act"
    )
    channel: dict[Name, Channel] = Field(
        default={}, description="Bridges by name; default: a quarter bridge of each gauge of the body, with its name"
    )
    gauge_factor: PositiveRatio = Field(default=2.0, description="Relative change of resistance over strain")
    noise: Ratio = Field(default=0.0, ge=0, description="Standard deviation of a sample's noise [V/V]")
    seed: int = Field(default=0, ge=0, le=MOST, description="Seed of noise and drift")
    drift: Ratio = Field(
        default=0.0, ge=0, description="Random walk of the offsets: standard deviation after one second [V/V]"
    )
    offset: Ratio = Field(default=0.0, ge=0, description="Standard deviation of the channels' offsets [V/V]")
    resolution: Ratio = Field(default=0.0, ge=0, description="Step to which signals are rounded [V/V]; 0: none")

    def channels(self, gauges: tuple[str, ...]) -> dict[str, Channel]:
        """Return its bridges, by default of every gauge of the body."""
        return self.channel or {name: Channel(gauges=(name,)) for name in gauges}

    @model_validator(mode="after")
    def _once(self) -> "Sensor":
        if len(set(self.components)) < len(self.components):
            raise ValueError(f"components: {list(self.components)} given, each is allowed once")
        return self
