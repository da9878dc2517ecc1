"""A flat rectangular plate, meshed in layers."""

from dataclasses import replace
from typing import Any, Literal

import numpy as np
from pydantic import Field

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.geometry.cells import turned
from gudgeon.pipeline.geometry.occ import Solid
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, box_faces
from gudgeon.solver.numbers import MOST, Length


class Plate(Solid):
    """Plate centred in x and y, from z = 0 up to z = `thickness`. All lengths in metres.

    Two layers of quadratic elements represent the parabola of transverse shear. With one layer the bending stiffness of
    a plate ten times as long as thick is 0.5 % too high, whatever the size along it.
    """

    kind: Literal["plate"]
    lx: Length = Field(description="Length along x")
    ly: Length = Field(description="Length along y")
    thickness: Length = Field(description="Length along z")
    layers: int = Field(default=2, ge=1, le=MOST, description="Elements through the thickness")

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        return box_faces(self.lx, self.ly, self.thickness)

    def draw(self, occ: Any) -> None:
        face = occ.addRectangle(-self.lx / 2, -self.ly / 2, 0, self.lx, self.ly)
        occ.extrude([(2, face)], 0, 0, self.thickness, numElements=[self.layers])

    def expected(self, volume: float, area: float, size: float) -> float:
        return max(super().expected(volume, area, size), 3.3 * self.layers * area / size**2)

    def build(self, size: float) -> MeshRecord:
        # Extruded faces keep the sense in which they were drawn.
        mesh, surfaces = super().build(size), {}
        for name, surface in mesh.surfaces.items():
            facets = turned(mesh.nodes, surface.facets, np.array(surface.shape["normal"]))
            surfaces[name] = Surface(facets, surface.shape)
        return replace(mesh, surfaces=surfaces)
