"""Force elements of a scene."""

from typing import Annotated

from pydantic import Field

from gudgeon.solver.forces.bushing import Bushing
from gudgeon.solver.forces.external import ExternalForce
from gudgeon.solver.forces.fields.electrostatic import Adhesion, Electrostatic, ElectrostaticPressure, ParallelPlates
from gudgeon.solver.forces.gas import GasPressure
from gudgeon.solver.forces.given import GivenForce, GivenPressure, GivenTorque, GivenWrench
from gudgeon.solver.forces.moving import MovingForce
from gudgeon.solver.forces.spring import Spring

OverTime = GivenForce | GivenTorque | GivenPressure | GivenWrench
"""Those whose amount is a table or an expression of time."""
Force = Annotated[
    GasPressure
    | MovingForce
    | Spring
    | Bushing
    | ExternalForce
    | Electrostatic
    | ParallelPlates
    | Adhesion
    | ElectrostaticPressure
    | OverTime,
    Field(discriminator="kind"),
]
