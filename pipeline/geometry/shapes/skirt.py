"""A piston skirt with crown: a cup of constant wall, open at the bottom."""

from typing import Literal

from pydantic import BaseModel, model_validator

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.geometry.numbers import STRICT, Length
from gudgeon.pipeline.geometry.occ import SurfaceRule, build_solid


class Skirt(BaseModel):
    """Cup along z: the open end at z = 0, the crown on top. All lengths in metres."""

    model_config = STRICT
    kind: Literal["skirt"]
    outer_radius: Length
    wall: Length
    height: Length
    crown: Length

    @model_validator(mode="after")
    def _fits(self) -> "Skirt":
        if self.wall >= self.outer_radius:
            raise ValueError(f"wall is {self.wall} m, it must be below outer_radius = {self.outer_radius} m")
        if self.crown >= self.height:
            raise ValueError(f"crown is {self.crown} m, it must be below height = {self.height} m")
        return self

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        """Return the named surfaces with the true shape of each."""
        axis, origin = [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]
        outer, inner = self.outer_radius, self.outer_radius - self.wall
        return {
            "skirt": {"kind": "cylinder", "radius": outer, "axis": axis, "origin": origin},
            "inner": {"kind": "cylinder", "radius": inner, "axis": axis, "origin": origin},
            "crown": {"kind": "plane", "normal": axis, "origin": [0.0, 0.0, self.height]},
            "crown_inner": {
                "kind": "plane",
                "normal": [0.0, 0.0, -1.0],
                "origin": [0.0, 0.0, self.height - self.crown],
            },
            "open_end": {"kind": "plane", "normal": [0.0, 0.0, -1.0], "origin": origin},
        }

    def build(self, size: float) -> MeshRecord:
        """Mesh the cup with curved tet10 of edge length `size` [m]."""

        def draw(occ: object) -> None:
            # The seam of an OCC cylinder starts at the x axis, where a thrust side is: turned to the pin axis.
            whole = occ.addCylinder(0, 0, 0, 0, 0, self.height, self.outer_radius)  # type: ignore[attr-defined]
            hole = occ.addCylinder(  # type: ignore[attr-defined]
                0, 0, 0, 0, 0, self.height - self.crown, self.outer_radius - self.wall
            )
            solid, _ = occ.cut([(3, whole)], [(3, hole)])  # type: ignore[attr-defined]
            occ.rotate(solid, 0, 0, 0, 0, 0, 1, 1.5707963267948966)  # type: ignore[attr-defined]

        return build_solid(draw, size, self.surface_shapes())
