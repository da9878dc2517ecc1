"""A piston skirt with crown: a cup of constant wall, open at the bottom."""

from typing import Any, Literal

import numpy as np
from pydantic import Field

from gudgeon.pipeline.geometry.occ import Solid
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, cylinder, plane
from gudgeon.solver.numbers import Length


class Skirt(Solid):
    """Cup along z: the open end at z = 0, the crown on top. All lengths in metres."""

    kind: Literal["skirt"]
    outer_radius: Length = Field(description="Outer radius")
    wall: Length = Field(description="Thickness of the wall")
    height: Length = Field(description="Length along z, with the crown")
    crown: Length = Field(description="Thickness of the crown")

    def limits(self) -> list[tuple[str, float, float, str]]:
        return [
            ("wall", self.wall, self.outer_radius, "outer_radius"),
            ("crown", self.crown, self.height, "height"),
        ]

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        return {
            "skirt": cylinder(self.outer_radius),
            "inner": cylinder(self.outer_radius - self.wall),
            "crown": plane((0, 0, 1), (0, 0, self.height)),
            "crown_inner": plane((0, 0, -1), (0, 0, self.height - self.crown)),
            "open_end": plane((0, 0, -1), (0, 0, 0)),
        }

    def draw(self, occ: Any) -> None:
        outer = occ.addCylinder(0, 0, 0, 0, 0, self.height, self.outer_radius)
        hole = occ.addCylinder(0, 0, 0, 0, 0, self.height - self.crown, self.outer_radius - self.wall)
        solid, _ = occ.cut([(3, outer)], [(3, hole)])
        # The seam of an OCC cylinder starts at the x axis, where a thrust side is: turned to the pin axis.
        occ.rotate(solid, 0, 0, 0, 0, 0, 1, np.pi / 2)
