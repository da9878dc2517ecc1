"""A solid sphere."""

from typing import Any, Literal

from pydantic import BaseModel

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.geometry.numbers import STRICT, Length
from gudgeon.pipeline.geometry.occ import SurfaceRule, build_solid, sphere


class Sphere(BaseModel):
    """Sphere about the origin."""

    model_config = STRICT
    kind: Literal["sphere"]
    radius: Length

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        """Return the named surface with its true shape."""
        return {"surface": sphere(self.radius)}

    def build(self, size: float) -> MeshRecord:
        """Mesh the sphere with curved tet10 of edge length `size` [m]."""

        def draw(occ: Any) -> None:
            occ.addSphere(0, 0, 0, self.radius)

        return build_solid(draw, size, self.surface_shapes())
