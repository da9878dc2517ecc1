"""A solid circular cylinder."""

from typing import Any, Literal

from pydantic import Field

from gudgeon.pipeline.geometry.occ import Solid
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, cylinder, plane
from gudgeon.solver.numbers import Length


class Cylinder(Solid):
    """Cylinder about the z axis, from z = 0 up to z = `length`. All lengths in metres."""

    kind: Literal["cylinder"]
    radius: Length = Field(description="Radius")
    length: Length = Field(description="Length along z")

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        return {
            "side": cylinder(self.radius),
            "bottom": plane((0, 0, -1), (0, 0, 0)),
            "top": plane((0, 0, 1), (0, 0, self.length)),
        }

    def draw(self, occ: Any) -> None:
        occ.addCylinder(0, 0, 0, 0, 0, self.length, self.radius)
