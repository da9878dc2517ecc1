"""Histories that a user reads beside those of contacts, and their relative differences between runs.

Probes, gauges, forces of joints, displacements under moving forces, and bodies where nothing touches, have one estimate
each, by the largest difference of their histories over their largest size: peak, last value and all samples between are
within it.
"""

from collections.abc import Mapping

import numpy as np

from gudgeon.modaldb.records.trajectory import Trajectory
from gudgeon.solver.system.system import System

SILENT = 1e-9
"""Size of a reading over the largest one of its unit below which it is round-off."""


def readings(system: System, trajectory: Trajectory) -> dict[str, np.ndarray]:
    """Return the histories of a run by the names that estimates have, `probe.displacement` and so on, (s, k) each."""
    histories = {}
    for name, probe in trajectory.probes.items():
        if probe.kind != "centre":
            histories[f"{name}.{probe.kind}"] = probe.values[:, :3]
    for name, joint in trajectory.joints.items():
        histories[f"{name}.force"] = joint.force
    for name, values in trajectory.gauges.items():
        histories[name] = values.reshape(len(values), -1)
    if not system.contacts:  # Those that touch have rebound velocities.
        for name, motion in trajectory.motion.items():
            histories |= {f"{name}.displacement": motion[:, :3], f"{name}.rotation": motion[:, 3:6]}
    return histories | _under_moving_forces(system, trajectory)


def _under_moving_forces(system: System, trajectory: Trajectory) -> dict[str, np.ndarray]:
    """Return the displacements under moving forces along them, at frames [m], (f, 1)."""
    driving, histories = system.driving, {}
    travelling = [(load, rows) for load, rows in driving.given_rows() if load.travels]
    if travelling:
        loads = driving.loads(trajectory.frame_times, 0.0)
        moved = system.of_records(trajectory.frames) @ driving.rows.T + loads @ driving.residual
        for load, rows in travelling:
            size = np.abs(loads[:, rows].sum(axis=1))
            work = np.einsum("fk,fk->f", loads[:, rows], moved[:, rows])
            along = np.divide(work, size, out=np.zeros_like(work), where=size > 0)
            histories[f"{load.name}.deflection"] = along[:, None]
    return histories


def changes(reference: Mapping[str, np.ndarray], changed: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Return the largest differences of two runs' readings over the largest size of either: of a reading that one basis
    does not have at all, 1. Readings that are round-off beside others of their unit have none."""
    alike = [name for name in reference if reference[name].shape == changed[name].shape]
    sizes = {name: max(_size(reference[name]), _size(changed[name])) for name in alike}
    largest: dict[str, float] = {}
    for name, size in sizes.items():
        largest[_kind(name)] = max(largest.get(_kind(name), 0.0), size)
    return {
        name: _size(reference[name] - changed[name]) / size
        for name, size in sizes.items()
        if size > SILENT * largest[_kind(name)]
    }


def _size(values: np.ndarray) -> float:
    """Return the largest norm of a history, (s, k)."""
    return float(np.linalg.norm(values, axis=1).max(initial=0.0))


def _kind(name: str) -> str:
    return name.rpartition(".")[2]
