"""One sector of a bladed disk: hub with a bore, web, rim, and a flat staggered blade on it."""

from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, Field, model_validator

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.geometry.numbers import STRICT, Length
from gudgeon.pipeline.geometry.occ import TURN, SurfaceRule, build_solid, cylinder, plane

ON_FACE = 1e-9
"""Distance of a face's centre from a plane through the axis, over the tip's radius, below which it lies on it."""
ROUND_OFF = 1e-9
"""Relative: what is as large as its limit but for round-off touches, and gmsh cannot mesh what merely touches."""


ROUND: dict[str, float] = {"Mesh.MeshSizeFromCurvature": TURN, "Mesh.MeshSizeMin": 0}


class BladedSector(BaseModel):
    """A sector of a bladed disk about the z axis, half of it on either side of the x axis; the blade stands along x.

    The mesh of face `high` is that of face `low`, turned. The blade's elements end at the rim's radius. Metres.
    """

    model_config = STRICT
    kind: Literal["bladed-sector"]
    sectors: int = Field(default=24, ge=3, le=360, description="Of the whole wheel: a sector takes 2π/sectors")
    bore_radius: Length = 0.04
    hub_radius: Length = 0.065
    hub_width: Length = Field(default=0.05, description="Along the axis [m]")
    web: Length = Field(default=0.012, description="Thickness of the disk between hub and rim [m]")
    rim_radius: Length = Field(default=0.18, description="Where the blade stands [m]")
    rim_height: Length = Field(default=0.018, description="Radial thickness of the rim [m]")
    rim_width: Length = Field(default=0.045, description="Along the axis [m]")
    tip_radius: Length = 0.27
    chord: Length = 0.045
    blade_thickness: Length = 0.006
    stagger_deg: float = Field(
        default=35.0, ge=0, le=90, description="Of the chord from the axis [deg]", json_schema_extra={"unit": "deg"}
    )

    @model_validator(mode="after")
    def _fits(self) -> "BladedSector":
        for key, value, limit, meaning in self._limits():
            if value >= limit * (1 - ROUND_OFF):
                raise ValueError(f"{key} is {value:.6g} m, it must be below {meaning} = {limit:.6g} m")
        return self

    def _limits(self) -> list[tuple[str, float, float, str]]:
        """Return what must fit: key, its value, the limit and what the limit is."""
        beta, half = np.radians(self.stagger_deg), np.pi / self.sectors
        c, t = self.chord, self.blade_thickness
        axial, across = c * np.cos(beta) + t * np.sin(beta), c * np.sin(beta) + t * np.cos(beta)
        return [
            ("bore_radius", self.bore_radius, self.hub_radius, "hub_radius"),
            ("hub_radius", self.hub_radius, self.rim_radius - self.rim_height, "rim_radius - rim_height"),
            ("web", self.web, self.hub_width, "hub_width"),
            ("web", self.web, self.rim_width, "rim_width"),
            ("rim_radius", self.rim_radius, self.tip_radius, "tip_radius"),
            ("blade_thickness", t, c, "chord"),
            ("the blade's extent along the axis", axial, self.rim_width, "rim_width"),
            ("the blade's extent across the axis", across, 2 * self.rim_radius * np.sin(half), "the sector at the rim"),
        ]

    @property
    def blade_radius(self) -> float:
        """Distance from the axis beyond which elements are the blade's [m]."""
        return self.rim_radius

    def surface_shapes(self) -> dict[str, SurfaceRule]:
        """Return the named surfaces with the true shape of each."""
        sin, cos = np.sin(np.pi / self.sectors), np.cos(np.pi / self.sectors)
        beta, axis = np.radians(self.stagger_deg), (0, 0, 0)
        side = np.array([0.0, np.cos(beta), np.sin(beta)])
        shift = self.blade_thickness / 2 * side
        return {
            "low": plane((-sin, -cos, 0), axis),
            "high": plane((-sin, cos, 0), axis),
            "bore": cylinder(self.bore_radius),
            "hub_front": plane((0, 0, 1), (0, 0, self.hub_width / 2)),
            "hub_back": plane((0, 0, -1), (0, 0, -self.hub_width / 2)),
            "rim": cylinder(self.rim_radius),
            "pressure_side": plane(tuple(side), tuple(shift)),
            "suction_side": plane(tuple(-side), tuple(-shift)),
            "tip": plane((1, 0, 0), (self.tip_radius, 0, 0)),
        }

    def build(self, size: float) -> MeshRecord:
        """Mesh the sector with curved tet10 of edge length `size` [m]."""
        return build_solid(self._draw, size, self.surface_shapes(), options=ROUND, prepare=self._tie)

    def _draw(self, occ: Any) -> None:
        """Draw disk and blade as two solids with a common face."""
        angle = 2 * np.pi / self.sectors
        hub, rim, web = self.hub_width / 2, self.rim_width / 2, self.web / 2
        inner = self.rim_radius - self.rim_height
        upper = [(self.bore_radius, hub), (self.hub_radius, hub), (self.hub_radius, web), (inner, web), (inner, rim),
                 (self.rim_radius, rim)]  # fmt: skip
        section = [*upper, *((radius, -height) for radius, height in reversed(upper))]
        cos, sin = np.cos(angle / 2), np.sin(angle / 2)
        corners = [occ.addPoint(radius * cos, -radius * sin, height) for radius, height in section]
        edges = [occ.addLine(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
        face = (2, occ.addPlaneSurface([occ.addCurveLoop(edges)]))
        disk = [entity for entity in occ.revolve([face], 0, 0, 0, 0, 0, 1, angle) if entity[0] == 3]
        root, t, c = self.rim_radius * cos / 2, self.blade_thickness, self.chord
        blade = (3, occ.addBox(root, -t / 2, -c / 2, self.tip_radius - root, t, c))
        # The box's y becomes the side's normal.
        occ.rotate([blade], 0, 0, 0, 1, 0, 0, np.radians(self.stagger_deg))
        core = (3, occ.addCylinder(0, 0, -2 * c, 0, 0, 4 * c, self.rim_radius))
        cut, _ = occ.cut([blade], [core])
        occ.fragment(disk, cut)

    def _tie(self, model: Any) -> None:
        """Let gmsh mesh the high face as the low one, turned."""
        angle, shapes = 2 * np.pi / self.sectors, self.surface_shapes()
        found: dict[str, list[int]] = {"low": [], "high": []}
        for _, tag in model.getEntities(2):
            centre = np.array(model.occ.getCenterOfMass(2, tag))
            for name, tags in found.items():
                if abs(centre @ shapes[name]["normal"]) < ON_FACE * self.tip_radius:
                    tags.append(tag)
        turn = np.eye(4)
        turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        model.mesh.setPeriodic(2, found["high"], found["low"], turn.ravel().tolist())
