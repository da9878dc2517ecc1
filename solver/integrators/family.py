"""The family of integrators. A new one is a class and a line here.

Each is made of a system and a step, or sample interval, and has

    advance(first, stride, out) -> bool     fills samples; False where it failed
    outcome() -> Outcome                    where the run stands
    failure                                 the reason for False
    order                                   of its error in the step, inf if exact
"""

from importlib import import_module
from typing import Protocol

from gudgeon.solver.integrators.outcome import Outcome, Samples
from gudgeon.solver.result import Result
from gudgeon.solver.system.system import System


class Marching(Protocol):
    """What an integrator can do."""

    failure: Result
    order: float

    def advance(self, first: int, stride: int, out: Samples) -> bool:
        """Fill samples; False where it failed."""
        ...

    def outcome(self) -> Outcome:
        """Return where the run stands."""
        ...


INTEGRATORS = {
    "kick": "gudgeon.solver.integrators.kick.integrator:Kick",
    "trapezoid": "gudgeon.solver.integrators.trapezoid.integrator:Trapezoid",
    "event": "gudgeon.solver.integrators.event.integrator:Event",
    "collocation": "gudgeon.solver.integrators.collocation.integrator:Collocation",
    "discrete-gradient": "gudgeon.solver.integrators.discrete_gradient.integrator:DiscreteGradient",
}
"""Where each stands; imported when it runs, so that exact motion does not wait for a compiler."""


def make(name: str, system: System, dt: float) -> Marching:
    """Return an integrator at the start of a run."""
    module, _, member = INTEGRATORS[name].partition(":")
    return getattr(import_module(module), member)(system, dt)
