"""A force whose amount the caller sets between steps; zero in a run."""

from typing import Literal

from pydantic import Field

from gudgeon.solver.numbers import Strict
from gudgeon.solver.vectors import Direction, Place


class ExternalForce(Strict):
    """Force on a body that `gudgeon.Simulation` sets between steps; in a run it is zero."""

    kind: Literal["external"]
    body: str = Field(description="Name of a body of the scene")
    interface: str | None = Field(
        default=None, description="Interface of kind 'mean' or 'tie', needed on elastic bodies"
    )
    at: Place = Field(
        default=(0.0, 0.0, 0.0),
        description="Point of a rigid body relative to its component's origin [m]; not used with `interface`",
    )
    direction: Direction | None = Field(
        default=None, description="Direction of any length; default: three forces, along x, y and z"
    )
