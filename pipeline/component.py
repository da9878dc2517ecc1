"""A component: geometry, material, mesh, interfaces, modes and its change, as they stand in a scene."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from pipeline.geometry import Geometry
from pipeline.interface import Interface
from pipeline.material import Material
from pipeline.settings import ModesSettings

STRICT = ConfigDict(extra="forbid", frozen=True)


class MeshSettings(BaseModel):
    """How fine to mesh."""

    model_config = STRICT
    size: float | None = Field(
        default=None, gt=0, allow_inf_nan=False, description="Edge length [m]; unused for mesh files"
    )


class Profile(BaseModel):
    """Radial deviation of a cylindrical surface: a table over height and angle, an offset everywhere, or both."""

    model_config = STRICT
    table: str | None = Field(
        default=None,
        description="CSV file: angles [deg] in the first row, heights [m] in the first column, deviations [m]",
    )
    surface: str | None = Field(default=None, description="Surface that moves; that of the first interface by default")
    scale: float = Field(default=1.0, allow_inf_nan=False, description="Factor on the table's deviations")
    offset: float = Field(
        default=0.0, allow_inf_nan=False, description="Deviation everywhere, outwards, on top of the table's [m]"
    )


class Change(BaseModel):
    """A design change and how far the modes follow it."""

    model_config = STRICT
    rung: Literal["reuse", "recompute"] = Field(
        default="reuse", description="reuse: nodal positions move, modes stay; recompute: modes of the moved mesh"
    )
    profile: Profile = Profile()


class Component(BaseModel):
    """One part of a machine."""

    model_config = STRICT
    geometry: Geometry
    material: Material
    mesh: MeshSettings = MeshSettings()
    supports: tuple[str, ...] = Field(default=(), description="Surfaces whose nodes are held; none on a free body")
    interface: dict[str, Interface] = {}
    modes: ModesSettings = ModesSettings()
    change: Change = Change()
