"""A solid sphere."""

from typing import Any, Literal

from pydantic import Field

from gudgeon.pipeline.geometry.occ import Solid
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, sphere
from gudgeon.solver.numbers import Length


class Sphere(Solid):
    """Sphere about the origin."""

    kind: Literal["sphere"]
    radius: Length = Field(description="Radius")

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        return {"surface": sphere(self.radius)}

    def draw(self, occ: Any) -> None:
        occ.addSphere(0, 0, 0, self.radius)
