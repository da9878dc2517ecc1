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
    labels = {name: name.partition(".")[2] for name in readings}
    joints = {label.removeprefix(HELD): readings[name] for name, label in labels.items() if label.startswith(HELD)}
    return {name: readings[name] for name, label in labels.items() if not label.startswith(HELD)}, joints


def held_histories(system: System, wrenches: Readings) -> dict[str, JointHistory]:
    """Return the histories of joints that hold bodies, which do not move."""
    return {
        name: JointHistory(system.scene.hinges()[name].body, "", np.zeros(len(wrench)), wrench[:, :3].copy(),
                           np.zeros(len(wrench)))
        for name, wrench in wrenches.items()
    }  # fmt: skip


def held_quantities(times: np.ndarray, wrenches: Readings) -> Json:
    """Return the largest forces and moments of joints that hold bodies, and their times of the samples [s], (s,)."""
    json: Json = {}
    for name, wrench in wrenches.items() if len(times) else ():
        json |= wrench_peaks(name, times, wrench)
    return json


def recorded(system: System, states: np.ndarray) -> np.ndarray:
    """Return states, (f, m), over the coordinates of the bodies' records, (f, n)."""
    blocks = [np.empty((len(states), 0))]
    for body in system.bodies.values():
        body_states = states[:, body.coordinates]
        blocks.append(body_states if body.basis is None else body_states @ body.basis.T)
    return np.hstack(blocks)


def recorded_offsets(system: System) -> dict[str, int]:
    """Return the first coordinate of each body over the coordinates of the records."""
    offsets, start = {}, 0
    for name, body in system.bodies.items():
        offsets[name] = start
        start += body.record_count
    return offsets
