"""One sector of a bladed disk: hub with a bore, web, rim, and a flat staggered blade on it."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from gudgeon.pipeline.geometry.occ import TURN, Solid, polygon_face, turned_solid
from gudgeon.pipeline.geometry.surfaces import SurfaceRule, cylinder, plane
from gudgeon.solver.numbers import Length

ON_FACE = 1e-9
"""Largest distance of a face's centre from a plane through the axis on which it lies, over the radius of the tip."""


class BladedSector(Solid):
    """A sector of a bladed disk about the z axis, symmetric about the x axis, with the blade along x.

    The mesh of face `high` is that of face `low`, rotated. The blade's elements end at the rim's radius. Metres.
    """

    OPTIONS: ClassVar[Mapping[str, float]] = {"Mesh.MeshSizeFromCurvature": TURN, "Mesh.MeshSizeMin": 0}
    kind: Literal["bladed-sector"]
    sectors: int = Field(default=24, ge=3, le=360, description="Number of sectors of the wheel; one has 2π/sectors")
    bore_radius: Length = Field(default=0.04, description="Radius of the bore")
    hub_radius: Length = Field(default=0.065, description="Outer radius of the disk, where the blade begins")
    hub_width: Length = Field(default=0.05, description="Width of the hub along the axis [m]")
    web: Length = Field(default=0.012, description="Thickness of the disk between hub and rim [m]")
    rim_radius: Length = Field(default=0.18, description="Root radius of the blade [m]")
    rim_height: Length = Field(default=0.018, description="Radial thickness of the rim [m]")
    rim_width: Length = Field(default=0.045, description="Width of the rim along the axis [m]")
    tip_radius: Length = Field(default=0.27, description="Radius of the tip of the blade")
    chord: Length = Field(default=0.045, description="Length of the blade along the axis of the disk")
    blade_thickness: Length = Field(default=0.006, description="Thickness of the blade")
    stagger_deg: float = Field(
        default=35.0,
        ge=0,
        le=90,
        description="Angle of the chord from the axis [deg]",
        json_schema_extra={"unit": "deg"},
    )

    def limits(self) -> list[tuple[str, float, float, str]]:
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
        """Distance from the axis beyond which elements belong to the blade [m]."""
        return self.rim_radius

    def surface_shapes(self) -> dict[str, SurfaceRule]:
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

    def draw(self, occ: Any) -> None:
        """Draw disk and blade as two solids with a common face."""
        angle = 2 * np.pi / self.sectors
        hub, rim, web = self.hub_width / 2, self.rim_width / 2, self.web / 2
        inner = self.rim_radius - self.rim_height
        upper = [(self.bore_radius, hub), (self.hub_radius, hub), (self.hub_radius, web), (inner, web), (inner, rim),
                 (self.rim_radius, rim)]  # fmt: skip
        section = [*upper, *((radius, -height) for radius, height in reversed(upper))]
        cos, sin = np.cos(angle / 2), np.sin(angle / 2)
        corners = [(radius * cos, -radius * sin, height) for radius, height in section]
        disk = turned_solid(occ, polygon_face(occ, corners), angle)
        root, t, c = self.rim_radius * cos / 2, self.blade_thickness, self.chord
        blade = (3, occ.addBox(root, -t / 2, -c / 2, self.tip_radius - root, t, c))
        # The box's y becomes the side's normal.
        occ.rotate([blade], 0, 0, 0, 1, 0, 0, np.radians(self.stagger_deg))
        core = (3, occ.addCylinder(0, 0, -2 * c, 0, 0, 4 * c, self.rim_radius))
        cut, _ = occ.cut([blade], [core])
        occ.fragment(disk, cut)

    def tie(self, model: Any) -> bool:
        """Let gmsh mesh the high face as the low one, rotated."""
        angle, shapes = 2 * np.pi / self.sectors, self.surface_shapes()
        side_tags: dict[str, list[int]] = {"low": [], "high": []}
        for _, tag in model.getEntities(2):
            centre = np.array(model.occ.getCenterOfMass(2, tag))
            for name, tags in side_tags.items():
                if abs(centre @ shapes[name]["normal"]) < ON_FACE * self.tip_radius:
                    tags.append(tag)
        turn = np.eye(4)
        turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        model.mesh.setPeriodic(2, side_tags["high"], side_tags["low"], turn.ravel().tolist())
        return True
