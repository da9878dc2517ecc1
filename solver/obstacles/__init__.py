"""Rigid obstacles: each gives gap and gap direction at points. A new one is a file and a line here."""

from typing import Annotated

from pydantic import Field

from solver.obstacles.bore import Bore
from solver.obstacles.plane import Plane

OBSTACLES = {"bore": Bore, "plane": Plane}

Obstacle = Annotated[Bore | Plane, Field(discriminator="shape")]
