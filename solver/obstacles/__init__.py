"""Rigid obstacles: each computes gap and gap direction at points."""

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field, TypeAdapter

from gudgeon.solver.obstacles.bore import Bore
from gudgeon.solver.obstacles.plane import Plane

Obstacle = Annotated[Bore | Plane, Field(discriminator="shape")]


def obstacle_of(against: Mapping[str, Any]) -> Obstacle:
    """Return the obstacle that a contact's `against` table describes."""
    return TypeAdapter(Obstacle).validate_python(against)


def basic_surface(chart: Mapping[str, Any], position: np.ndarray) -> Bore | Plane:
    """Return the undeformed surface of a traction space's chart on a body with its origin at `position` [m], (3,)."""
    # Computed numbers, which may have a component of round-off below the range of a scene's numbers.
    origin = tuple(np.asarray(chart["origin"], float) + position)
    if chart["kind"] == "plane":
        return Plane.model_construct(shape="plane", point=origin, normal=tuple(chart["normal"]))
    return Bore.model_construct(shape="bore", radius=chart["radius"], axis=tuple(chart["axis"]), origin=origin)
