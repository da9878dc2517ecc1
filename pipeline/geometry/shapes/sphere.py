"""A solid sphere."""

from dataclasses import replace
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from gudgeon.modaldb.records.mesh import MeshRecord, Surface
from gudgeon.pipeline.geometry.occ import Solid
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, sphere
from gudgeon.solver.numbers import Length, Strict

WIDER = 1.2
"""Radius about the lowest point within which elements have the size of the cap, over that of the cap."""


class Cap(Strict):
    """Part of a sphere about its lowest point, which meets planes."""

    angle: Annotated[float, Field(gt=0, le=90, json_schema_extra={"unit": "deg"})] = Field(
        description="Between the lowest point and the rim, seen from the centre; a contact takes up to 8 [deg]"
    )
    size: Length = Field(description="Edge length of the elements there: a third of the radius of contact [m]")


class Sphere(Solid):
    """Sphere about the origin."""

    kind: Literal["sphere"]
    radius: Length = Field(description="Radius")
    cap: Cap | None = Field(default=None, description="Fine elements about the lowest point, surface 'cap'")

    @model_validator(mode="after")
    def _finer(self) -> Self:
        if self.cap is not None and self.cap.size > self._rim:
            raise ValueError(f"cap.size {self.cap.size:.6g} m is above the radius of the cap, {self._rim:.6g} m")
        return self

    @property
    def _rim(self) -> float:
        """Radius of the cap [m]."""
        return 0.0 if self.cap is None else self.radius * float(np.sin(np.radians(self.cap.angle)))

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        return {"surface": sphere(self.radius)}

    def draw(self, occ: Any) -> None:
        occ.addSphere(0, 0, 0, self.radius)

    def refine(self, gmsh: Any) -> None:
        if self.cap is None:
            return
        field, size = gmsh.model.mesh.field, gmsh.option.getNumber("Mesh.MeshSizeMax")
        ball, numbers = (
            field.add("Ball"),
            {"Radius": WIDER * self._rim, "Thickness": self.radius, "ZCenter": -self.radius},
        )
        for name, value in (numbers | {"VIn": self.cap.size, "VOut": size}).items():
            field.setNumber(ball, name, value)
        field.setAsBackgroundMesh(ball)
        gmsh.option.setNumber("Mesh.MeshSizeMin", min(self.cap.size, size))

    def expected(self, volume: float, area: float, size: float) -> float:
        count = super().expected(volume, area, size)
        return count if self.cap is None else count + 5.0 * (2 / 3) * np.pi * (WIDER * self._rim / self.cap.size) ** 3

    def build(self, size: float) -> MeshRecord:
        mesh = super().build(size)
        if self.cap is None:
            return mesh
        skin = mesh.surfaces["surface"]
        middle = mesh.nodes[skin.facets].mean(axis=1)
        angle = np.arctan2(np.linalg.norm(middle[:, :2], axis=1), -middle[:, 2])
        within = angle < np.radians(self.cap.angle)
        return replace(mesh, surfaces=mesh.surfaces | {"cap": Surface(skin.facets[within], skin.shape)})
