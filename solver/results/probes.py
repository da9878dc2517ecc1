"""Histories of probes, and their quantities."""

from collections.abc import Mapping

import numpy as np

from gudgeon.modaldb.records.trajectory import ContactHistory, JointHistory, ProbeHistory
from gudgeon.modaldb.records.types import Json
from gudgeon.solver.results.rates import Rates
from gudgeon.solver.scene.probe import DistanceProbe, PointProbe
from gudgeon.solver.system.probes import UNITS
from gudgeon.solver.system.reactions import MOMENTUM, spring_pulls, spring_rows, spring_tensions
from gudgeon.solver.system.system import System

Parts = tuple[Mapping[str, ContactHistory], Mapping[str, JointHistory], np.ndarray]
ALIKE = 1e-3
"""Relative difference of the turning points of a vibration that count as equal, of which the first is the peak."""
FOLLOWED = 0.6
"""Motion between two samples over the largest displacement up to which samples follow a vibration: one of amplitude A
moves by A ω h between them, and its sampled peak is low by (ω h)²/8, 5 % there."""
STILL = 1e-9
"""Motion between two samples over the largest deformation of a place up to which it is round-off."""
WRENCH = ("x", "y", "z", "moment x", "moment y", "moment z")


def recorded_probes(
    system: System,
    times: np.ndarray,
    values: np.ndarray,
    histories: Parts,
    wrenches: Mapping[str, np.ndarray],
    *,
    step: float,
) -> dict[str, ProbeHistory]:
    """Return the history of each probe.

    Args:
        times: Ends of the sample intervals [s], (s,).
        values: What the run recorded for all of them, (s, P).
        histories: Contacts and joints of the run, and the mean of each load row, (s, L).
        wrenches: Force and moment of each joint that holds a body, (s, 6).
        step: In which modes move under the mean of given loads [s]; 0 where their motion is exact.
    """
    probes, probe_histories = system.probes, {}
    moving = any(getattr(p, "kind", "") in ("velocity", "acceleration") for p in system.scene.probe.values())
    rates = Rates(system, float(times[0]), step, histories[2]) if moving and len(times) else None
    for i, name in enumerate(probes.names):
        readings, probe = values[:, probes.places[i]], system.scene.probe[name]
        columns, unit = probes.columns[i], "m"
        if isinstance(probe, PointProbe):
            unit = UNITS[probe.kind]
            if probe.kind in ("velocity", "acceleration"):
                start, readings = rates.of(i, readings) if rates else (None, readings)
                if probe.kind == "acceleration" and start is not None:
                    readings = np.diff(np.vstack([start, readings]), axis=0) / times[0]
        elif isinstance(probe, DistanceProbe):
            readings, columns = np.linalg.norm(readings, axis=1)[:, None], ("distance",)
        elif probe.kind == "centre":
            with np.errstate(invalid="ignore", divide="ignore"):
                readings = np.where(readings[:, :1] > 0, readings[:, 1:] / readings[:, :1], np.nan)
        elif (joint := probe.of.removeprefix("joint.")) in wrenches and probe.of.startswith("joint."):
            readings, columns, unit = wrenches[joint], WRENCH, "N, N m"
        else:
            start = probes.values(system.position[None], system.velocity[None])[:, probes.places[i]]
            readings, columns, unit = _force(system, probe.of, (start, readings, times[:1]), histories)
        probe_histories[name] = ProbeHistory(probe.kind, readings.copy(), unit, ", ".join(columns), probes.snapped[i])
    return probe_histories


def _force(
    system: System, of: str, read: tuple[np.ndarray, np.ndarray, np.ndarray], histories: Parts
) -> tuple[np.ndarray, tuple[str, ...], str]:
    """Return force, names of its columns and unit.

    Args:
        read: What the probe read at the start, (1, k), and at the ends of the sample intervals, (s, k); the first [s].
    """
    readings = read[1]
    kind, _, owner = of.partition(".")
    if kind == "contact":
        return histories[0][owner].force, ("x", "y", "z"), "N"
    if kind == "joint":
        return histories[1][owner].force, ("x", "y", "z"), "N"
    if kind == "body":
        return _reaction(system, owner, read, histories), ("x", "y", "z"), "N"
    if kind == "motion":
        return _driving_force(system, owner, histories[2])
    if owner in (fields := system.scene.fields()):
        axes = fields[owner].axes().T
        load_rows = next(load_rows for load, load_rows in system.driving.given_rows() if load.name == owner)
        wrench = np.hstack(
            [histories[2][:, load_rows][:, k : k + 3] @ axes for k in range(0, load_rows.stop - load_rows.start, 3)]
        )
        return wrench, WRENCH[: wrench.shape[1]], "N" if wrench.shape[1] == 3 else "N, N m"
    springs, count = system.springs, readings.shape[1] // 2
    rows = springs.of(owner)
    every = np.zeros(len(springs.stiffness))
    tension = np.empty((len(readings), count))
    for row, (elongation, rate) in enumerate(zip(readings[:, :count], readings[:, count:], strict=True)):
        every[rows] = elongation
        tension[row] = springs.tension(every)[0][rows] + springs.damping[rows] * rate
    if system.scene.force[owner].kind == "spring":
        return tension, ("tension",), "N"
    return -tension @ springs.motions[rows], WRENCH, "N, N m"


def _reaction(
    system: System, name: str, read: tuple[np.ndarray, np.ndarray, np.ndarray], histories: Parts
) -> np.ndarray:
    """Return the mean force by which supports and freedom hold a body [N], (s, 3)."""
    body, values = system.bodies[name], np.vstack(read[:2])
    force_sum = np.diff(values[:, :MOMENTUM], axis=0) / read[2] - body.morph.mass * np.asarray(system.scene.run.gravity)
    for contact in system.contacts:
        force = histories[0][contact.name].force
        for owner, *_, sign in contact.sides:
            if owner == name:
                force_sum = force_sum - sign * force
        if contact.master is not None and contact.master.body == name:
            force_sum = force_sum + force
    for joint in histories[1].values():
        if joint.body == name and body.basis is None:  # Joints of two markers hold it as supports do.
            force_sum = force_sum - joint.force
    for load, load_rows in [*system.driving.given_rows(), *system.driving.driven_rows()]:
        if load.body == name:
            force_sum = force_sum - histories[2][:, load_rows] @ load.resultant[:, :3]
    tensions = spring_tensions(name, system.springs, values[:, MOMENTUM:])
    rows = spring_rows(name, system.springs)
    count = len(rows)
    tensions[0] = -system.start_pulls[rows] + system.springs.damping[rows] * values[0, MOMENTUM + count :]
    pulls = spring_pulls(name, system.springs, tensions)
    return force_sum - 0.5 * (pulls[1:] + pulls[:-1])


def _driving_force(system: System, name: str, loads: np.ndarray) -> tuple[np.ndarray, tuple[str, ...], str]:
    """Return the force of a drive: on its interface, or along its direction on a rigid body."""
    drive, rows = next(r for r in system.driving.driven_rows() if r[0].name == name)
    if drive.interface is None:
        return loads[:, rows], ("along",), "N" if drive.motion.kind == "translation" else "N m"
    wrench = loads[:, rows] @ drive.mix
    return wrench, WRENCH[: wrench.shape[1]], "N" if wrench.shape[1] == 3 else "N, N m"


def _turning_point(times: np.ndarray, line: np.ndarray) -> tuple[float, float]:
    """Return the value and time of the first of a history's largest turning points, by parabolas."""
    before, y, after = line[:-2], line[1:-1], line[2:]
    slope, bend = 0.5 * (after - before), after - 2 * y + before
    turns = (np.abs(y) >= np.abs(before)) & (np.abs(y) >= np.abs(after)) & (y * bend < 0)
    if not turns.any():
        index = int(np.abs(line).argmax())
        return float(line[index]), float(times[index])
    y, slope, bend, middle = y[turns], slope[turns], bend[turns], times[1:-1][turns]
    sizes = y - 0.5 * slope**2 / bend
    earliest = int((np.abs(sizes) >= (1 - ALIKE) * np.abs(sizes).max()).argmax())
    return float(sizes[earliest]), float(middle[earliest] - slope[earliest] / bend[earliest] * (times[1] - times[0]))


def unresolved(
    system: System, interval: float, states: tuple[np.ndarray, np.ndarray], snapshots: np.ndarray
) -> list[str]:
    """Return a sentence for each probe whose place vibrates faster than samples follow.

    Args:
        interval: Between samples [s].
        states: Coordinates and their rates at frames, (f, m).
        snapshots: Rigid coordinates, then their rates, at samples, (s, 2 r or more).
    """
    rigid = system.rigid
    q, v = (np.vstack(pair) for pair in zip((system.position, system.velocity), states, strict=True))
    sentences = []
    for name, span in zip(system.probes.names, system.probes.places, strict=True):
        W = system.probes.rows[span] + system.probes.rates[span]
        rigid_motion = (snapshots[:, : len(rigid)] - system.position[rigid]) @ W[:, rigid].T
        moved = max(
            float(np.linalg.norm(u, axis=1).max(initial=0.0)) for u in ((q - system.position) @ W.T, rigid_motion)
        )
        between = interval * float(np.linalg.norm(v @ W.T, axis=1).max(initial=0.0))
        deformed = float(np.linalg.norm(q @ W.T, axis=1).max(initial=0.0))
        if between > max(FOLLOWED * moved, STILL * deformed) and moved + between > 0:
            sentences.append(
                f"probe.{name}: its history is that of samples {interval:.3g} s apart, between which its place moves by"
                f" {between:.3g}, while it is seen up to {moved:.3g} away; increase run.samples"
            )
    return sentences


def probe_quantities(times: np.ndarray, probes: Mapping[str, ProbeHistory], *, between: bool = False) -> Json:
    """Return the value of the largest size of each probe, its time and the last value; of vectors their length.

    Args:
        between: Whether the largest size may lie between samples, on a parabola through three; of equal ones the first.
    """
    json: Json = {}
    for name, probe in probes.items():
        if probe.kind == "centre" or not len(times):
            continue
        values = probe.values[:, :3]
        line = values[:, 0] if values.shape[1] == 1 else np.linalg.norm(values, axis=1)
        unit, peak_index = probe.unit.partition(",")[0], int(np.abs(line).argmax())
        peak, time = (
            _turning_point(times, line)
            if between and 0 < peak_index < len(line) - 1
            else (line[peak_index], times[peak_index])
        )
        json |= {
            f"{name}.{probe.kind}_peak": {"value": float(peak), "unit": unit},
            f"{name}.{probe.kind}_peak_time": {"value": float(time), "unit": "s"},
            f"{name}.{probe.kind}_end": {"value": float(line[-1]), "unit": unit},
        }
    return json
