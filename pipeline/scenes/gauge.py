"""The `gauge` tables of a component."""

from typing import Literal

from pydantic import BaseModel, Field, model_validator

from gudgeon.pipeline.geometry.numbers import STRICT
from gudgeon.pipeline.scenes.modes import is_absent


class Gauge(BaseModel):
    """Where stress or strain is read: at a fibre of a beam, at a point, or all over a surface."""

    model_config = STRICT
    station: str | None = Field(
        default=None,
        exclude_if=is_absent,
        description="Name of a station of the beam, or one of its ends left and right: its bending stress, positive in"
        " tension, is read",
    )
    fibre: Literal["top", "bottom"] | None = Field(
        default=None, exclude_if=is_absent, description="Outermost fibre of the beam at the station"
    )
    point: tuple[float, float, float] | None = Field(
        default=None,
        exclude_if=is_absent,
        description="Place of a solid or plane part [m]: six components are read",
        json_schema_extra={"unit": "m"},
    )
    surface: str | None = Field(
        default=None,
        exclude_if=is_absent,
        description="Surface of a solid or plane part, or 'skin', all of its boundary: six components at each node; for"
        " pictures, a body does not name it in gauges",
    )
    quantity: Literal["stress", "strain"] | None = Field(
        default=None, exclude_if=is_absent, description="What is read at a point or on a surface; stress by default"
    )

    @model_validator(mode="after")
    def _is_one_of_them(self) -> "Gauge":
        given = [name for name in ("station", "point", "surface") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"{' and '.join(given) or 'none'} given, one of station, point and surface is needed")
        if (self.fibre is None) == (self.station is not None):
            raise ValueError("fibre, 'top' or 'bottom', is for a station, and a station needs it")
        if self.quantity is not None and self.station is not None:
            raise ValueError("quantity is for a point or a surface; at a station of a beam it is stress")
        if self.point is not None and not all(abs(x) < float("inf") for x in self.point):
            raise ValueError(f"point {list(self.point)} given, three finite coordinates are needed")
        return self

    @property
    def unit(self) -> str:
        """Of the reading."""
        return "1" if self.quantity == "strain" else "Pa"
