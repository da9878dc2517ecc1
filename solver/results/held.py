"""What joints of small motion add to the record of a run: their forces and moments, and coordinates of the records."""

from collections.abc import Mapping

import numpy as np

from gudgeon.modaldb.records.trajectory import JointHistory
from gudgeon.modaldb.records.types import Json
from gudgeon.solver.bodies.holding import HELD
from gudgeon.solver.joints.reactions import wrench_peaks
from gudgeon.solver.system.system import System

Readings = Mapping[str, np.ndarray]


def parted(readings: Readings) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return the values of the scene's own gauges, and force and moment of each joint that holds a body [N, N m],
    (s, 6), of those of all gauges."""
    own = {name: name.partition(".")[2] for name in readings}
    joints = {one.removeprefix(HELD): readings[name] for name, one in own.items() if one.startswith(HELD)}
    return {name: readings[name] for name, one in own.items() if not one.startswith(HELD)}, joints


def held_histories(system: System, wrenches: Readings) -> dict[str, JointHistory]:
    """Return the histories of joints that hold bodies, which do not move."""
    return {
        name: JointHistory(system.scene.hinges()[name].body, "", np.zeros(len(one)), one[:, :3].copy(),
                           np.zeros(len(one)))
        for name, one in wrenches.items()
    }  # fmt: skip


def held_quantities(times: np.ndarray, wrenches: Readings) -> Json:
    """Return the largest forces and moments of joints that hold bodies, and their times of the samples [s], (s,)."""
    found: Json = {}
    for name, one in wrenches.items() if len(times) else ():
        found |= wrench_peaks(name, times, one)
    return found


def recorded(system: System, states: np.ndarray) -> np.ndarray:
    """Return states, (f, m), over the coordinates of the bodies' records, (f, n)."""
    parts = [np.empty((len(states), 0))]
    for body in system.bodies.values():
        own = states[:, body.coordinates]
        parts.append(own if body.basis is None else own @ body.basis.T)
    return np.hstack(parts)


def recorded_offsets(system: System) -> dict[str, int]:
    """Return the first coordinate of each body over the coordinates of the records."""
    found, first = {}, 0
    for name, body in system.bodies.items():
        found[name] = first
        first += body.record_count
    return found
