"""Types of vectors in a scene file: finite components; a direction is not zero."""

from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field

Finite = Annotated[float, Field(allow_inf_nan=False)]
Vector = tuple[Finite, Finite, Finite]
Coordinate = Annotated[float, Field(allow_inf_nan=False, json_schema_extra={"unit": "m"})]
Place = tuple[Coordinate, Coordinate, Coordinate]
"""Position [m]."""
Velocity = Annotated[Vector, Field(json_schema_extra={"unit": "m/s"})]


def _directed(vector: Vector) -> Vector:
    if not any(vector):
        raise ValueError("the vector is zero, it must have a direction")
    return vector


Direction = Annotated[Vector, AfterValidator(_directed), Field(json_schema_extra={"unit": "1"})]
"""Direction of any length."""


def unit(vector: tuple[float, ...] | np.ndarray) -> np.ndarray:
    """Return a vector at length 1, (3,)."""
    array = np.asarray(vector, float)
    return array / np.linalg.norm(array)


def length_across(vectors: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return the length of vectors (…, 3) across a unit vector, (…)."""
    return np.linalg.norm(vectors - (vectors @ along)[..., None] * along, axis=-1)
