"""Histories of probes, and their quantities."""

from collections.abc import Mapping

import numpy as np

from gudgeon.modaldb.records.trajectory import ContactHistory, JointHistory, ProbeHistory
from gudgeon.modaldb.records.types import Json
from gudgeon.solver.scene.probe import DistanceProbe, PointProbe
from gudgeon.solver.system.probes import UNITS
from gudgeon.solver.system.reactions import MOMENTUM, spring_pulls, spring_rows, spring_tensions
from gudgeon.solver.system.system import System

Parts = tuple[Mapping[str, ContactHistory], Mapping[str, JointHistory], np.ndarray]
WRENCH = ("x", "y", "z", "moment x", "moment y", "moment z")


def recorded_probes(
    system: System, times: np.ndarray, values: np.ndarray, parts: Parts, wrenches: Mapping[str, np.ndarray]
) -> dict[str, ProbeHistory]:
    """Return the history of each probe.

    Args:
        times: Ends of the sample intervals [s], (s,).
        values: What the run recorded for all of them, (s, P).
        parts: Contacts and joints of the run, and the mean of each load row, (s, L).
        wrenches: Force and moment of each joint that holds a body, (s, 6).
    """
    probes, found = system.probes, {}
    for number, name in enumerate(probes.names):
        own, probe = values[:, probes.places[number]], system.scene.probe[name]
        columns, unit = probes.columns[number], "m"
        if isinstance(probe, PointProbe):
            unit = UNITS[probe.kind]
            if probe.kind == "acceleration":
                start = probes.values(system.position[None], system.velocity[None])[:, probes.places[number]]
                own = np.diff(np.vstack([start, own]), axis=0) / times[0]
        elif isinstance(probe, DistanceProbe):
            own, columns = np.linalg.norm(own, axis=1)[:, None], ("distance",)
        elif probe.kind == "centre":
            with np.errstate(invalid="ignore", divide="ignore"):
                own = np.where(own[:, :1] > 0, own[:, 1:] / own[:, :1], np.nan)
        elif (joint := probe.of.removeprefix("joint.")) in wrenches and probe.of.startswith("joint."):
            own, columns, unit = wrenches[joint], WRENCH, "N, N m"
        else:
            start = probes.values(system.position[None], system.velocity[None])[:, probes.places[number]]
            own, columns, unit = _force(system, probe.of, (start, own, times[:1]), parts)
        found[name] = ProbeHistory(probe.kind, own.copy(), unit, ", ".join(columns), probes.snapped[number])
    return found


def _force(
    system: System, of: str, read: tuple[np.ndarray, np.ndarray, np.ndarray], parts: Parts
) -> tuple[np.ndarray, tuple[str, ...], str]:
    """Return force, names of its columns and unit.

    Args:
        read: What the probe read at the start, (1, k), and at the ends of the sample intervals, (s, k); the first [s].
    """
    own = read[1]
    kind, _, owner = of.partition(".")
    if kind == "contact":
        return parts[0][owner].force, ("x", "y", "z"), "N"
    if kind == "joint":
        return parts[1][owner].force, ("x", "y", "z"), "N"
    if kind == "body":
        return _reaction(system, owner, read, parts), ("x", "y", "z"), "N"
    if kind == "motion":
        return _driving_force(system, owner, parts[2])
    if owner in (fields := system.scene.fields()):
        axes = fields[owner].axes().T
        at = next(at for load, at in system.driving.given_rows() if load.name == owner)
        found = np.hstack([parts[2][:, at][:, k : k + 3] @ axes for k in range(0, at.stop - at.start, 3)])
        return found, WRENCH[: found.shape[1]], "N" if found.shape[1] == 3 else "N, N m"
    springs, count = system.springs, own.shape[1] // 2
    here = springs.of(owner)
    every = np.zeros(len(springs.stiffness))
    tension = np.empty((len(own), count))
    for row, (elongation, rate) in enumerate(zip(own[:, :count], own[:, count:], strict=True)):
        every[here] = elongation
        tension[row] = springs.tension(every)[0][here] + springs.damping[here] * rate
    if system.scene.force[owner].kind == "spring":
        return tension, ("tension",), "N"
    return -tension @ springs.motions[here], WRENCH, "N, N m"


def _reaction(system: System, name: str, read: tuple[np.ndarray, np.ndarray, np.ndarray], parts: Parts) -> np.ndarray:
    """Return the mean force by which supports and freedom hold a body [N], (s, 3)."""
    body, values = system.bodies[name], np.vstack(read[:2])
    held = np.diff(values[:, :MOMENTUM], axis=0) / read[2] - body.morph.mass * np.asarray(system.scene.run.gravity)
    for contact in system.contacts:
        force = parts[0][contact.name].force
        for owner, *_, sign in contact.sides:
            if owner == name:
                held = held - sign * force
        if contact.master is not None and contact.master.body == name:
            held = held + force
    for joint in parts[1].values():
        if joint.body == name and body.basis is None:  # Joints of two markers hold it as supports do.
            held = held - joint.force
    for push, at in [*system.driving.given_rows(), *system.driving.driven_rows()]:
        if push.body == name:
            held = held - parts[2][:, at] @ push.resultant[:, :3]
    tensions = spring_tensions(name, system.springs, values[:, MOMENTUM:])
    own = spring_rows(name, system.springs)
    count = len(own)
    tensions[0] = -system.start_pulls[own] + system.springs.damping[own] * values[0, MOMENTUM + count :]
    pulls = spring_pulls(name, system.springs, tensions)
    return held - 0.5 * (pulls[1:] + pulls[:-1])


def _driving_force(system: System, name: str, loads: np.ndarray) -> tuple[np.ndarray, tuple[str, ...], str]:
    """Return the force of a drive: on its interface, or along its direction on a rigid body."""
    drive, here = next(one for one in system.driving.driven_rows() if one[0].name == name)
    if drive.interface is None:
        return loads[:, here], ("along",), "N" if drive.motion.kind == "translation" else "N m"
    found = loads[:, here] @ drive.mix
    return found, WRENCH[: found.shape[1]], "N" if found.shape[1] == 3 else "N, N m"


def probe_quantities(times: np.ndarray, probes: Mapping[str, ProbeHistory]) -> Json:
    """Return the value of the largest size of each probe, its time and the last value; of vectors their length."""
    found: Json = {}
    for name, probe in probes.items():
        if probe.kind == "centre" or not len(times):
            continue
        values = probe.values[:, :3]
        line = values[:, 0] if values.shape[1] == 1 else np.linalg.norm(values, axis=1)
        unit, most = probe.unit.partition(",")[0], int(np.abs(line).argmax())
        found |= {
            f"{name}.{probe.kind}_peak": {"value": float(line[most]), "unit": unit},
            f"{name}.{probe.kind}_peak_time": {"value": float(times[most]), "unit": "s"},
            f"{name}.{probe.kind}_end": {"value": float(line[-1]), "unit": unit},
        }
    return found
