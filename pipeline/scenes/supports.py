"""The `supports` of a component."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_validator

from gudgeon.solver.numbers import Strict


class Support(Strict):
    """A surface whose nodes are held."""

    surface: str = Field(description="Name of a surface of the mesh")
    hold: tuple[Literal["x", "y", "z", "rx", "ry", "rz"], ...] | None = Field(
        default=None, description="Directions and rotations that are held; default: all"
    )

    @field_validator("hold")
    @classmethod
    def _holds_something(cls, value: tuple[str, ...] | None) -> tuple[str, ...] | None:
        if value == ():
            raise ValueError("[] given; name at least one of x, y, z, rx, ry, rz, or remove the key to hold all")
        return value

    def as_inputs(self) -> str | dict[str, Any]:
        """Return its part of a record's key: the name alone if all directions are held."""
        return self.surface if self.hold is None else {"surface": self.surface, "hold": sorted(set(self.hold))}


def _as_table(value: Any) -> Any:
    if not isinstance(value, str | dict | Support):
        raise ValueError(f"{value!r} given; expected the name of a surface, or a table with surface and hold")
    return {"surface": value} if isinstance(value, str) else value


SupportEntry = Annotated[Support, BeforeValidator(_as_table, json_schema_input_type=str | Support)]
"""In a scene: the name of a surface, or a table."""
