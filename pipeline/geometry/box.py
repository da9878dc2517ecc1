"""A rectangular block."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from modaldb.schema import MeshRecord
from pipeline.geometry.occ import SurfaceRule, build_solid, plane

Length = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class Box(BaseModel):
    """Block centred in x and y, from z = 0 up to z = `lz`. All lengths in metres."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    kind: Literal["box"]
    lx: Length
    ly: Length
    lz: Length

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        """Return the named surfaces with the true shape of each."""
        x, y = self.lx / 2, self.ly / 2
        return {
            "left": plane((-1, 0, 0), (-x, 0, 0)),
            "right": plane((1, 0, 0), (x, 0, 0)),
            "front": plane((0, -1, 0), (0, -y, 0)),
            "back": plane((0, 1, 0), (0, y, 0)),
            "bottom": plane((0, 0, -1), (0, 0, 0)),
            "top": plane((0, 0, 1), (0, 0, self.lz)),
        }

    def build(self, size: float) -> MeshRecord:
        """Mesh the block with tet10 of edge length `size` [m]."""

        def draw(occ: Any) -> None:
            occ.addBox(-self.lx / 2, -self.ly / 2, 0, self.lx, self.ly, self.lz)

        return build_solid(draw, size, self.surface_shapes())
