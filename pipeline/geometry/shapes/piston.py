"""A piston: full-round skirt, relieved ring belt, flat crown, and pin bosses that ribs join to the crown."""

from typing import Any, Literal

import numpy as np
from pydantic import Field

from gudgeon.pipeline.geometry.occ import REVOLVED, Solid, revolve
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, cylinder, plane
from gudgeon.solver.numbers import Coordinate, Length


class Piston(Solid):
    """Piston along z: the open end at z = 0, the crown on top, the pin along y, thrust sides at ±x. Metres."""

    OPTIONS = REVOLVED
    kind: Literal["piston"]
    outer_radius: Length = Field(description="Radius of the skirt [m]")
    height: Length = Field(description="Length along z, with the crown")
    crown: Length = Field(description="Thickness of the crown [m]")
    skirt_height: Length = Field(description="Height of the sliding part, below the ring belt [m]")
    wall: Length = Field(description="Thickness of the skirt [m]")
    pin_radius: Length = Field(description="Radius of the bore of the pin")
    pin_height: Length = Field(description="z of the pin's axis [m]")
    pin_offset: Coordinate = Field(default=0.0, description="x of the pin's axis [m]")
    boss_radius: Length = Field(description="Outer radius of the bosses that hold the pin")
    boss_gap: Length = Field(description="Width between the bosses, for the rod [m]")
    rib_width: Length = Field(default=0.012, description="Thickness in x of the ribs from the bosses to the crown [m]")
    belt_relief: Length = Field(default=0.0003, description="Radius of the skirt less that of the belt [m]")
    # A step instead of the cone would need elements as thin as `belt_relief`.
    relief_height: Length = Field(default=0.004, description="Height of the cone from skirt to belt [m]")

    def limits(self) -> list[tuple[str, float, float, str]]:
        inner, under = self.outer_radius - self.wall, self.height - self.crown
        half_width = abs(self.pin_offset) + self.boss_radius
        deep = 2 * np.sqrt(max(inner**2 - half_width**2, 0.0))
        return [
            ("wall", self.wall, self.outer_radius, "outer_radius"),
            ("crown", self.crown, self.height, "height"),
            ("belt_relief", self.belt_relief, self.wall, "wall"),
            ("skirt_height", self.skirt_height, self.height - self.relief_height, "height - relief_height"),
            ("pin_radius", self.pin_radius, self.boss_radius, "boss_radius"),
            ("boss_radius", self.boss_radius, self.pin_height, "pin_height"),
            ("boss_radius", self.boss_radius, under - self.pin_height, "height - crown - pin_height"),
            ("pin_radius", self.pin_radius, self.skirt_height - self.pin_height, "skirt_height - pin_height"),
            ("boss_radius + |pin_offset|", half_width, inner, "outer_radius - wall"),
            ("boss_gap", self.boss_gap, deep, "the skirt's inner width at the sides of the bosses"),
            ("rib_width", self.rib_width, 2 * self.boss_radius, "2 boss_radius"),
        ]

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        return {
            "skirt": cylinder(self.outer_radius),
            "belt": cylinder(self.outer_radius - self.belt_relief),
            "inner": cylinder(self.outer_radius - self.wall),
            "crown": plane((0, 0, 1), (0, 0, self.height)),
            "crown_inner": plane((0, 0, -1), (0, 0, self.height - self.crown)),
            "open_end": plane((0, 0, -1), (0, 0, 0)),
            "pin_bore": cylinder(self.pin_radius, (0, 1, 0), (self.pin_offset, 0, self.pin_height)),
        }

    def draw(self, occ: Any) -> None:
        inner, belt = self.outer_radius - self.wall, self.outer_radius - self.belt_relief
        under, relieved = self.height - self.crown, self.skirt_height + self.relief_height
        section = [(inner, 0), (self.outer_radius, 0), (self.outer_radius, self.skirt_height), (belt, relieved)]
        section += [(belt, self.height), (0, self.height), (0, under), (inner, under)]
        shell = revolve(occ, section)
        # Bosses end inside wall and crown, so that the union has no faces that merely touch.
        into = self.outer_radius - self.wall / 2
        boss = self._along_pin(occ, self.boss_radius)
        x = self.pin_offset - self.rib_width / 2
        rib = occ.addBox(x, -into, self.pin_height, self.rib_width, 2 * into, under + self.crown / 2 - self.pin_height)
        room = occ.addBox(-into, -self.boss_gap / 2, 0, 2 * into, self.boss_gap, self.height)
        room_inside = occ.addCylinder(0, 0, 0, 0, 0, self.height, into)
        bosses, _ = occ.fuse([(3, boss)], [(3, rib)])
        bosses, _ = occ.cut(bosses, [(3, room)])
        bosses, _ = occ.intersect(bosses, [(3, room_inside)])
        solid, _ = occ.fuse(shell, bosses)
        occ.cut(solid, [(3, self._along_pin(occ, self.pin_radius))])

    def _along_pin(self, occ: Any, radius: float) -> int:
        """Add a cylinder about the pin's axis, longer than the piston is wide, and return its tag."""
        half_length = 1.1 * self.outer_radius
        x, z = self.pin_offset, self.pin_height
        rod = occ.addCylinder(x, -half_length, z, 0, 2 * half_length, 0, radius)
        # OCC puts the seam above the axis, at `pin_offset` from the seam of the skirt: edges would be as short as that.
        occ.rotate([(3, rod)], x, 0, z, 0, 1, 0, np.pi / 2)
        return rod
