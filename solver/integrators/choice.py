"""Which integrator runs a compiled scene: by what the scene has, then, where it leaves that open, by its size."""

from functools import cache

import numpy as np

from gudgeon.solver.capabilities import INTEGRATORS
from gudgeon.solver.ports.stick import stick_frequency
from gudgeon.solver.system.system import System

FEW_POINTS = 8
"""Contact points up to which `auto` takes located events where it can."""
MANY = 5e7
"""Steps times contact points from which `auto` takes implicit contact, whose step stiff surfaces do not shorten."""


def critical_frequency(system: System) -> float:
    """Return ω_c of a system with all contacts closed, and stuck where friction acts over flexibility [rad/s].

    Raises:
        SolverError: the contact's compliance is singular.
    """
    return max(system.critical_frequency(), stick_frequency(system))


def choose(system: System) -> tuple[str, float]:
    """Return the integrator that runs a system, and ω_c that sets its step [rad/s]; 0 where it chooses its steps.

    Of those that `auto` can take, exact motion between located events is the better one while points are few, and
    explicit contact gives way to implicit contact where stiff surfaces ask for too many steps.

    Raises:
        SolverError: the contact's compliance is singular.
    """
    scene, run, points = system.scene, system.scene.run, len(system.gap)
    name, critical = scene.integrator, cache(lambda: critical_frequency(system))
    if run.integrator == "auto":
        if name == "implicit" and points <= FEW_POINTS and "event" in scene.carriers() and run.step is None:
            name = "event"
        elif name == "explicit" and "implicit" in scene.carriers():
            steps = run.duration * critical() / INTEGRATORS[name].step_factor
            name = "implicit" if steps * max(1, points) > MANY else name
    integrator = INTEGRATORS[name]
    if integrator.own_steps:
        return name, 0.0
    if (period := system.shortest_period) > 0:
        return name, min(critical(), integrator.stiffest * 2 * np.pi / period)
    return name, critical()
