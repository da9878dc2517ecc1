"""A rectangular block."""

from dataclasses import replace
from typing import Any, Literal

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.geometry.occ import Solid
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, box_faces
from gudgeon.solver.numbers import Length


class Box(Solid):
    """Block centred in x and y, from z = 0 up to z = `lz`. All lengths in metres."""

    kind: Literal["box"]
    lx: Length = Field(description="Length along x")
    ly: Length = Field(description="Length along y")
    lz: Length = Field(description="Length along z")
    patch: tuple[Length, Length] | None = Field(
        default=None, description="Sides along x and y of a rectangle in the middle of the top, surface 'patch' [m]"
    )

    @field_validator("patch")
    @classmethod
    def _on_top(cls, value: tuple[float, float] | None, info: ValidationInfo) -> tuple[float, float] | None:
        for length, name in zip(value or (), ("lx", "ly"), strict=False):
            if length > info.data.get(name, np.inf):
                raise ValueError(f"{list(value or ())} given, its side {length} m is longer than {name}")
        return value

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        return box_faces(self.lx, self.ly, self.lz)

    def draw(self, occ: Any) -> None:
        solid = occ.addBox(-self.lx / 2, -self.ly / 2, 0, self.lx, self.ly, self.lz)
        if self.patch is not None:
            x, y = self.patch
            occ.fragment([(3, solid)], [(2, occ.addRectangle(-x / 2, -y / 2, self.lz, x, y))])

    def build(self, size: float) -> MeshRecord:
        mesh = super().build(size)
        if self.patch is None:
            return mesh
        top = mesh.surfaces["top"]
        middle = np.abs(mesh.nodes[top.facets].mean(axis=1)[:, :2])
        in_patch = (middle < np.array(self.patch) / 2).all(axis=1)
        return replace(mesh, surfaces=mesh.surfaces | {"patch": Surface(top.facets[in_patch], top.shape)})
