"""A wet cylinder liner: a tube that hangs by a flange at its top end."""

from typing import Any, Literal

from pydantic import BaseModel, model_validator

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.geometry.numbers import STRICT, Length
from gudgeon.pipeline.geometry.occ import REVOLVED, SurfaceRule, build_solid, cylinder, plane, revolve


class Liner(BaseModel):
    """Tube along z: the bottom at z = 0, the flange below the top. All lengths in metres."""

    model_config = STRICT
    kind: Literal["liner"]
    bore_radius: Length
    wall: Length
    length: Length
    flange_height: Length
    flange_width: Length
    """How far the flange stands out beyond the tube."""

    @model_validator(mode="after")
    def _fits(self) -> "Liner":
        if self.flange_height >= self.length:
            raise ValueError(f"flange_height is {self.flange_height} m, it must be below length = {self.length} m")
        return self

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        """Return the named surfaces with the true shape of each."""
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

    def build(self, size: float) -> MeshRecord:
        """Mesh the liner with curved tet10 of edge length `size` [m]."""
        bore, outer = self.bore_radius, self.bore_radius + self.wall
        flange, under = outer + self.flange_width, self.length - self.flange_height
        section = [(bore, 0), (outer, 0), (outer, under), (flange, under), (flange, self.length), (bore, self.length)]

        def draw(occ: Any) -> None:
            revolve(occ, section)

        return build_solid(draw, size, self.surface_shapes(), options=REVOLVED)
