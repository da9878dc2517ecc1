"""A wet cylinder liner: a tube with a supporting flange at its top end."""

from typing import Any, Literal

from pydantic import Field

from gudgeon.pipeline.geometry.occ import REVOLVED, Solid, revolve
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, cylinder, plane
from gudgeon.solver.numbers import Length


class Liner(Solid):
    """Tube along z: the bottom at z = 0, the flange below the top. All lengths in metres."""

    OPTIONS = REVOLVED
    kind: Literal["liner"]
    bore_radius: Length = Field(description="Inner radius")
    wall: Length = Field(description="Thickness of the wall")
    length: Length = Field(description="Length along z")
    flange_height: Length = Field(description="Length of the flange along z")
    flange_width: Length = Field(description="Radial extent of the flange beyond the tube [m]")

    def limits(self) -> list[tuple[str, float, float, str]]:
        return [("flange_height", self.flange_height, self.length, "length")]

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        outer = self.bore_radius + self.wall
        under = self.length - self.flange_height
        return {
            "bore": cylinder(self.bore_radius),
            "outer": cylinder(outer),
            "flange": cylinder(outer + self.flange_width),
            "flange_under": plane((0, 0, -1), (0, 0, under)),
            "top": plane((0, 0, 1), (0, 0, self.length)),
            "bottom": plane((0, 0, -1), (0, 0, 0)),
        }

    def draw(self, occ: Any) -> None:
        bore, outer = self.bore_radius, self.bore_radius + self.wall
        flange, under = outer + self.flange_width, self.length - self.flange_height
        section = [(bore, 0), (outer, 0), (outer, under), (flange, under), (flange, self.length), (bore, self.length)]
        revolve(occ, section)
