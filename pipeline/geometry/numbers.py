"""Numbers and vectors of a scene file with their limits and, where it is always the same, their SI unit."""

from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field

from gudgeon.solver.numbers import Length, Positive, Strict
from gudgeon.solver.vectors import Coordinate, Finite
from gudgeon.solver.vectors import Place as Point

__all__ = ["Coordinate", "Direction", "Finite", "Length", "NonZero", "Point", "Positive", "Strict", "UnitVector"]
Dimensionless = Annotated[float, Field(allow_inf_nan=False, json_schema_extra={"unit": "1"})]
Direction = tuple[Dimensionless, Dimensionless, Dimensionless]
"""Of any length, zero included."""


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
