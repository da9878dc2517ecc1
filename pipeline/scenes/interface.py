"""The `interface` tables of a component."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, Field, model_validator

from gudgeon.pipeline.geometry.numbers import STRICT, Coordinate, Direction, Finite, Length, Point
from gudgeon.pipeline.scenes.modes import is_absent

Span = tuple[Coordinate, Coordinate]


def _pair(value: Any) -> Any:
    return (value, value) if isinstance(value, int | float) and not isinstance(value, bool) else value


class Interface(BaseModel):
    """Where a component may be touched or loaded."""

    model_config = STRICT
    surface: str = Field(description="Name of a surface of the mesh")
    kind: Literal["points", "traction", "mean", "pressure", "patch", "tie"] = Field(
        default="points",
        description="points: contact points; traction: smooth tractions for points of another body that slide over"
        " the surface; mean: the mean displacement of the surface, for joints and forces; pressure: a uniform pressure;"
        " patch: one contact row, the mean normal displacement of a flat surface; tie: the surface hangs on a reference"
        " point, see tie",
    )
    sector_deg: tuple[Finite, Finite] | None = Field(
        default=None,
        description="Only what lies between two angles [deg]; a traction space on a cylinder needs it",
        json_schema_extra={"unit": "deg"},
    )
    height: Span | None = Field(default=None, description="Only what lies between two heights along the axis [m]")
    spacing: Annotated[tuple[Length, Length], BeforeValidator(_pair)] | None = Field(
        default=None,
        description="Largest knot spacing of a traction space across and along [m], or one number for both",
    )
    along: Direction | None = Field(
        default=None, description="Direction in which bodies slide over a traction space on a plane"
    )
    extent: tuple[Span, Span] | None = Field(
        default=None,
        description="Least and largest coordinate of a traction space on a plane, across and along, from the plane's"
        " origin [m]; all of the surface by default",
    )
    tie: Literal["rbe2", "rbe3"] | None = Field(
        default=None,
        exclude_if=is_absent,
        description="How a surface hangs on its reference point. rbe2: it moves as a rigid body with the point; rbe3:"
        " the point moves as the surface does on the mean, which stays as flexible as it is",
    )
    point: Point | None = Field(
        default=None,
        exclude_if=is_absent,
        description="Reference point of a tie [m]; the surface's centroid by default",
    )

    @model_validator(mode="after")
    def _consistent(self) -> "Interface":
        spans = [("sector_deg", self.sector_deg), ("height", self.height)]
        spans += [("extent", span) for span in self.extent or ()]
        for name, span in spans:
            if span is not None and span[0] >= span[1]:
                raise ValueError(f"{name} is {list(span)}, the first value must be below the second")
        if self.kind == "traction" and self.spacing is None:
            raise ValueError("kind 'traction' needs spacing [m]")
        for name in ("spacing", "along", "extent"):
            if self.kind != "traction" and getattr(self, name) is not None:
                raise ValueError(f"{name} is for kind 'traction', the kind is '{self.kind}'")
        if self.kind == "tie" and self.tie is None:
            raise ValueError("kind 'tie' needs tie, 'rbe2' or 'rbe3'")
        for name in ("tie", "point"):
            if self.kind != "tie" and getattr(self, name) is not None:
                raise ValueError(f"{name} is for kind 'tie', the kind is '{self.kind}'")
        for name in ("sector_deg", "height"):
            if self.kind in ("mean", "pressure", "patch", "tie") and getattr(self, name) is not None:
                raise ValueError(f"{name} is for kinds 'points' and 'traction', '{self.kind}' takes the whole surface")
        return self
