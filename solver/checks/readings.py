"""Histories that a user reads beside those of contacts, and their relative differences between runs.

Probes, gauges, forces of joints, displacements under moving forces, and bodies where nothing touches, have one estimate
each, by the largest difference of their histories over their largest size: peak, last value and all samples between are
within it. The motion of a body that may touch is read at the end alone, over its largest size.
"""

from collections.abc import Mapping

import numpy as np

from gudgeon.modaldb.records.trajectory import IMPULSE, Trajectory
from gudgeon.solver.system.system import System

SILENT = 1e-9
"""Size of a reading over the largest one of its unit below which it is round-off; of rotations, over 1 rad too."""
AT_REST = 1e-6
"""Motion of a body over what start, weight and contacts could give it, up to which it is at rest."""
NUMBERS = (
    "duration",
    "pressure_peak",
    "load_distance",
    "wear_volume",
    "against_wear_volume",
    "friction_work",
    "moment_peak",
    "angle_end",
)
"""Quantities of contacts and joints that are compared by themselves."""
MOTIONS = ("displacement", "rotation", "velocity", "angular_velocity")
"""Columns of `Trajectory.motion`, three each."""
TURNING = ("rotation", "angular_velocity", "angle_end")


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
    histories |= _motions(system, trajectory)
    # Joints whose forces all pass through their points have moments of round-off.
    pulls = [_size(joint.force) for joint in trajectory.joints.values()]
    levers = [body.gyration for body in system.bodies.values()]
    silent = {"moment_peak": SILENT * max(pulls, default=0.0) * max(levers, default=0.0)}
    for name, entry in trajectory.quantities.items():
        quantity = name.partition(".")[2]
        if quantity in NUMBERS and abs(entry["value"]) >= silent.get(quantity, 0.0):
            histories[name] = np.array([[entry["value"]]])
    return histories | _under_moving_forces(system, trajectory)


def _motions(system: System, trajectory: Trajectory) -> dict[str, np.ndarray]:
    """Return the motions of bodies: those that contacts could touch at the end alone, and none where nothing touches.

    An impact a little later is another velocity for a moment: what is printed is the end's.
    """
    untouched = bool(system.contacts) and not any(np.any(c.force) for c in trajectory.contacts.values())
    histories = {}
    for name, motion in () if untouched else trajectory.motion.items():
        along = {kind: motion[:, 3 * i : 3 * i + 3] for i, kind in enumerate(MOTIONS)}
        scales = _scales(system, trajectory, name) if system.contacts else _swings(system, name)
        if system.contacts:
            along = {kind: _at_end(values) for kind, values in along.items()}
        along = {kind: values for kind, values in along.items() if _size(values) > AT_REST * scales[kind]}
        histories |= {f"{name}.{kind}": values for kind, values in along.items()}
    return histories


def _scales(system: System, trajectory: Trajectory, name: str) -> dict[str, float]:
    """Return the motions that the start, weight and contacts could give a body: by kind, in the units of `MOTIONS`."""
    body, run = system.bodies[name], system.scene.run
    touching = [contact.name for contact in system.contacts if name in {side[0] for side in contact.sides}]
    impulse = sum(float(trajectory.impacts[contact][:, IMPULSE].sum()) for contact in touching)
    start = float(np.linalg.norm(body.centre_motion(system.velocity[body.rigid])[:3]))
    speed = start + impulse / body.morph.mass + float(np.linalg.norm(run.gravity)) * run.duration
    turning = speed / body.gyration if body.gyration > 0 else 0.0
    return {
        "displacement": speed * run.duration, "velocity": speed,
        "rotation": turning * run.duration, "angular_velocity": turning,
    }  # fmt: skip


def _swings(system: System, name: str) -> dict[str, float]:
    """Return the motions of a pendulum of the size of a body under its weight, as `_scales` does; zeros without one."""
    size, g = system.bodies[name].gyration, float(np.linalg.norm(system.scene.run.gravity))
    swings = bool(g) and size > 0
    return {
        "displacement": size * swings, "velocity": np.sqrt(g * size),
        "rotation": float(swings), "angular_velocity": np.sqrt(g / size) if swings else 0.0,
    }  # fmt: skip


def _at_end(values: np.ndarray) -> np.ndarray:
    """Return the largest size of a history as a row, and its last value, (2, 3)."""
    return np.array([[_size(values), 0.0, 0.0], values[-1]]) if len(values) else values


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
    alike = [name for name in reference if name in changed and reference[name].shape == changed[name].shape]
    sizes = {name: max(_size(reference[name]), _size(changed[name])) for name in alike}
    largest: dict[str, float] = {}
    for name, size in sizes.items():
        largest[_kind(name)] = max(largest.get(_kind(name), 0.0), size)
    return {
        name: _size(reference[name] - changed[name]) / size
        for name, size in sizes.items()
        if size > SILENT * max(largest[_kind(name)], float(_kind(name) in TURNING))
    }


def _size(values: np.ndarray) -> float:
    """Return the largest norm of a history, (s, k)."""
    return float(np.linalg.norm(values, axis=1).max(initial=0.0))


def _kind(name: str) -> str:
    return name.rpartition(".")[2]
