"""The `gauge` tables of a component."""

from typing import Literal

from pydantic import model_validator

from gudgeon.pipeline.geometry.numbers import Point
from gudgeon.pipeline.scenes.modes import optional
from gudgeon.solver.numbers import Strict

SECTION_UNITS = {"bending-moment": "N m", "shear-force": "N"}
"""Units of the forces of a beam's section."""


class Gauge(Strict):
    """A place where stress or strain is recorded: a fibre of a beam, its section, a point, or a surface."""

    station: str | None = optional(
        "Station of the beam, or its end left or right, where the bending stress is recorded, positive in tension, or a"
        " section force; where a force acts at the station, the mean of both its sides"
    )
    fibre: Literal["top", "bottom"] | None = optional("Outermost fibre of the beam at the station, for its stress")
    point: Point | None = optional("Point of a solid or plane part [m] where six components are recorded")
    surface: str | None = optional(
        "Surface of a solid or plane part, or 'skin', its whole boundary: six components at each node, for pictures; a"
        " body must not name it in gauges"
    )
    quantity: Literal["stress", "strain", "bending-moment", "shear-force"] | None = optional(
        "stress, the default, or strain, at a point or on a surface; of the whole section at a station: bending-moment"
        " E I w″ [N m], which presses the top fibre, or shear-force [N], along z from the side of the end right"
    )

    @model_validator(mode="after")
    def _is_one_of_them(self) -> "Gauge":
        given = [name for name in ("station", "point", "surface") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(
                f"{' and '.join(given) or 'none'} given; exactly one of station, point and surface is needed"
            )
        section = self.quantity in SECTION_UNITS
        if section and (self.station is None or self.fibre is not None):
            raise ValueError(f"quantity '{self.quantity}' is of a whole section: give a station, and no fibre")
        if not section and (self.fibre is None) == (self.station is not None):
            raise ValueError(
                "fibre, 'top' or 'bottom', must be given with a station, and only then; or quantity"
                " 'bending-moment' or 'shear-force' of its section"
            )
        if self.quantity == "strain" and self.station is not None:
            raise ValueError("quantity 'strain' applies to a point or a surface; a fibre of a beam gives stress")
        return self

    @property
    def unit(self) -> str:
        """Unit of the recorded quantity."""
        return SECTION_UNITS.get(self.quantity or "stress", "1" if self.quantity == "strain" else "Pa")
