"""A flat rectangular plate, meshed in layers."""

from dataclasses import replace
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, Field

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.geometry.numbers import STRICT, Length
from gudgeon.pipeline.geometry.occ import SurfaceRule, box_faces, build_solid

MIRRORED = [0, 2, 1, 5, 4, 3]
"""A six-node facet the other way round."""


class Plate(BaseModel):
    """Plate centred in x and y, from z = 0 up to z = `thickness`. All lengths in metres.

    Quadratic elements carry the parabola of transverse shear from two layers on: one leaves bending of a plate ten
    times as long as thick 0.5 % too high, whatever the size along it.
    """

    model_config = STRICT
    kind: Literal["plate"]
    lx: Length
    ly: Length
    thickness: Length
    layers: int = Field(default=2, ge=1, description="Elements through the thickness")

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        """Return the named surfaces with the true shape of each."""
        return box_faces(self.lx, self.ly, self.thickness)

    def build(self, size: float) -> MeshRecord:
        """Mesh the plate with tet10 of edge length `size` [m] along it."""

        def draw(occ: Any) -> None:
            face = occ.addRectangle(-self.lx / 2, -self.ly / 2, 0, self.lx, self.ly)
            occ.extrude([(2, face)], 0, 0, self.thickness, numElements=[self.layers])

        mesh = build_solid(draw, size, self.surface_shapes())
        return replace(mesh, surfaces={name: _outward(mesh, surface) for name, surface in mesh.surfaces.items()})


def _outward(mesh: MeshRecord, surface: Surface) -> Surface:
    """Return a plane surface whose facets run about its outward normal; extruded faces keep their drawing's sense."""
    a, b, c = np.moveaxis(mesh.nodes[surface.facets[:, :3]], 1, 0)
    inward = np.cross(b - a, c - a) @ surface.shape["normal"] < 0
    return replace(surface, facets=np.where(inward[:, None], surface.facets[:, MIRRORED], surface.facets))
