"""Histories of probes, and their quantities."""

from collections.abc import Mapping

import numpy as np

from gudgeon.modaldb.records.trajectory import ContactHistory, JointHistory, ProbeHistory
from gudgeon.modaldb.records.types import Json
from gudgeon.solver.scene.probe import DistanceProbe, PointProbe
from gudgeon.solver.system.probes import UNITS
from gudgeon.solver.system.system import System

Parts = tuple[Mapping[str, ContactHistory], Mapping[str, JointHistory], np.ndarray]
WRENCH = ("x", "y", "z", "moment x", "moment y", "moment z")


def recorded_probes(system: System, times: np.ndarray, values: np.ndarray, parts: Parts) -> dict[str, ProbeHistory]:
    """Return the history of each probe.

    Args:
        times: Ends of the sample intervals [s], (s,).
        values: What the run recorded for all of them, (s, P).
        parts: Contacts and joints of the run, and the mean of each load row, (s, L).
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
        else:
            own, columns, unit = _force(system, probe.of, own, parts)
        found[name] = ProbeHistory(probe.kind, own.copy(), unit, ", ".join(columns), probes.snapped[number])
    return found


def _force(system: System, of: str, own: np.ndarray, parts: Parts) -> tuple[np.ndarray, tuple[str, ...], str]:
    """Return force, names of its columns and unit."""
    kind, _, owner = of.partition(".")
    if kind == "contact":
        return parts[0][owner].force, ("x", "y", "z"), "N"
    if kind == "joint":
        return parts[1][owner].force, ("x", "y", "z"), "N"
    if kind == "motion":
        return _driving_force(system, owner, parts[2])
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
