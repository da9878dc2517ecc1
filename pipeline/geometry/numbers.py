"""Numbers and vectors of a scene file with their limits and, where it is always the same, their SI unit."""

from typing import Annotated

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field

STRICT = ConfigDict(extra="forbid", frozen=True)
Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Length = Annotated[float, Field(gt=0, allow_inf_nan=False, json_schema_extra={"unit": "m"})]
Coordinate = Annotated[float, Field(allow_inf_nan=False, json_schema_extra={"unit": "m"})]
Dimensionless = Annotated[float, Field(allow_inf_nan=False, json_schema_extra={"unit": "1"})]
Point = tuple[Coordinate, Coordinate, Coordinate]
Direction = tuple[Dimensionless, Dimensionless, Dimensionless]
"""Of any length, zero included."""


class Strict(BaseModel):
    """A table of a scene file; unknown keys are refused."""

    model_config = STRICT


def _refuse_zero(vector: Direction) -> Direction:
    if not np.linalg.norm(vector) > 0:
        raise ValueError(f"{list(vector)} given, a length above zero is needed")
    return vector


def _normalised(vector: Direction) -> Direction:
    length = float(np.linalg.norm(vector))
    return vector[0] / length, vector[1] / length, vector[2] / length


NonZero = Annotated[Direction, AfterValidator(_refuse_zero)]
"""Of any length above zero."""
UnitVector = Annotated[NonZero, AfterValidator(_normalised)]
"""Scaled to length 1."""
