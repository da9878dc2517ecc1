"""Which integrator runs a compiled scene: by what the scene has, then, where it leaves that open, by its size."""

from functools import cache

import numpy as np

from gudgeon.solver.capabilities import FEW_POINTS, INTEGRATORS
from gudgeon.solver.ports.stick import stick_frequency
from gudgeon.solver.system.fields.reading import evaluated, field_loads, start_pose, stiffness
from gudgeon.solver.system.system import System

RESOLVED = 40.0
"""ω_c over the frequency of an electrostatic field, so that a default step is a tenth of its inverse."""


def critical_frequency(system: System) -> float:
    """Return ω_c of a system with all contacts closed, and stuck where friction acts over flexibility [rad/s].

    Raises:
        SolverError: the contact's compliance is singular.
    """
    return max(system.critical_frequency(), stick_frequency(system), RESOLVED * field_frequency(system))


def field_frequency(system: System) -> float:
    """Return the largest frequency that the stiffness of an electrostatic field alone gives its bodies as the run
    starts [rad/s]; of an attraction, which is unstable, that at which it grows."""
    if not system.fields.names:
        return 0.0
    driving, (names, energies) = system.driving, system.fields
    fields = system.scene.fields() | system.scene.electrodes()
    load_rows = [
        (load.name, span.start + k) for load, span in driving.given_rows() for k in range(span.stop - span.start)
    ]
    loads, numbers = field_loads(names, [name for name, _ in load_rows]), np.array([row for _, row in load_rows], int)
    poses = np.array([start_pose(fields[name]) for name in names])
    evaluated(names, energies, poses)
    motion_rows, blocks = list[np.ndarray](), list[np.ndarray]()
    for i, pose in enumerate(poses):
        rows = np.zeros((6, driving.rows.shape[1]))
        for side, sign in ((0, 1.0), (1, -1.0)):
            acts = loads[i, side] >= 0
            rows[acts] += sign * driving.rows[numbers[loads[i, side, acts]]]
        motion_rows.append(rows)
        blocks.append(stiffness(energies, i, pose) @ rows)
    eigenvalues = np.linalg.eigvals(np.vstack(blocks).T @ np.vstack(motion_rows))
    return float(np.sqrt(np.abs(eigenvalues).max()))


def _over_flexibility(system: System) -> bool:
    """Return whether all contacts are over flexibility alone, without rigid points and laws."""
    return not system.rigid_contact.any() and all(c.law is None for c in system.scene.contact.values())


def choose(system: System) -> tuple[str, float]:
    """Return the integrator that runs a system, and ω_c that sets its step [rad/s]; 0 where it chooses its steps.

    Of those that `auto` can take, exact motion between located events is the better one while points are few: where a
    face of many points over flexibility closes at once, its events follow each other without end. Where undamped bodies
    have nothing but contact over a compliance, steps are faster than either.

    Raises:
        SolverError: the contact's compliance is singular.
    """
    scene, run, points = system.scene, system.scene.run, len(system.gap)
    name, critical = scene.integrator, cache(lambda: critical_frequency(system))
    if run.integrator == "auto":
        located = "event" in scene.carriers() and run.step is None and not scene.impulsive
        if name == "small" and points <= FEW_POINTS and located:
            name = "event"
        elif name == "event" and points > FEW_POINTS and _over_flexibility(system):
            name = "small"
    integrator = INTEGRATORS[name]
    if integrator.own_steps:
        return name, 0.0
    if (period := system.shortest_period) > 0:
        return name, min(critical(), integrator.stiffest * 2 * np.pi / period)
    return name, critical()
