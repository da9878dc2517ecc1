"""Force elements. A new one is a file and a line here."""

from typing import Annotated

from pydantic import Field

from solver.forces.gas import GasPressure
from solver.forces.moving import MovingForce
from solver.forces.spring import Spring

FORCES = {"gas": GasPressure, "moving": MovingForce, "spring": Spring}

Force = Annotated[GasPressure | MovingForce | Spring, Field(discriminator="kind")]
