"""The `component` tables of a scene: geometry, material, mesh, supports, interfaces, gauges, modes and change."""

import math
from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from gudgeon.pipeline.geometry import Geometry
from gudgeon.pipeline.geometry.cad.part import SKIN, Places
from gudgeon.pipeline.geometry.matrices.part import FILES, Matrices
from gudgeon.pipeline.geometry.mesh_estimate import NODES
from gudgeon.pipeline.geometry.numbers import Point
from gudgeon.pipeline.geometry.shapes.bar import Bar
from gudgeon.pipeline.scenes.gauge import Gauge
from gudgeon.pipeline.scenes.interface import Interface
from gudgeon.pipeline.scenes.material import Material
from gudgeon.pipeline.scenes.modes import ModesSettings, optional
from gudgeon.pipeline.scenes.supports import SupportEntry
from gudgeon.solver.numbers import Coordinate, Length, Mass, Moments, Name, PositiveRatio, Ratio, Strict

BAR_COUNT = 180
"""Default number of normal modes of a bar: with 160, the windowed force of a rigid striker of a tenth of its mass has
an error of 1 %."""
BAR_ELEMENTS = 600
"""Default number of elements of a bar. With 250, waves that are too fast change that striker's impulse by 0.8 %."""
RESOLVED = 0.6
"""Modes per quadratic element of a bar whose frequencies have a discretisation error below 1 %."""
MESH_FILES, STATING_UNITS = ("file", "plane-file"), (".unv", ".uff")
"""Geometries of files of meshes, and ends of names of those that state their unit of length."""
LINES = ("beam", "frame")
"""Geometries whose gauges are at stations."""
MOST_DESIGNS = 5
"""Stored designs of which others are computed. With more of them projecting is as dear as new modes."""
MOST_GROWTH = 0.1
"""Largest growth of a part by heat: metals melt at a few hundredths."""
EXTRA_MODES = 1.25
"""Modes of a stored design over those of a design: modes change places within ten per cent of a wall."""
NORMAL_MODES = ("macneal", "normal+static", "fixed-reference", "rubin")
"""Reductions to normal modes."""


class MeshSettings(Strict):
    """Element size."""

    size: Length | None = Field(
        default=None,
        description="Edge length of the elements [m] (default of bars: a 600th of the length; of CAD parts: by nodes);"
        " not used for mesh files and rigid bodies",
    )
    nodes: int = Field(
        default=NODES, ge=1000, le=100_000_000,
        description="Nodes of the mesh of a CAD part at most, from which its size follows where it is left out",
    )  # fmt: skip


class Profile(Strict):
    """Radial deviation of a cylindrical surface: a table over height and angle, an offset everywhere, or both."""

    table: str | None = Field(
        default=None,
        description="CSV file: angles [deg] in the first row, heights [m] in the first column, deviations [m]",
    )
    surface: str | None = Field(
        default=None, description="Surface that moves; default: the surface of the first interface"
    )
    scale: Ratio = Field(default=1.0, description="Factor on the table's deviations")
    offset: Coordinate = Field(default=0.0, description="Uniform outward deviation, added to that of the table [m]")


class Change(Strict):
    """A design change, and whether the modes are computed again."""

    update: Literal["reuse", "certified", "recompute"] = Field(
        default="reuse",
        description="reuse: nodes move, modes are kept; certified: modes of the moved mesh from those of `designs`, by"
        " the cheapest way whose estimated errors are within the tolerance; recompute: modes of the moved mesh",
    )
    tolerance: PositiveRatio = Field(
        default=0.02,
        description="Of reuse, the estimated relative change of frequencies or contact compliance above which it is"
        " refused; of certified modes, their largest estimated relative error of frequencies and compliances",
    )
    profile: Profile = Field(default=Profile.model_construct(), description="By how much a surface moves")
    growth: Ratio = Field(
        default=0.0,
        description="Uniform growth of all lengths about the part's origin, by heat α ΔT, after the profile; heights"
        " and points that the scene gives are those of the grown part",
    )
    designs: tuple[Profile, ...] = Field(
        default=(),
        max_length=MOST_DESIGNS,
        description="Profiles of stored designs that certified modes are computed from; {} is the part as it is meshed,"
        " which is the default",
    )

    @property
    def stored(self) -> tuple[Profile, ...]:
        """Profiles of the stored designs; each moves the surface that the change itself moves by default."""
        surface = self.profile.surface
        profiles = self.designs or (Profile(),)
        return tuple(p if p.surface is not None else p.model_copy(update={"surface": surface}) for p in profiles)


class PointMass(Strict):
    """A mass that is not meshed, on a surface: its place moves with the mean motion of the surface."""

    surface: str = Field(description="Name of a surface of the mesh")
    mass: Mass = Field(description="Mass")
    at: Point | None = Field(default=None, description="Its centre of mass [m]; default: the centroid of the surface")
    inertia: Moments | None = Field(
        default=None, description="Moments of inertia about its centre along x, y, z [kg m^2]; default: zero"
    )


class Meshed(Strict):
    """A part with a mesh."""

    geometry: Geometry = Field(description="Shape, or file of the shape, by `kind`")
    mesh: MeshSettings = Field(default=MeshSettings.model_construct(), validate_default=True)

    @field_validator("geometry")
    @classmethod
    def _has_a_unit(cls, value: Geometry) -> Geometry:
        path = getattr(value, "path", "")
        stated = path.lower().endswith(STATING_UNITS)
        if value.kind in MESH_FILES and "unit" not in value.model_fields_set and not stated:
            raise ValueError(
                f"unit is missing; '{path}' states no unit of length: give the metres per unit, 0.001 for mm or"
                " 1.0 for m"
            )
        return value

    @field_validator("mesh")
    @classmethod
    def _sized(cls, value: MeshSettings, info: ValidationInfo) -> MeshSettings:
        if value.size is None and isinstance(bar := info.data.get("geometry"), Bar):
            return value.model_copy(update={"size": bar.length / BAR_ELEMENTS})
        return value

    @property
    def path(self) -> str | None:
        """Name of the geometry's file, of a mesh or of CAD; None for shapes."""
        return getattr(self.geometry, "path", None)

    @property
    def files(self) -> dict[str, str]:
        """Names of all files of the geometry, by the key that gives each."""
        keys = FILES if isinstance(self.geometry, Matrices) else ("path",)
        return {key: name for key in keys if (name := getattr(self.geometry, key, None)) is not None}

    @property
    def places(self) -> Places | None:
        """Where something acts on the part; None where that is not known, so that it is everywhere."""
        return None


class Component(Meshed):
    """One part of a machine."""

    material: Material | None = Field(
        default=None, validate_default=True, description="Needed, except for rigid bodies and matrices"
    )
    supports: tuple[SupportEntry, ...] = Field(
        default=(),
        description="Surfaces whose nodes are held: names (all directions) or tables; none for a free body",
    )
    interface: dict[Name, Interface] = Field(
        default={}, description="Places where contacts, joints or loads act, by name"
    )
    gauge: dict[Name, Gauge] = Field(
        default={}, validate_default=True, description="Places where stress or strain is recorded"
    )
    point_mass: dict[Name, PointMass] = optional("Masses on surfaces that are not meshed", default={})
    modes: ModesSettings = Field(
        default=ModesSettings.model_construct(),
        validate_default=True,
        description="Reduction of the part to few coordinates",
    )
    change: Change = Change.model_construct()

    @property
    def places(self) -> Places:
        """Where something acts on the part."""
        surfaces = [item.surface for items in (self.interface, self.gauge, self.point_mass) for item in items.values()]
        surfaces += [support.surface for support in self.supports]
        points = [gauge.point for gauge in self.gauge.values() if gauge.point is not None]
        named = {surface for surface in surfaces if surface is not None} - {SKIN}
        return Places(tuple(sorted(named)), tuple(sorted(set(points))))

    @property
    def from_file(self) -> bool:
        """Whether the mesh is read from a file."""
        return self.geometry.kind in ("file", "plane-file", "matrices")

    @field_validator("material")
    @classmethod
    def _deforms(cls, value: Material | None, info: ValidationInfo) -> Material | None:
        kind = _kind(info)
        if value is None and kind not in ("rigid", "matrices", None):
            also = ", or geometry.materials = true for those of a deck" if kind == "file" else ""
            raise ValueError(f"is missing; geometry '{kind}' needs E, nu and rho{also}")
        if value is not None and kind == "rigid":
            raise ValueError("given, but geometry 'rigid' states its own mass; remove the key")
        return value

    @field_validator("gauge")
    @classmethod
    def _fits_the_geometry(cls, value: dict[str, Gauge], info: ValidationInfo) -> dict[str, Gauge]:
        kind = _kind(info)
        if value and kind in ("bar", "rigid"):
            raise ValueError(f"{', '.join(value)} given; gauges need a beam, solid or plane part, not '{kind}'")
        if value and kind == "matrices" and info.data.get("material") is None:
            raise ValueError(f"{', '.join(value)} given; the stress of a body of matrices needs its material")
        for name, gauge in value.items():
            if kind is not None and (kind in LINES) != (gauge.station is not None):
                needed = "a station" if kind in LINES else "a point or a surface"
                raise ValueError(f"{name}: geometry '{kind}' needs {needed}")
            if kind in LINES and gauge.station not in (stations := info.data["geometry"].places()):
                have = ", ".join(stations) or "none"
                raise ValueError(f"{name}: station '{gauge.station}' given, the {kind} has {have}")
        return value

    @field_validator("change")
    @classmethod
    def _can_move(cls, value: Change, info: ValidationInfo) -> Change:
        moves = value.profile.table is not None or value.profile.offset != 0
        if _kind(info) == "matrices" and moves:
            raise ValueError("profile given; the matrices of another program do not follow a moved surface")
        if value.designs and value.update != "certified":
            raise ValueError(f"designs given; allowed with update 'certified', not '{value.update}'")
        modes = info.data.get("modes")
        if value.update == "certified" and modes is not None and (modes.reduction != "macneal" or modes.swap):
            raise ValueError(
                "update 'certified' given; allowed with modes.reduction = 'macneal' without modes.swap; use 'recompute'"
            )
        if (moves or value.growth) and value.update == "reuse" and info.data.get("point_mass"):
            raise ValueError("update 'reuse' given; with point masses a moved surface needs update 'recompute'")
        return value

    @field_validator("change")
    @classmethod
    def _can_grow(cls, value: Change, info: ValidationInfo) -> Change:
        if abs(value.growth) > MOST_GROWTH:
            raise ValueError(f"growth {value.growth:g} given; allowed: {-MOST_GROWTH:g} to {MOST_GROWTH:g}")
        if value.growth and _kind(info) in ("matrices", "rigid"):
            raise ValueError(f"growth given; allowed for solids, not for geometry '{_kind(info)}'")
        tractions = [key for key, item in info.data.get("interface", {}).items() if item.kind == "traction"]
        if value.growth and value.update == "reuse" and tractions:
            raise ValueError(
                f"growth given with update 'reuse'; the traction space of interface {tractions[0]} needs update"
                " 'certified' or 'recompute'"
            )
        return value

    @property
    def stored_designs(self) -> tuple["Component", ...]:
        """The designs that certified modes are computed from; empty for any other update."""
        change = self.change
        if change.update != "certified":
            return ()
        modes = self.modes.model_copy(update={"normal_count": math.ceil(EXTRA_MODES * self.modes.normal_count)})
        changes = (Change(update="recompute", profile=profile) for profile in change.stored)
        return tuple(self.model_copy(update={"change": design, "modes": modes}) for design in changes)

    @field_validator("modes")
    @classmethod
    def _fits_the_kind(cls, value: ModesSettings, info: ValidationInfo) -> ModesSettings:
        if info.data.get("gauge") and value.reduction == "rigid":
            raise ValueError("reduction 'rigid' given; a gauge needs a reduction with elastic coordinates")
        if isinstance(bar := info.data.get("geometry"), Bar):
            return _counted(value, bar, info.data.get("mesh", MeshSettings()).size)
        if _kind(info) != "rigid" or value.reduction == "rigid":
            return value
        if "reduction" in value.model_fields_set:
            raise ValueError(f"reduction '{value.reduction}' given; geometry 'rigid' allows 'rigid' only")
        return value.model_copy(update={"reduction": "rigid"})


def _counted(modes: ModesSettings, bar: Bar, size: float | None) -> ModesSettings:
    """Return the settings with the default number of modes of a bar on elements of a size [m]."""
    if "normal_count" in modes.model_fields_set or modes.reduction not in NORMAL_MODES or size is None:
        return modes
    resolved = int(RESOLVED * bar.elements(size))
    return modes.model_copy(update={"normal_count": max(modes.normal_count, min(BAR_COUNT, resolved))})


def _kind(info: ValidationInfo) -> str | None:
    """Return the kind of geometry; None if the geometry itself is wrong."""
    geometry = info.data.get("geometry")
    return None if geometry is None else geometry.kind
