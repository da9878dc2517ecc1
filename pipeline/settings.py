"""How a component is held, how it is reduced, and where stress is read of it."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationInfo, field_validator, model_validator

STRICT = ConfigDict(extra="forbid", frozen=True)
ALL_FOR_ZERO = ("craig-bampton", "interface", "partial-interface", "attachment")
"""Recipes for which a normal_count of 0 means all that they make."""


def is_absent(value: object) -> bool:
    """Return whether a key was left out: it then stays out of what identifies a record."""
    return value is None or value == ()


class ModesSettings(BaseModel):
    """How a component is reduced."""

    model_config = STRICT
    recipe: Literal[
        "macneal",
        "normal+static",
        "craig-bampton",
        "fixed-reference",
        "ritz",
        "rubin",
        "attachment",
        "interface",
        "partial-interface",
        "rigid",
    ] = Field(
        default="macneal",
        description="macneal: what the kept shapes lack stays as massless residual flexibility R; normal+static: it is"
        " dropped, contact then needs method 'penalty'; craig-bampton, fixed-reference, ritz: other kept shapes than"
        " normal modes of the free body, with R; rubin: normal modes and a shape of every contact row, with mass;"
        " attachment: the rows' static shapes alone; interface: craig-bampton with modes for the boundary's dofs;"
        " partial-interface: the same, some of the dofs kept; rigid: no elastic coordinates at all",
    )
    normal_count: int = Field(
        default=30,
        ge=0,
        description="Elastic normal modes or Ritz vectors; 0 is all that recipes 'craig-bampton', 'interface',"
        " 'partial-interface' and 'attachment' make; recipe 'rigid' has none",
    )
    static_count: int = Field(
        default=0,
        ge=0,
        description="Static correction shapes of each interface of kind 'points', 'traction' or 'patch'",
    )
    substructures: int = Field(
        default=1,
        ge=1,
        description="Parts of a body along its longest axis; for recipes 'craig-bampton', 'interface' and"
        " 'partial-interface'",
    )
    fixed_count: int = Field(
        default=10,
        ge=0,
        description="Fixed-interface modes of each substructure; for recipes 'craig-bampton', 'interface' and"
        " 'partial-interface'",
    )
    boundary: tuple[str, ...] = Field(
        default=(),
        exclude_if=is_absent,
        description="Surfaces whose dofs are boundary, beside those that interfaces and cuts touch; for recipes"
        " 'craig-bampton', 'interface' and 'partial-interface'",
    )
    kept: tuple[str, ...] = Field(
        default=(),
        exclude_if=is_absent,
        description="Surfaces and interfaces whose boundary dofs stay physical; for recipe 'partial-interface'",
    )
    interface_count: int | None = Field(
        default=None,
        exclude_if=is_absent,
        ge=0,
        description="Elastic interface modes for the boundary dofs that are not kept; all by default; for recipes"
        " 'interface' and 'partial-interface'",
    )
    reference: str | None = Field(
        default=None,
        validate_default=True,
        description="Surface that recipe 'fixed-reference' clamps; with any recipe, where the reaction is measured",
    )
    ritz_count: int | None = Field(
        default=None,
        validate_default=True,
        ge=1,
        description="Load-dependent vectors that recipe 'ritz' generates; twice normal_count by default",
    )

    @field_validator("normal_count")
    @classmethod
    def _at_least_one(cls, value: int, info: ValidationInfo) -> int:
        if value == 0 and (recipe := info.data.get("recipe", "macneal")) not in ALL_FOR_ZERO:
            names = ", ".join(f"'{name}'" for name in ALL_FOR_ZERO)
            raise ValueError(f"0 given, recipe '{recipe}' needs 1 or more; only {names} take 0, for all")
        return value

    @field_validator("reference")
    @classmethod
    def _is_named(cls, value: str | None, info: ValidationInfo) -> str | None:
        if value is None and info.data.get("recipe") == "fixed-reference":
            raise ValueError("is missing; recipe 'fixed-reference' needs the name of a surface")
        return value

    @field_validator("ritz_count")
    @classmethod
    def _enough(cls, value: int | None, info: ValidationInfo) -> int | None:
        least = info.data.get("normal_count", 1)
        if value is not None and value < least:
            raise ValueError(f"{value} given, at least normal_count = {least} vectors are needed")
        return value


class Support(BaseModel):
    """A surface whose nodes are held."""

    model_config = STRICT
    surface: str = Field(description="Name of a surface of the mesh")
    hold: tuple[Literal["x", "y", "z", "rx", "ry", "rz"], ...] | None = Field(
        default=None, description="Directions and turns that are held; all that there are by default"
    )

    @field_validator("hold")
    @classmethod
    def _holds_something(cls, value: tuple[str, ...] | None) -> tuple[str, ...] | None:
        if value == ():
            raise ValueError("[] given, name at least one of x, y, z, rx, ry, rz, or leave the key out to hold all")
        return value

    def as_inputs(self) -> str | dict[str, Any]:
        """Return what identifies it in a key: the plain name where all is held."""
        return self.surface if self.hold is None else {"surface": self.surface, "hold": sorted(set(self.hold))}


def _as_table(value: Any) -> Any:
    if not isinstance(value, str | dict | Support):
        raise ValueError(f"{value!r} given, a support is the name of a surface or a table of surface and hold")
    return {"surface": value} if isinstance(value, str) else value


SupportEntry = Annotated[Support, BeforeValidator(_as_table)]
"""As a scene writes it: a surface's name, or a table."""


class Gauge(BaseModel):
    """Where stress or strain is read: at a fibre of a beam, at a point, or all over a surface."""

    model_config = STRICT
    station: str | None = Field(
        default=None,
        exclude_if=is_absent,
        description="Name of a station of the beam, or one of its ends left and right: its bending stress, positive in"
        " tension, is read",
    )
    fibre: Literal["top", "bottom"] | None = Field(
        default=None, exclude_if=is_absent, description="Outermost fibre of the beam at the station"
    )
    point: tuple[float, float, float] | None = Field(
        default=None, exclude_if=is_absent, description="Place of a solid or plane part [m]: six components are read"
    )
    surface: str | None = Field(
        default=None,
        exclude_if=is_absent,
        description="Surface of a solid or plane part, or 'skin', all of its boundary: six components at each node; for"
        " pictures, a body does not name it in gauges",
    )
    quantity: Literal["stress", "strain"] | None = Field(
        default=None, exclude_if=is_absent, description="What is read at a point or on a surface; stress by default"
    )

    @model_validator(mode="after")
    def _is_one_of_them(self) -> "Gauge":
        given = [name for name in ("station", "point", "surface") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"{' and '.join(given) or 'none'} given, one of station, point and surface is needed")
        if (self.fibre is None) == (self.station is not None):
            raise ValueError("fibre, 'top' or 'bottom', is for a station, and a station needs it")
        if self.quantity is not None and self.station is not None:
            raise ValueError("quantity is for a point or a surface; at a station of a beam it is stress")
        if self.point is not None and not all(abs(x) < float("inf") for x in self.point):
            raise ValueError(f"point {list(self.point)} given, three finite coordinates are needed")
        return self

    @property
    def unit(self) -> str:
        """Of the reading."""
        return "1" if self.quantity == "strain" else "Pa"
