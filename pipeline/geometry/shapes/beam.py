"""A straight beam along x or y on a line mesh, bending towards z, or in space."""

from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from gudgeon.modaldb.records.mesh import MeshRecord
from gudgeon.pipeline.geometry.cells import BEAM2, BEAM3, FRAME2
from gudgeon.pipeline.geometry.mesh_estimate import refuse_large
from gudgeon.pipeline.geometry.section import Section, shear_coefficient_of
from gudgeon.pipeline.geometry.surfaces import point_surface
from gudgeon.solver.numbers import Coordinate, Length, Name, Strict

ENDS = ("left", "right")
NEAREST = 1e-6
"""Least distance of different stations over the length: shorter elements amplify the round-off of the others."""
Theory = Annotated[
    Literal["euler-bernoulli", "timoshenko"],
    Field(
        description="timoshenko: shear and rotary inertia, as far as the section has a shear coefficient: one of kind"
        " 'general' may not; euler-bernoulli: neither, for slender beams"
    ),
]
SIDES = {"top": 1.0, "bottom": -1.0}
"""Outward normal along z of each side of the beam."""


class OfSection(Strict):
    """What beams and frames have of their section: a theory."""

    section: Section = Field(description="Cross-section")
    theory: Theory = "timoshenko"

    @field_validator("theory")
    @classmethod
    def _can_shear(cls, value: str, info: ValidationInfo) -> str:
        section = info.data.get("section")
        if value == "timoshenko" and section is not None and shear_coefficient_of(section) is None:
            raise ValueError("'timoshenko' given, it needs section.shear_coefficient with a section of kind 'general'")
        return value

    @property
    def sheared(self) -> bool:
        """Whether it has shear and rotary inertia."""
        return self.theory == "timoshenko" and shear_coefficient_of(self.section) is not None

    @property
    def shear_coefficient(self) -> float:
        """Shear coefficient κ, as given or of the section."""
        kappa = shear_coefficient_of(self.section)
        assert kappa is not None
        return kappa


class Beam(OfSection):
    """Beam of constant section from the origin (`left`) to `length` (`right`) along its axis."""

    kind: Literal["beam"]
    length: Length = Field(description="Length along the axis")
    along: Literal["x", "y"] = Field(default="x", description="Axis of the beam")
    motion: Literal["plane", "space"] = Field(
        default="plane",
        exclude_if=lambda value: value == "plane",
        description="plane: bending towards z alone; space: bending in both planes, stretch and torsion, for bodies of"
        " mechanisms",
    )
    stations: dict[Name, Coordinate] = Field(default={}, description="Named positions of nodes along the axis [m]")

    @field_validator("motion")
    @classmethod
    def _can_twist(cls, value: str, info: ValidationInfo) -> str:
        section = info.data.get("section")
        if value == "space" and section is not None:
            lacking = [key for key in ("lateral_moment", "torsion_constant") if getattr(section, key, None) is None]
            if lacking:
                raise ValueError(
                    f"'space' given, it needs {' and '.join(lacking)} of the section: use kind 'rectangle' or 'circle',"
                    " or give them with kind 'general'"
                )
        return value

    @field_validator("stations")
    @classmethod
    def _inside(cls, value: dict[str, float], info: ValidationInfo) -> dict[str, float]:
        length = info.data.get("length", np.inf)
        for name, x in value.items():
            if name in ENDS or name.endswith(tuple(f"-{side}" for side in SIDES)):
                raise ValueError(f"'{name}' given, left, right and names that end in -top or -bottom are reserved")
            if not 0 < x < length:
                raise ValueError(f"{name} = {x} given, a station is between 0 and the length {length} m, ends excluded")
        stops = np.array(sorted({0.0, *value.values(), length}))
        if np.isfinite(length) and np.diff(stops).min() < NEAREST * length:
            raise ValueError(f"stations {NEAREST:g} of the length apart from each other and from the ends are needed")
        return value

    @property
    def lateral_moment(self) -> float:
        """Second moment of area of a beam in space about the axis in the plane of bending [m^4]."""
        return self._in_space("lateral_moment")

    @property
    def torsion_constant(self) -> float:
        """Torsional stiffness of a beam in space over G [m^4]."""
        return self._in_space("torsion_constant")

    def _in_space(self, key: str) -> float:
        value = getattr(self.section, key, None)
        assert value is not None, key
        return float(value)

    def element_axes(self, mesh: MeshRecord) -> np.ndarray:
        """Return axis, lateral axis and z of each element as rows, right-handed, (e, 3, 3)."""
        z = np.array([0.0, 0.0, 1.0])
        return np.tile([self.axis, np.cross(z, self.axis), z], (len(mesh.cells), 1, 1))

    @property
    def axis(self) -> np.ndarray:
        """Unit vector from left to right, (3,)."""
        return np.eye(3)["xy".index(self.along)]

    def places(self) -> dict[str, float]:
        """Return the position of every end and station along the axis [m]."""
        return {"left": 0.0, **self.stations, "right": self.length}

    def build(self, size: float) -> MeshRecord:
        """Divide the beam into elements no longer than `size` [m], with nodes at the stations.

        Two-node elements in space (`frame2`) and for Euler-Bernoulli (`beam2`), three-node ones with shear (`beam3`).
        """
        refuse_large("line", self.length / size, size)
        quadratic = self.sheared and self.motion == "plane"
        stops = sorted({0.0, self.length, *self.stations.values()})
        corners = np.concatenate([[0.0], *(divided(a, b, size) for a, b in pairwise(stops))])
        x = np.insert(corners, np.arange(1, len(corners)), (corners[1:] + corners[:-1]) / 2) if quadratic else corners
        start = np.arange(len(corners) - 1)
        cells = np.column_stack([2 * start, 2 * start + 2, 2 * start + 1] if quadratic else [start, start + 1])
        nodes = x[:, None] * self.axis
        surfaces = {}
        area, up = self.section.area, np.array([0.0, 0.0, 1.0])
        for name, station in self.places().items():
            node, point = int(np.abs(x - station).argmin()), station * self.axis
            along = {"left": -self.axis, "right": self.axis}.get(name, up)
            surfaces[name] = point_surface(node, along, area, point)
            for side, sign in SIDES.items():
                fibre = point + sign * self.section.height / 2 * up
                surfaces[f"{name}-{side}"] = point_surface(node, sign * up, area, fibre)
        cell = BEAM3 if quadratic else FRAME2 if self.motion == "space" else BEAM2
        return MeshRecord(nodes, cells, cell.name, surfaces)


def divided(start: float, end: float, size: float) -> np.ndarray:
    """Return the ends of equal elements no longer than `size` [m] from `start` to `end`, without `start`."""
    count = max(1, int(np.ceil((end - start) / size * (1 - 1e-12))))
    return np.linspace(start, end, count + 1)[1:]
