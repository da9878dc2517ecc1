"""The family of integrators by their capabilities. A new one is a folder, a line here and a name in `Run`."""

from gudgeon.solver.integrators.capabilities import Integrator
from gudgeon.solver.integrators.collocation import Collocation
from gudgeon.solver.integrators.discrete_gradient import DiscreteGradient
from gudgeon.solver.integrators.event import Event
from gudgeon.solver.integrators.kick import Kick
from gudgeon.solver.integrators.trapezoid import Trapezoid

INTEGRATORS: dict[str, type[Integrator]] = {
    "kick": Kick,
    "trapezoid": Trapezoid,
    "event": Event,
    "collocation": Collocation,
    "discrete-gradient": DiscreteGradient,
}
"""Members by the name that a scene writes, in the order in which `auto` prefers them."""
