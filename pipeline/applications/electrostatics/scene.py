"""The scene file of conductors: their shapes, places, potentials or charges, the medium, panels and poses."""

from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from gudgeon.pipeline.scenes.component import Meshed
from gudgeon.solver.numbers import MOST, Angle, Charge, Coordinate, Name, Permittivity, Potential, Strict
from gudgeon.solver.scene.orientation import Orientation
from gudgeon.solver.vectors import Direction, Place, unit

WITHOUT_SURFACE = ("bar", "beam", "frame", "rigid")


class Conductor(Meshed):
    """A conductor: the boundary of a solid, or a sheet of named surfaces."""

    surfaces: tuple[str, ...] = Field(
        default=(), description="Surfaces of the geometry that alone are the conductor, as a thin sheet; default: all"
    )
    position: Place = Field(default=(0.0, 0.0, 0.0), description="Position of the geometry's origin [m]")
    orientation: Orientation | None = Field(
        default=None, description="Rotation about the geometry's origin, before `position`; default: none"
    )
    potential: Potential | None = Field(default=None, description="Given potential [V]")
    charge: Charge | None = Field(default=None, description="Given charge of a floating conductor [C]")

    @model_validator(mode="after")
    def _one_condition(self) -> "Conductor":
        if (self.potential is None) == (self.charge is None):
            got = "both" if self.charge is not None else "neither"
            raise ValueError(f"{got} given; one of potential [V] and, of a floating conductor, charge [C] is needed")
        if self.geometry.kind in WITHOUT_SURFACE:
            raise ValueError(f"geometry '{self.geometry.kind}' has no surface; a conductor is a solid or a plane part")
        return self


class PanelSettings(Strict):
    """How surfaces are cut into panels of uniform charge density."""

    strips: int = Field(
        default=4,
        ge=1,
        le=20,
        description="Coarse strips of a mesh triangle at an edge; there are twice as many panels",
    )
    exponent: float = Field(
        default=4.0,
        ge=1,
        le=8,
        json_schema_extra={"unit": "1"},
        description="Strips end at (k/strips)^exponent of the triangle's height",
    )
    corner_divisions: int = Field(default=3, ge=0, le=12, description="Divisions of triangles towards corners")
    curved_divisions: int = Field(default=1, ge=0, le=4, description="Divisions of a curved panel into flat facets")


class HalfSpaceSettings(Strict):
    """A plane beyond which there is a dielectric or a grounded conductor."""

    point: Place = Field(default=(0.0, 0.0, 0.0), description="A point of the plane [m]")
    normal: Direction = Field(default=(0.0, 0.0, 1.0), description="Towards the conductors, of any length")
    permittivity: Permittivity | Literal["conductor"] = Field(
        description="Relative permittivity beyond the plane, or 'conductor' for a grounded one"
    )

    def image_factor(self, medium: float) -> float:
        """Return image charge over charge for a medium of relative permittivity `medium` on the conductors' side."""
        if isinstance(self.permittivity, str):
            return -1.0
        return (medium - self.permittivity) / (medium + self.permittivity)

    @property
    def unit_normal(self) -> np.ndarray:
        """The normal at length 1, (3,)."""
        return unit(self.normal)


class Axis(Strict):
    """Values of a translation: ends and number, or a list."""

    ends: tuple[Coordinate, Coordinate] | None = Field(default=None, description="First and last value [m]")
    points: int | None = Field(default=None, ge=4, le=MOST, description="Number of equidistant values")
    values: tuple[Coordinate, ...] | None = Field(default=None, min_length=4, description="Values, ascending [m]")

    @model_validator(mode="after")
    def _one_form(self) -> "Axis":
        listed, regular = self.values is not None, self.ends is not None or self.points is not None
        if listed == regular or (regular and (self.ends is None or self.points is None)):
            raise ValueError("give ends and points, or values")
        steps = np.diff(self.array())
        if not (steps > 0).all():
            raise ValueError(f"{list(self.ends or self.values or ())} given; allowed: numbers that ascend")
        return self

    def array(self) -> np.ndarray:
        """Return the values [m or deg], (n,)."""
        return np.array(self.values) if self.ends is None else np.linspace(*self.ends, self.points or 0)


class Turn(Axis):
    """Values of a component of the rotation vector: ends and number, or a list."""

    ends: tuple[Angle, Angle] | None = Field(default=None, description="First and last value [deg]")
    values: tuple[Angle, ...] | None = Field(default=None, min_length=4, description="Values, ascending [deg]")


class Poses(Strict):
    """A grid of poses of conductors that move as one, from their positions in the scene."""

    moved: tuple[Name, ...] = Field(min_length=1, description="Conductors that move")
    pivot: Place | None = Field(
        default=None, description="Point about which they rotate [m]; default: the position of the first one"
    )
    x: Axis | None = Field(default=None, description="Translation along x [m]")
    y: Axis | None = Field(default=None, description="Translation along y [m]")
    z: Axis | None = Field(default=None, description="Translation along z [m]")
    rx: Turn | None = Field(default=None, description="x of the rotation vector [deg]")
    ry: Turn | None = Field(default=None, description="y of the rotation vector [deg]")
    rz: Turn | None = Field(default=None, description="z of the rotation vector [deg]")
    tolerance: float | None = Field(
        default=None,
        ge=1e-6,
        lt=1,
        json_schema_extra={"unit": "1"},
        description="Largest error of interpolation of a cell, relative to the largest |C|: knots are inserted into the"
        " axes until all cells have it, by an estimate; default: the axes as given",
    )
    hours: float = Field(
        default=24.0,
        gt=0,
        le=1e6,
        json_schema_extra={"unit": "h"},
        description="CPU time above which the grid is refused, by an estimate [h]",
    )

    @model_validator(mode="after")
    def _has_axes(self) -> "Poses":
        if not self.axes():
            raise ValueError("no axis given; at least one of x, y, z, rx, ry, rz is needed")
        return self

    def axes(self) -> dict[str, tuple[float, ...]]:
        """Return the values of each axis that is given [m, rad]."""
        axes = {name: getattr(self, name) for name in ("x", "y", "z", "rx", "ry", "rz")}
        return {
            name: tuple((axis.array() if name in "xyz" else np.radians(axis.array())).tolist())
            for name, axis in axes.items()
            if axis is not None
        }


class FieldReport(Strict):
    """Reference values."""

    reference: str | None = Field(default=None, description="JSON file with reference values, relative to the scene")
    quantities: dict[str, str] = Field(
        default={}, description="Quantity of the run → name under `expected` in the reference"
    )


class FieldFile(Strict):
    """A whole scene file of conductors."""

    conductor: dict[Name, Conductor] = Field(min_length=1, description="Conductors, by name")
    permittivity: Permittivity = Field(default=1.0, description="Relative permittivity around the conductors")
    half_space: HalfSpaceSettings | None = None
    panels: PanelSettings = PanelSettings.model_construct()
    poses: Poses | None = None
    report: FieldReport = FieldReport.model_construct()

    @model_validator(mode="after")
    def _moves_some(self) -> "FieldFile":
        moved = () if self.poses is None else self.poses.moved
        for name in moved:
            if name not in self.conductor:
                raise ValueError(f"poses.moved: no conductor '{name}'; the scene has {', '.join(self.conductor)}")
        if set(moved) == set(self.conductor) and self.half_space is None:
            raise ValueError("poses.moved: all conductors given; at least one must stay, or a half_space")
        return self
