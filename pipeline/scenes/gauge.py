"""The `gauge` tables of a component."""

from typing import Literal

from pydantic import model_validator

from gudgeon.pipeline.geometry.numbers import NonZero, Point
from gudgeon.pipeline.scenes.modes import optional
from gudgeon.solver.numbers import Length, Strict

SECTION_UNITS = {"bending-moment": "N m", "shear-force": "N"}
"""Units of the forces of a beam's section."""


class Gauge(Strict):
    """A place where stress or strain is recorded: a fibre of a beam, its section, a point, or a surface."""

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
        if self.direction is not None and self.point is None:
            raise ValueError("direction is that of a strain gauge at a point; give a point")
        if self.length is not None and self.direction is None:
            raise ValueError("length is that of a strain gauge's grid; give its direction")
        return self

    @property
    def unit(self) -> str:
        """Unit of the recorded quantity."""
        return SECTION_UNITS.get(self.quantity or "stress", "1" if self.quantity == "strain" else "Pa")
