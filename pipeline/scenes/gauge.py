"""The `gauge` tables of a component."""

from typing import Literal

from pydantic import model_validator

from gudgeon.pipeline.geometry.numbers import Point
from gudgeon.pipeline.scenes.modes import optional
from gudgeon.solver.numbers import Strict


class Gauge(Strict):
    """A place where stress or strain is recorded: a fibre of a beam, a point, or a surface."""

    station: str | None = optional(
        "Station of the beam, or its end left or right, where the bending stress is recorded, positive in tension"
    )
    fibre: Literal["top", "bottom"] | None = optional("Outermost fibre of the beam at the station")
    point: Point | None = optional("Point of a solid or plane part [m] where six components are recorded")
    surface: str | None = optional(
        "Surface of a solid or plane part, or 'skin', its whole boundary: six components at each node, for pictures; a"
        " body must not name it in gauges"
    )
    quantity: Literal["stress", "strain"] | None = optional("Quantity at a point or on a surface; default: stress")

    @model_validator(mode="after")
    def _is_one_of_them(self) -> "Gauge":
        given = [name for name in ("station", "point", "surface") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(
                f"{' and '.join(given) or 'none'} given; exactly one of station, point and surface is needed"
            )
        if (self.fibre is None) == (self.station is not None):
            raise ValueError("fibre, 'top' or 'bottom', must be given with a station, and only then")
        if self.quantity is not None and self.station is not None:
            raise ValueError("quantity applies to a point or a surface; a station of a beam always gives stress")
        return self

    @property
    def unit(self) -> str:
        """Unit of the recorded quantity."""
        return "1" if self.quantity == "strain" else "Pa"
