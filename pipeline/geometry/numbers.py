"""Points and directions of a scene file, and kinds of its CAD files; numbers are in `solver.numbers`."""

from typing import Annotated

import numpy as np
from pydantic import AfterValidator

from gudgeon.solver.vectors import Place as Point
from gudgeon.solver.vectors import Vector as Direction

__all__ = ["CAD_KINDS", "Direction", "NonZero", "Point", "UnitVector"]

STEP, IGES, BREP, SCRIPT = (".step", ".stp", ".p21"), (".iges", ".igs"), (".brep", ".brp"), (".geo", ".geo_unrolled")
CAD_KINDS = {**dict.fromkeys(STEP, "STEP"), **dict.fromkeys(IGES, "IGES"), **dict.fromkeys(BREP, "BREP"),
             **dict.fromkeys(SCRIPT, "gmsh script")}  # fmt: skip
"""What a CAD file is by the end of its name."""


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
