"""The errors of restitutions: those of velocities, relative to the velocity after the impact.

An error δ of the velocity after an impact at the approach speed v changes the restitution ε by δ/v, which is δ/(ε v) of
it: at ε = 0.5 twice what it is of the approach speed.
"""

from dataclasses import replace

from gudgeon.modaldb.records.trajectory import CLOSING, Trajectory
from gudgeon.solver.checks.basis import fastest_body
from gudgeon.solver.system.system import System

REBOUND = ".rebound"


def with_restitution_errors(system: System, trajectory: Trajectory) -> Trajectory:
    """Return a run whose estimates have the error of its restitutions for each error of its rebound velocities.

    Args:
        trajectory: With errors of rebound velocities over the largest speed of a body at the start.
    """
    speed, separation_speeds = fastest_body(system), []
    for name, impacts in trajectory.impacts.items():
        value = trajectory.quantities.get(f"{name}.restitution")
        if value is not None and len(impacts):
            separation_speeds.append(abs(value["value"]) * float(abs(impacts[:, CLOSING]).max()))
    slowest = min(separation_speeds, default=0.0)
    if not slowest > 0:
        return trajectory
    errors = {
        name.removesuffix(REBOUND) + ".restitution": error * speed / slowest
        for name, error in trajectory.estimates.items()
        if name.endswith(REBOUND)
    }
    return replace(trajectory, estimates=trajectory.estimates | errors)
