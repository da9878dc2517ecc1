"""The `interface` tables of a component."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from gudgeon.pipeline.geometry.numbers import Direction, Point
from gudgeon.pipeline.scenes.modes import optional
from gudgeon.solver.numbers import Angle, Coordinate, Length, Strict

Span = tuple[Coordinate, Coordinate]
OWN_KEYS = {
    ("spacing", "along", "extent"): ("traction",), ("tie", "point"): ("tie",),
    ("sector_deg", "height"): ("points", "traction"),
}  # fmt: skip
"""Keys that apply to some kinds of interface only, with these kinds."""


def _pair(value: Any) -> Any:
    return (value, value) if isinstance(value, int | float) and not isinstance(value, bool) else value


class Interface(Strict):
    """A region of a component where contacts, joints or loads act."""

    surface: str = Field(description="Name of a surface of the mesh")
    kind: Literal["points", "traction", "mean", "pressure", "patch", "tie"] = Field(
        default="points",
        description="points: contact points; traction: smooth tractions for points of another body that slide over"
        " the surface; mean: the mean displacement of the surface, for joints and forces; pressure: a uniform pressure;"
        " patch: one contact row, the mean normal displacement of a flat surface; tie: the surface is coupled to a"
        " reference point, see tie",
    )
    sector_deg: tuple[Angle, Angle] | None = Field(
        default=None,
        description="Only the part between two angles [deg]; needed for a traction space on a cylinder",
    )
    height: Span | None = Field(default=None, description="Only the part between two heights along the axis [m]")
    spacing: (
        Annotated[tuple[Length, Length], BeforeValidator(_pair, json_schema_input_type=Length | tuple[Length, Length])]
        | None
    ) = Field(
        default=None,
        description="Largest knot spacing of a traction space across and along [m], or one number for both",
    )
    along: Direction | None = Field(
        default=None,
        description="Direction in which bodies slide over a traction space on a plane, or of the coordinate `along` of"
        " one on a patch: any smooth surface that is a height over a plane",
    )
    extent: tuple[Span, Span] | None = Field(
        default=None,
        description="Least and largest coordinate of a traction space on a plane or patch, across and along, from the"
        " plane's origin, or the mean position of the nodes of a patch [m]; default: the whole surface",
    )
    tie: Literal["rbe2", "rbe3"] | None = optional(
        "How the surface is coupled to the reference point. rbe2: it moves as a rigid body with the point;"
        " rbe3: the point has the mean motion of the surface, which stays flexible",
    )
    point: Point | None = optional("Reference point of a tie [m]; default: the centroid of the surface")

    @model_validator(mode="after")
    def _consistent(self) -> "Interface":
        spans = [("sector_deg", self.sector_deg), ("height", self.height)]
        spans += [("extent", span) for span in self.extent or ()]
        for name, span in spans:
            if span is not None and span[0] >= span[1]:
                raise ValueError(f"{name} is {list(span)}; the first value must be below the second")
        if self.kind == "traction" and self.spacing is None:
            raise ValueError("kind 'traction' needs spacing [m]")
        if self.kind == "tie" and self.tie is None:
            raise ValueError("kind 'tie' needs tie, 'rbe2' or 'rbe3'")
        for names, kinds in OWN_KEYS.items():
            set_keys = [name for name in names if getattr(self, name) is not None]
            if set_keys and self.kind not in kinds:
                raise ValueError(
                    f"{set_keys[0]} is for {' and '.join(map(repr, kinds))} only, the kind is '{self.kind}'"
                )
        return self
