"""Numbers of a scene file with their limits and, where all that use one agree, their SI unit."""

from typing import Annotated

from pydantic import ConfigDict, Field

STRICT = ConfigDict(extra="forbid", frozen=True)
Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Length = Annotated[float, Field(gt=0, allow_inf_nan=False, json_schema_extra={"unit": "m"})]
Coordinate = Annotated[float, Field(allow_inf_nan=False, json_schema_extra={"unit": "m"})]
Dimensionless = Annotated[float, Field(allow_inf_nan=False, json_schema_extra={"unit": "1"})]
Point = tuple[Coordinate, Coordinate, Coordinate]
Direction = tuple[Dimensionless, Dimensionless, Dimensionless]
"""Of any length; whether it may be zero is checked where it is used."""
